// SPDX-License-Identifier: Apache-2.0
#include "confined_files.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <system_error>
#include <utility>

#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

using core::Result;

class FileStream final : public Assimp::IOStream {
 public:
  explicit FileStream(InputFile file) : file_(std::move(file)) {}

  std::size_t Read(void* out, std::size_t size, std::size_t count) override {
    if (size == 0 || count == 0) return 0;
    const std::size_t items = std::min(count, (FileSize() - position_) / size);
    if (!file_.read(position_, {static_cast<std::uint8_t*>(out), items * size}).ok()) return 0;
    position_ += items * size;
    return items;
  }
  std::size_t Write(const void* /*bytes*/, std::size_t /*size*/, std::size_t /*count*/) override { return 0; }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    // Offsets back from the place or the end come as large numbers that wrap around.
    std::size_t to = offset;
    if (origin == aiOrigin_CUR) to = position_ + offset;
    if (origin == aiOrigin_END) to = FileSize() + offset;
    if (to > FileSize()) return aiReturn_FAILURE;
    position_ = to;
    return aiReturn_SUCCESS;
  }
  std::size_t Tell() const override { return position_; }
  std::size_t FileSize() const override { return file_.size(); }
  void Flush() override {}

 private:
  InputFile file_;
  std::size_t position_ = 0;
};

bool is_below(const std::filesystem::path& path, const std::filesystem::path& folder) {
  return !folder.empty() && std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

}  // namespace

ConfinedFiles::ConfinedFiles(const std::filesystem::path& model, std::size_t max_bytes)
    : model_(model), max_bytes_(max_bytes) {
  std::error_code ignored;
  const std::filesystem::path parent = model.parent_path();
  folder_ = std::filesystem::canonical(parent.empty() ? "." : parent, ignored);
  folder_of_target_ = std::filesystem::canonical(model, ignored).parent_path();
}

Result<InputFile> ConfinedFiles::open_file(const std::filesystem::path& path) const {
  if (path != model_) {
    std::error_code error;
    const std::filesystem::path target = std::filesystem::canonical(path, error);
    if (error) return core::not_found(quote(path.string(), 160) + ": " + error.message());
    if (!is_below(target, folder_) && !is_below(target, folder_of_target_)) {
      return core::invalid_input(quote(path.string(), 160) +
                                 " is outside of the model's folder; put it beside the model");
    }
  }
  PRESCENE_TRY(InputFile file, InputFile::open(path));
  if (file.size() > max_bytes_) {
    return core::resource_exhausted(quote(path.string(), 160) + ": " + size_text(file.size()) +
                                    " are more than the limit of " + size_text(max_bytes_));
  }
  return file;
}

bool ConfinedFiles::Exists(const char* path) const { return open_file(path).ok(); }

Assimp::IOStream* ConfinedFiles::Open(const char* path, const char* mode) {
  if (mode == nullptr || *mode != 'r') return nullptr;
  Result<InputFile> file = open_file(path);
  if (file) return new FileStream(*std::move(file));  // NOLINT(cppcoreguidelines-owning-memory): Close() deletes it
  refusal_ = file.status().message();
  return nullptr;
}

void ConfinedFiles::Close(Assimp::IOStream* stream) { delete stream; }  // NOLINT(cppcoreguidelines-owning-memory)

}  // namespace prescene::interfaces
