// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/kept_file.h"

#include <cstdint>
#include <exception>
#include <string_view>
#include <system_error>
#include <utility>

#include "disk.h"
#include "prescene/interfaces/bytes/file.h"

namespace prescene::interfaces {
namespace {

using core::Status;

/// `partial` becomes `target`, which was asked for as `path`; where this fails, the caller removes it.
Status write_and_sync(const std::filesystem::path& partial, const std::filesystem::path& target,
                      const std::filesystem::path& path, const std::string& text) {
  PRESCENE_TRY(OutputFile file, OutputFile::create(partial, path));
  PRESCENE_RETURN_IF_ERROR(file.write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
  // Some file systems would else keep the new name before the new content.
  PRESCENE_RETURN_IF_ERROR(file.sync());
  std::error_code error;
  std::filesystem::rename(partial, target, error);
  if (error) return core::unavailable(path.string() + ": cannot be replaced: " + error.message());
  PRESCENE_RETURN_IF_ERROR(file.close());
  return sync_name(target);
}

Status replace(const std::filesystem::path& path, const std::string& text) {
  std::error_code error;
  // What a link names is replaced, not the link; a device is written to.
  const std::filesystem::path resolved = std::filesystem::weakly_canonical(path, error);
  const std::filesystem::path& target = error ? path : resolved;
  if (std::filesystem::exists(target, error) && !std::filesystem::is_regular_file(target, error))
    return write_file(path, std::string_view(text));
  PRESCENE_TRY(const std::filesystem::path partial, create_beside(target, path));
  Status written = write_and_sync(partial, target, path, text);
  if (!written.ok()) std::filesystem::remove(partial, error);
  return written;
}

}  // namespace

KeptFile::KeptFile(std::filesystem::path path) : path_(std::move(path)), thread_([this] { run(); }) {}

KeptFile::~KeptFile() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void KeptFile::put(std::string text) {
  const std::lock_guard lock(mutex_);
  waiting_ = std::move(text);
  changed_.notify_all();
}

Status KeptFile::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !waiting_ && !is_writing_; });
  return status_;
}

bool KeptFile::is_busy() const {
  const std::lock_guard lock(mutex_);
  return waiting_.has_value() || is_writing_;
}

Status KeptFile::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void KeptFile::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ended_ || waiting_; });
    if (!waiting_) return;
    const std::string text = *std::exchange(waiting_, std::nullopt);
    is_writing_ = true;
    lock.unlock();
    Status written;
    try {
      written = replace(path_, text);
    } catch (const std::exception& failed) {  // no memory
      written = core::resource_exhausted(path_.string() + ": cannot be written: " + failed.what());
    }
    lock.lock();
    status_ = std::move(written);
    is_writing_ = false;
    changed_.notify_all();
  }
}

}  // namespace prescene::interfaces
