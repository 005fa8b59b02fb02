// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/mcap/mcap_writer.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <set>
#include <utility>

#include "chunk_index_store.h"
#include "mcap_compression.h"
#include "mcap_records.h"
#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/background_sync.h"
#include "prescene/interfaces/bytes/crc32.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/schemas.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;
namespace records = mcap_records;

constexpr std::size_t kMostIds = 65535;

void add_time(std::uint64_t time, std::uint64_t count_before, std::uint64_t* start, std::uint64_t* end) {
  *start = count_before == 0 ? time : std::min(*start, time);
  *end = count_before == 0 ? time : std::max(*end, time);
}

}  // namespace

struct McapWriter::Impl {
  explicit Impl(const std::filesystem::path& path) : chunk_indexes(path) {}

  McapWriterOptions options;
  OutputFile file;
  std::unique_ptr<BackgroundSync> sync;  ///< Null: none is asked for.
  std::uint64_t position = 0;
  std::uint32_t data_crc = 0;
  Status failure;  ///< Stays once a write has failed.
  bool closed = false;

  std::vector<McapChannel> channels;
  std::vector<records::Channel> channel_records;
  std::vector<records::Schema> schemas;
  ChunkIndexStore chunk_indexes;
  std::vector<records::MetadataIndex> metadata_indexes;
  std::vector<records::AttachmentIndex> attachment_indexes;
  records::Statistics statistics;

  // The open chunk.
  std::vector<std::uint8_t> chunk;
  records::ChunkHead chunk_head;
  std::uint64_t chunk_messages = 0;
  std::map<std::uint16_t, records::MessageIndex> chunk_channels;
  std::set<std::uint16_t> chunk_schemas;
  Compressor compressor{McapCompression::kNone};
  std::vector<std::uint8_t> chunk_record;  ///< The memory of the last one, for the next.

  Status write_bytes(std::span<const std::uint8_t> bytes);
  Status add_message(const records::Channel& channel, const records::MessageHead& head,
                     std::span<const std::uint8_t> data);
  void begin_message(const records::Channel& channel);
  /// Where the open chunk ends before a message.
  struct Mark {
    std::size_t bytes = 0;
    bool has_channel = false;  ///< The chunk holds the message's channel already, ...
    bool has_schema = false;   ///< ... and its schema.
    std::size_t entries = 0;   ///< Of that channel.
    records::ChunkHead head;
    std::uint64_t messages = 0;
    std::uint64_t chunks = 0;                                                      ///< That were written.
    std::uint64_t all_messages = 0, start_time = 0, end_time = 0, of_channel = 0;  ///< Of the statistics.
  };
  Mark mark(const records::Channel& channel) const;
  void go_back_to(const Mark& mark, const records::Channel& channel);
  Status end_chunk();
  Status write_summary();
};

Status McapWriter::Impl::write_bytes(std::span<const std::uint8_t> bytes) {
  if (!failure.ok()) return failure;
  failure = Status(core::StatusCode::kUnavailable, "not written");  // stays where an exception ends the next line
  failure = file.write(bytes);
  position += bytes.size();
  data_crc = crc32(bytes, data_crc);
  if (sync) {
    sync->note_written();
    if (failure.ok()) failure = sync->status();
  }
  return failure;
}

/// Each chunk repeats the schemas and channels that it uses, so that it can be understood when the others are lost.
void McapWriter::Impl::begin_message(const records::Channel& channel) {
  const auto [entry, is_new] = chunk_channels.try_emplace(channel.id);
  if (!is_new) return;
  entry->second.channel_id = channel.id;
  if (channel.schema_id != 0 && chunk_schemas.insert(channel.schema_id).second) {
    records::append(schemas[channel.schema_id - std::size_t{1}], &chunk);
  }
  records::append(channel, &chunk);
}

McapWriter::Impl::Mark McapWriter::Impl::mark(const records::Channel& channel) const {
  const auto entries = chunk_channels.find(channel.id);
  const auto count = statistics.channel_message_counts.find(channel.id);
  Mark mark;
  mark.bytes = chunk.size();
  mark.has_channel = entries != chunk_channels.end();
  mark.has_schema = chunk_schemas.contains(channel.schema_id);
  mark.entries = mark.has_channel ? entries->second.entries.size() : 0;
  mark.head = chunk_head;
  mark.messages = chunk_messages;
  mark.chunks = statistics.chunk_count;
  mark.all_messages = statistics.message_count;
  mark.start_time = statistics.start_time;
  mark.end_time = statistics.end_time;
  mark.of_channel = count == statistics.channel_message_counts.end() ? 0 : count->second;
  return mark;
}

