// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bags/bag_reader.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "bag_metadata.h"
#include "db3_reader.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {

using core::Result;
using core::Status;

bool is_bag(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return true;
  for (const char* of_images : {"frames", "camera_poses.csv", "intrinsics.K.txt", "color.png"})
    if (std::filesystem::exists(path / of_images, error)) return false;
  if (std::filesystem::exists(path / kBagMetadataName, error)) return true;
  for (std::filesystem::directory_iterator file(path, error), end; !error && file != end; file.increment(error))
    if (is_bag_file(file->path())) return true;
  return false;
}

struct BagReader::Impl {
  BagReaderOptions options;
  std::string storage;
  std::vector<std::filesystem::path> files;
  std::optional<std::uint64_t> message_count;
  std::string lost, unchecked;  ///< Of the files that are done, and of the folder.

  std::size_t at = 0;  ///< Of the file that is open.
  std::unique_ptr<McapReader> mcap;
  std::unique_ptr<Db3Reader> db3;
  std::vector<McapChannel> channels;
  std::size_t first_channel = 0;  ///< Of the file that is open.

  Status open_file();
  void take_channels(const std::vector<McapChannel>& of_file);
  std::string with_name(const std::string& text) const {
    return files.size() == 1 || text.empty() ? text : files[at].filename().string() + ": " + text;
  }
  std::string lost_here() const {
    return with_name(mcap ? mcap->loss().text() : db3 ? db3->loss_text() : std::string());
  }
  std::string unchecked_here() const {
    if (db3) return with_name("a .db3 holds no checksums: damage to what it holds can't be noticed");
    return with_name(mcap ? mcap->unchecked().text() : std::string());
  }
};

namespace {

std::string joined(const std::string& a, const std::string& b) { return a.empty() || b.empty() ? a + b : a + "; " + b; }

/// Some tools give types of ROS 2 their short names: sensor_msgs/Image for sensor_msgs/msg/Image.
void lengthen_type_name(McapChannel& channel) {
  std::string& name = channel.schema.name;
  const std::size_t slash = name.find('/');
  const bool is_short = slash != std::string::npos && slash == name.rfind('/') && slash > 0 && slash + 1 < name.size();
  if (channel.message_encoding == "cdr" && is_short) name.insert(slash, "/msg");
}

}  // namespace

void BagReader::Impl::take_channels(const std::vector<McapChannel>& of_file) {
  for (std::size_t i = channels.size() - first_channel; i < of_file.size(); ++i) {
    channels.push_back(of_file[i]);
    lengthen_type_name(channels.back());
  }
}

Status BagReader::Impl::open_file() {
  const std::filesystem::path& path = files[at];
  first_channel = channels.size();
  mcap.reset();
  db3.reset();
  if (path.extension() == ".db3") {
    storage = "sqlite3";
    PRESCENE_TRY(db3, Db3Reader::open(path, options.salvage));
    take_channels(db3->channels());
    return core::ok_status();
  }
  storage = "mcap";
  McapReaderOptions mcap_options;
  mcap_options.salvage = options.salvage;
  mcap_options.check_data = options.check_data;
  PRESCENE_TRY(mcap, McapReader::open(path, mcap_options));
  take_channels(mcap->channels());
  return core::ok_status();
}

BagReader::BagReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BagReader::~BagReader() = default;

Result<std::unique_ptr<BagReader>> BagReader::open(const std::filesystem::path& path, const BagReaderOptions& options) {
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) {
    impl->files = {path};
  } else {
    const bool has_metadata = std::filesystem::exists(path / kBagMetadataName, error);
    PRESCENE_TRY(BagMetadata metadata, has_metadata ? read_bag_metadata(path) : bag_without_metadata(path));
    if (!has_metadata) impl->lost = "the bag was not closed: it has no metadata.yaml";
    // What MCAP compresses by itself, rosbag2 does not call compressed.
    if (!metadata.compression_mode.empty()) {
      return core::unsupported(path.string() + ": is compressed by rosbag2 (" + quote(metadata.compression_mode, 20) +
                               ", " + quote(metadata.compression, 20) +
                               "); unpack it with `ros2 bag convert`, or `zstd -d` for whole files");
    }
    impl->files = std::move(metadata.files);
    impl->message_count = metadata.message_count;
    for (const std::filesystem::path& file : impl->files) {
      if (!is_bag_file(file))
        return core::unsupported(file.string() + ": is neither .mcap nor .db3; unpack or convert it first");
    }
  }
  PRESCENE_RETURN_IF_ERROR(impl->open_file());
  return std::unique_ptr<BagReader>(new BagReader(std::move(impl)));
}

const std::string& BagReader::storage() const { return impl_->storage; }
const std::vector<std::filesystem::path>& BagReader::files() const { return impl_->files; }
const std::vector<McapChannel>& BagReader::channels() const { return impl_->channels; }

std::optional<std::uint64_t> BagReader::message_count() const {
  if (impl_->message_count || impl_->files.size() > 1 || !impl_->mcap) return impl_->message_count;
  return impl_->mcap->message_count();
}

std::vector<McapMetadata> BagReader::metadata() const {
  return impl_->mcap && impl_->files.size() == 1 ? impl_->mcap->metadata() : std::vector<McapMetadata>();
}

std::vector<McapReader::AttachedFile> BagReader::attachments() const {
  return impl_->mcap && impl_->files.size() == 1 ? impl_->mcap->attachments() : std::vector<McapReader::AttachedFile>();
}

Result<McapAttachment> BagReader::attachment(const std::string& name) const {
  if (!impl_->mcap || impl_->files.size() > 1)
    return core::not_found(impl_->files.front().string() + ": has no attachment " + quote(name));
  return impl_->mcap->attachment(name);
}

Result<std::optional<McapMessage>> BagReader::next() {
  Impl& impl = *impl_;
  while (impl.mcap || impl.db3) {  // neither after a file that could not be opened
    PRESCENE_TRY(std::optional<McapMessage> message, impl.mcap ? impl.mcap->next() : impl.db3->next());
    if (impl.mcap) impl.take_channels(impl.mcap->channels());
    if (message) {
      message->channel += static_cast<int>(impl.first_channel);
      return message;
    }
    if (impl.at + 1 >= impl.files.size()) return std::optional<McapMessage>();
    impl.lost = joined(impl.lost, impl.lost_here());
    impl.unchecked = joined(impl.unchecked, impl.unchecked_here());
    ++impl.at;
    PRESCENE_RETURN_IF_ERROR(impl.open_file());
  }
  return std::optional<McapMessage>();
}

std::string BagReader::loss_text() const { return joined(impl_->lost, impl_->lost_here()); }
std::string BagReader::unchecked_text() const { return joined(impl_->unchecked, impl_->unchecked_here()); }

}  // namespace prescene::interfaces
