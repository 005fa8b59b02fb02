// SPDX-License-Identifier: Apache-2.0
#include "chunk_index_store.h"

#include <algorithm>
#include <system_error>
#include <utility>

namespace prescene::interfaces {
namespace {

using core::Status;

constexpr std::size_t kMostIndexInMemory = std::size_t{256} << 10;

}  // namespace

Status ChunkIndexStore::add(const mcap_records::ChunkIndex& index) {
  const std::size_t before = newest_.size();
  try {
    append(index, &newest_);
    if (newest_.size() >= kMostIndexInMemory && !out_.is_open()) PRESCENE_RETURN_IF_ERROR(open_file());
  } catch (...) {  // no memory: the chunk is not written either
    newest_.resize(before);
    throw;
  }
  if (newest_.size() < kMostIndexInMemory) return core::ok_status();
  PRESCENE_RETURN_IF_ERROR(out_.write(newest_));
  in_file_ += newest_.size();
  newest_.clear();
  return core::ok_status();
}

Status ChunkIndexStore::open_file() {
  PRESCENE_TRY(const std::filesystem::path path, create_beside(recording_));
  auto out = OutputFile::create(path, recording_);
  auto in = InputFile::open(path);
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  PRESCENE_RETURN_IF_ERROR(out.status());
  PRESCENE_RETURN_IF_ERROR(in.status());
  out_ = *std::move(out);
  in_ = *std::move(in);
  return core::ok_status();
}

Status ChunkIndexStore::read(const std::function<Status(std::span<const std::uint8_t>)>& take) {
  std::vector<std::uint8_t> piece;
  for (std::uint64_t at = 0; at < in_file_; at += piece.size()) {
    piece.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kMostIndexInMemory, in_file_ - at)));
    PRESCENE_RETURN_IF_ERROR(in_.read(at, piece));
    PRESCENE_RETURN_IF_ERROR(take(piece));
  }
  return take(newest_);
}

}  // namespace prescene::interfaces