/// Takes no memory: it is called where there was none.
void McapWriter::Impl::go_back_to(const Mark& mark, const records::Channel& channel) {
  if (statistics.chunk_count != mark.chunks) {  // The message is in the file, or a part of it.
    failure = Status(core::StatusCode::kResourceExhausted, "out of memory");
    return;
  }
  chunk.resize(mark.bytes);
  if (!mark.has_channel) {
    chunk_channels.erase(channel.id);
  } else {
    chunk_channels.find(channel.id)->second.entries.resize(mark.entries);
  }
  if (!mark.has_schema) chunk_schemas.erase(channel.schema_id);
  chunk_head = mark.head;
  chunk_messages = mark.messages;
  statistics.message_count = mark.all_messages;
  statistics.start_time = mark.start_time;
  statistics.end_time = mark.end_time;
  if (mark.of_channel == 0) {
    statistics.channel_message_counts.erase(channel.id);
  } else {
    statistics.channel_message_counts.find(channel.id)->second = mark.of_channel;
  }
}

Status McapWriter::Impl::add_message(const records::Channel& channel, const records::MessageHead& head,
                                     std::span<const std::uint8_t> data) {
  begin_message(channel);
  chunk_channels[channel.id].entries.emplace_back(head.log_time, chunk.size());
  records::append(head, data, &chunk);
  add_time(head.log_time, chunk_messages++, &chunk_head.start_time, &chunk_head.end_time);
  add_time(head.log_time, statistics.message_count++, &statistics.start_time, &statistics.end_time);
  ++statistics.channel_message_counts[channel.id];
  if (chunk.size() >= options.chunk_bytes) return end_chunk();
  return core::ok_status();
}

Status McapWriter::Impl::end_chunk() {
  if (chunk_messages == 0) return failure;
  const std::optional<std::span<const std::uint8_t>> compressed = compressor.compress(chunk);
  chunk_head.uncompressed_size = chunk.size();
  chunk_head.uncompressed_crc = crc32(chunk);
  chunk_head.compression = compressed ? compression_name(options.compression) : "";

  records::ChunkIndex index;
  index.start_time = chunk_head.start_time;
  index.end_time = chunk_head.end_time;
  index.chunk_offset = position;
  index.compression = chunk_head.compression;
  index.compressed_size = compressed ? compressed->size() : chunk.size();
  index.uncompressed_size = chunk.size();

  std::vector<std::uint8_t>& out = chunk_record;
  out.clear();
  records::append(chunk_head, compressed ? *compressed : std::span<const std::uint8_t>(chunk), &out);
  index.chunk_length = out.size();
  for (const auto& [id, message_index] : chunk_channels) {
    index.message_index_offsets[id] = position + out.size();
    records::append(message_index, &out);
  }
  index.message_index_length = out.size() - index.chunk_length;
  const Status kept = chunk_indexes.add(index);
  ++statistics.chunk_count;

  chunk.clear();
  chunk_head = {};
  chunk_messages = 0;
  chunk_channels.clear();
  chunk_schemas.clear();
  PRESCENE_RETURN_IF_ERROR(write_bytes(out));
  failure = kept;
  return failure;
}

Status McapWriter::Impl::write_summary() {
  std::vector<std::uint8_t> out;
  records::append_data_end(data_crc, &out);
  PRESCENE_RETURN_IF_ERROR(write_bytes(out));

  records::Footer footer;
  footer.summary_start = position;
  std::uint32_t crc = 0;
  const auto write = [&](std::span<const std::uint8_t> bytes) {
    crc = crc32(bytes, crc);
    return write_bytes(bytes);
  };
  std::vector<std::uint8_t> offsets;
  const auto end_group = [&](records::Op op, std::uint64_t begin) {
    if (position > begin) records::append_summary_offset(op, begin, position - begin, &offsets);
  };
  const auto group = [&](records::Op op, const auto& group_records) {
    const std::uint64_t begin = position;
    out.clear();
    for (const auto& record : group_records) records::append(record, &out);
    Status written = write(out);
    end_group(op, begin);
    return written;
  };
  statistics.schema_count = static_cast<std::uint16_t>(schemas.size());
  statistics.channel_count = static_cast<std::uint32_t>(channels.size());
  statistics.attachment_count = static_cast<std::uint32_t>(attachment_indexes.size());
  statistics.metadata_count = static_cast<std::uint32_t>(metadata_indexes.size());
  PRESCENE_RETURN_IF_ERROR(group(records::Op::kSchema, schemas));
  PRESCENE_RETURN_IF_ERROR(group(records::Op::kChannel, channel_records));
  PRESCENE_RETURN_IF_ERROR(group(records::Op::kStatistics, std::span(&statistics, 1)));
  const std::uint64_t chunks_begin = position;
  PRESCENE_RETURN_IF_ERROR(chunk_indexes.read(write));
  end_group(records::Op::kChunkIndex, chunks_begin);
  PRESCENE_RETURN_IF_ERROR(group(records::Op::kAttachmentIndex, attachment_indexes));
  PRESCENE_RETURN_IF_ERROR(group(records::Op::kMetadataIndex, metadata_indexes));

  footer.summary_offset_start = position;
  PRESCENE_RETURN_IF_ERROR(write(offsets));
  out.clear();
  records::append(footer, &out);
  // The checksum covers the summary and the footer up to the checksum itself.
  footer.summary_crc = crc32(std::span(out).first(out.size() - sizeof footer.summary_crc), crc);
  out.clear();
  records::append(footer, &out);
  out.insert(out.end(), records::kMagic.begin(), records::kMagic.end());
  return write_bytes(out);
}

