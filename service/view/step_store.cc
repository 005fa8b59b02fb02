// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/step_store.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace prescene::service {
namespace {

core::Status write_all(int descriptor, std::string_view bytes, std::uint64_t offset) {
  while (!bytes.empty()) {
    const ssize_t count = pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0)
      return core::unavailable(std::string("the temporary file of the view: ") + std::strerror(errno) +
                               "; set TMPDIR to a folder with more room");
    bytes.remove_prefix(static_cast<std::size_t>(count));
    offset += static_cast<std::uint64_t>(count);
  }
  return core::ok_status();
}

}  // namespace

core::Result<std::unique_ptr<StepStore>> StepStore::create(std::uint64_t most_bytes) {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  std::string name = ((error ? std::filesystem::path("/tmp") : folder) / "prescene-view-XXXXXX").string();
  const int descriptor = mkstemp(name.data());
  if (descriptor < 0)
    return core::unavailable(name + ": " + std::strerror(errno) + "; set TMPDIR to a folder that can be written");
  unlink(name.c_str());  // it lives as long as its descriptor
  return std::unique_ptr<StepStore>(new StepStore(descriptor, most_bytes));
}

StepStore::~StepStore() { close(descriptor_); }

core::Status StepStore::add(std::string_view text, std::string_view picture) {
  const std::lock_guard lock(mutex_);
  if (end_ + picture.size() > most_bytes_ && !picture.empty()) {
    picture = {};
    ++left_out_;
  }
  PRESCENE_RETURN_IF_ERROR(write_all(descriptor_, text, end_));
  PRESCENE_RETURN_IF_ERROR(write_all(descriptor_, picture, end_ + text.size()));
  places_.push_back({end_, static_cast<std::uint32_t>(text.size()), static_cast<std::uint32_t>(picture.size())});
  end_ += text.size() + picture.size();
  return core::ok_status();
}

std::uint64_t StepStore::size() const {
  const std::lock_guard lock(mutex_);
  return places_.size();
}

std::uint64_t StepStore::pictures_left_out() const {
  const std::lock_guard lock(mutex_);
  return left_out_;
}

core::Result<StepStore::Entry> StepStore::read(std::uint64_t index) const {
  Place place{};
  {
    const std::lock_guard lock(mutex_);
    if (index >= places_.size()) return core::not_found("there is no step with the index " + std::to_string(index));
    place = places_[index];
  }
  std::string bytes(std::size_t{place.text_bytes} + place.picture_bytes, '\0');
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count =
        pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(place.offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return core::unavailable("the temporary file of the view can't be read");
    done += static_cast<std::size_t>(count);
  }
  return Entry{bytes.substr(0, place.text_bytes), bytes.substr(place.text_bytes)};
}

}  // namespace prescene::service