McapWriter::McapWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

McapWriter::~McapWriter() {
  if (!impl_->closed) static_cast<void>(close());
}

Result<std::unique_ptr<McapWriter>> McapWriter::create(const std::filesystem::path& path,
                                                       const McapWriterOptions& options) {
  auto impl = std::make_unique<Impl>(path);
  impl->options = options;
  impl->compressor = Compressor(options.compression);
  PRESCENE_TRY(impl->file, OutputFile::create(path));
  impl->file.mark_in_use();
  if (options.sync_interval.count() > 0) {
    PRESCENE_TRY(impl->sync, BackgroundSync::start(path, options.sync_interval));
  }
  std::unique_ptr<McapWriter> writer(new McapWriter(std::move(impl)));
  std::vector<std::uint8_t> start(records::kMagic.begin(), records::kMagic.end());
  records::append(records::Header{options.profile, "prescene"}, &start);
  PRESCENE_RETURN_IF_ERROR(writer->impl_->write_bytes(start));
  return writer;
}

Result<int> McapWriter::add_channel(const McapChannel& channel) {
  Impl& impl = *impl_;
  PRESCENE_CHECK(!impl.closed);
  const auto known = std::find(impl.channels.begin(), impl.channels.end(), channel);
  if (known != impl.channels.end()) return static_cast<int>(known - impl.channels.begin());
  if (impl.channels.size() == kMostIds) {
    return core::resource_exhausted(impl.file.path().string() + ": a recording has at most 65535 channels");
  }
  records::Channel record{static_cast<std::uint16_t>(impl.channels.size() + 1), 0, channel.topic,
                          channel.message_encoding, channel.metadata};
  if (!channel.schema.name.empty()) {
    auto schema = std::find_if(impl.schemas.begin(), impl.schemas.end(),
                               [&](const records::Schema& s) { return s.schema == channel.schema; });
    if (schema == impl.schemas.end()) {
      schema = impl.schemas.insert(schema, {static_cast<std::uint16_t>(impl.schemas.size() + 1), channel.schema});
    }
    record.schema_id = schema->id;
  }
  impl.channel_records.push_back(std::move(record));
  try {
    impl.channels.push_back(channel);
  } catch (...) {
    impl.channel_records.pop_back();
    throw;
  }
  return static_cast<int>(impl.channels.size()) - 1;
}

Status McapWriter::write(const McapMessage& message, std::span<const std::uint8_t> data) {
  Impl& impl = *impl_;
  PRESCENE_CHECK(!impl.closed);
  PRESCENE_CHECK(message.channel >= 0 && message.channel < static_cast<int>(impl.channels.size()));
  if (!impl.failure.ok()) return impl.failure;
  const records::Channel& channel = impl.channel_records[static_cast<std::size_t>(message.channel)];
  if (message.log_time_ns < 0 || message.publish_time_ns < 0) {
    return core::invalid_input(impl.file.path().string() + ": a message on " + channel.topic + " has the time " +
                               std::to_string(std::min(message.log_time_ns, message.publish_time_ns)) +
                               " ns; times begin with 1970");
  }
  const records::MessageHead head{channel.id, message.sequence, static_cast<std::uint64_t>(message.log_time_ns),
                                  static_cast<std::uint64_t>(message.publish_time_ns)};
  const bool too_late = impl.chunk_messages > 0 && head.log_time > impl.chunk_head.start_time &&
                        head.log_time - impl.chunk_head.start_time > static_cast<std::uint64_t>(impl.options.chunk_ns);
  if (too_late) PRESCENE_RETURN_IF_ERROR(impl.end_chunk());
  const Impl::Mark mark = impl.mark(channel);
  try {
    return impl.add_message(channel, head, data);
  } catch (...) {
    impl.go_back_to(mark, channel);
    throw;
  }
}

Status McapWriter::write_metadata(const McapMetadata& metadata) {
  Impl& impl = *impl_;
  PRESCENE_CHECK(!impl.closed);
  PRESCENE_RETURN_IF_ERROR(impl.end_chunk());
  std::vector<std::uint8_t> out;
  records::append(metadata, &out);
  impl.metadata_indexes.push_back({impl.position, out.size(), metadata.name});
  return impl.write_bytes(out);
}

Status McapWriter::write_attachment(const McapAttachment& attachment) {
  Impl& impl = *impl_;
  PRESCENE_CHECK(!impl.closed);
  if (attachment.log_time_ns < 0 || attachment.create_time_ns < 0) {
    return core::invalid_input(impl.file.path().string() + ": the attachment " + quote(attachment.name) +
                               " has a negative time; times begin with 1970");
  }
  PRESCENE_RETURN_IF_ERROR(impl.end_chunk());
  const records::AttachmentHead head{static_cast<std::uint64_t>(attachment.log_time_ns),
                                     static_cast<std::uint64_t>(attachment.create_time_ns), attachment.name,
                                     attachment.media_type, attachment.data.size()};
  std::vector<std::uint8_t> out;
  records::append(head, attachment.data, &out);
  impl.attachment_indexes.push_back({impl.position, out.size(), head});
  return impl.write_bytes(out);
}

Status McapWriter::flush() {
  PRESCENE_CHECK(!impl_->closed);
  return impl_->end_chunk();
}

Status McapWriter::flush_by(std::int64_t log_time_ns) {
  Impl& impl = *impl_;
  PRESCENE_CHECK(!impl.closed);
  const std::int64_t begin_ns = log_time_ns - impl.options.chunk_ns;
  const bool is_due = begin_ns >= 0 && static_cast<std::uint64_t>(begin_ns) >= impl.chunk_head.start_time;
  if (impl.chunk_messages == 0 || !is_due) return impl.failure;
  return impl.end_chunk();
}

McapWriter::Size McapWriter::size() const {
  return {impl_->position, impl_->chunk_indexes.bytes(), impl_->statistics.chunk_count};
}

double McapWriter::seconds_at_risk() const { return impl_->sync ? impl_->sync->seconds_at_risk() : 0.0; }

Status McapWriter::close() {
  Impl& impl = *impl_;
  if (impl.closed) return impl.failure;
  impl.closed = true;
  try {
    static_cast<void>(impl.end_chunk());
    if (impl.failure.ok()) static_cast<void>(impl.write_summary());
  } catch (const std::exception&) {  // In words that need no memory.
    impl.failure = Status(core::StatusCode::kResourceExhausted, "out of memory");
  }
  if (impl.failure.ok() && impl.sync) impl.failure = impl.file.sync();
  impl.sync.reset();
  const Status closed = impl.file.close();
  if (impl.failure.ok()) impl.failure = closed;
  return impl.failure;
}

std::string offered_qos_profiles(bool is_latched) {
  const auto never = [](const std::string& key) {  // as long as ROS can say
    return "  " + key + ":\n    sec: 9223372036\n    nsec: 854775807\n";
  };
  // Keep last (1); reliable (1); transient local (1) or volatile (2).
  return std::string("- history: 1\n  depth: 10\n  reliability: 1\n  durability: ") + (is_latched ? "1" : "2") + "\n" +
         never("deadline") + never("lifespan") + "  liveliness: 1\n" + never("liveliness_lease_duration") +
         "  avoid_ros_namespace_conventions: false";
}

McapChannel ros_channel(const std::string& topic, const std::string& type, bool is_latched) {
  const RosType* ros = find_ros_type(type);
  PRESCENE_CHECK_MSG(ros != nullptr, type);
  McapChannel channel;
  channel.topic = topic;
  channel.message_encoding = "cdr";
  channel.schema = {std::string(ros->name), "ros2msg", ros2msg_schema(*ros)};
  channel.metadata = {{kOfferedQosKey, offered_qos_profiles(is_latched)},
                      {"topic_type_hash", std::string(ros->type_hash)}};
  return channel;
}

}  // namespace prescene::interfaces
