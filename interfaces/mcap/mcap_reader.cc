// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/mcap/mcap_reader.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "mcap_compression.h"
#include "mcap_layout.h"
#include "mcap_records.h"
#include "mcap_source.h"
#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/crc32.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;
namespace records = mcap_records;
using records::Op;

constexpr std::uint64_t kMaxTime = std::numeric_limits<std::int64_t>::max();

std::int64_t saturated(std::uint64_t time) { return static_cast<std::int64_t>(std::min(time, kMaxTime)); }

/// A message of an unpacked segment.
struct Entry {
  std::int64_t log_time_ns = 0;
  std::int64_t publish_time_ns = 0;
  std::uint32_t sequence = 0;
  int channel = 0;
  std::size_t offset = 0;  ///< Of its data in the segment's bytes.
  std::size_t size = 0;
};

struct Unpacked {
  std::size_t segment = 0;
  std::vector<std::uint8_t> bytes;
  std::vector<Entry> entries;
  std::size_t next = 0;
};

}  // namespace

struct McapReader::Impl {
  Impl(McapSource from, McapReaderOptions with) : source(std::move(from)), options(std::move(with)) {}

  McapSource source;
  McapReaderOptions options;
  McapLayout layout;
  McapLoss loss;

  std::map<std::uint16_t, McapSchema> schemas;
  std::vector<McapChannel> channels;
  std::vector<bool> wanted;  ///< By channel.
  std::map<std::uint16_t, int> channel_of_id;

  std::vector<std::size_t> order;  ///< Segments in the order of reading.
  std::size_t next_segment = 0;    ///< Place in `order`.
  std::vector<Unpacked> unpacked;
  std::size_t unpacked_bytes = 0;

  void start();
  void define_channel(const records::Channel& record);
  bool may_hold_wanted(const McapSegment& segment) const;
  Status unpack_due();
  Status unpack(std::size_t index);
  /// The bytes of a segment's records; empty when they are left out.
  Result<std::vector<std::uint8_t>> segment_bytes(const McapSegment& segment);
  void list_entries(const McapSegment& segment, Unpacked* out);
  void add_message(std::span<const std::uint8_t> content, Unpacked* out);
  Unpacked* earliest();
};

void McapReader::Impl::start() {
  loss = layout.loss;
  for (const records::Schema& schema : layout.schemas) schemas[schema.id] = schema.schema;
  for (const records::Channel& channel : layout.channels) define_channel(channel);
  for (std::size_t i = 0; i < layout.segments.size(); ++i) {
    if (may_hold_wanted(layout.segments[i])) order.push_back(i);
  }
  if (!layout.indexed) return;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return layout.segments[a].start_time < layout.segments[b].start_time;
  });
}

void McapReader::Impl::define_channel(const records::Channel& record) {
  McapChannel channel;
  channel.topic = record.topic;
  channel.message_encoding = record.message_encoding;
  channel.metadata = record.metadata;
  if (const auto schema = schemas.find(record.schema_id); schema != schemas.end()) channel.schema = schema->second;
  const auto known = channel_of_id.find(record.id);
  if (known != channel_of_id.end() && channels[static_cast<std::size_t>(known->second)] == channel) return;
  channel_of_id[record.id] = static_cast<int>(channels.size());
  wanted.push_back(options.topics.empty() || options.topics.contains(channel.topic));
  channels.push_back(std::move(channel));
}

/// Only an index lets us leave out segments unread: they may define the channels of later ones.
bool McapReader::Impl::may_hold_wanted(const McapSegment& segment) const {
  if (!layout.indexed) return true;
  const bool has_times = segment.start_time <= segment.end_time;
  if (has_times && options.begin_ns && saturated(segment.end_time) < *options.begin_ns) return false;
  if (has_times && options.end_ns && saturated(segment.start_time) >= *options.end_ns) return false;
  if (segment.channel_ids.empty()) return true;
  return std::any_of(segment.channel_ids.begin(), segment.channel_ids.end(), [&](std::uint16_t id) {
    const auto channel = channel_of_id.find(id);
    return channel == channel_of_id.end() || wanted[static_cast<std::size_t>(channel->second)];
  });
}

/// Unpacks every segment that may hold a message before the earliest one at hand.
Status McapReader::Impl::unpack_due() {
  while (next_segment < order.size()) {
    const Unpacked* first = earliest();
    if (first != nullptr) {
      const McapSegment& next = layout.segments[order[next_segment]];
      const std::uint64_t next_bytes = next.chunk ? next.head.uncompressed_size : next.length;
      const bool due = layout.indexed && saturated(next.start_time) <= first->entries[first->next].log_time_ns;
      const bool has_room = next_bytes <= options.max_chunk_bytes - std::min(unpacked_bytes, options.max_chunk_bytes);
      if (!due || !has_room) return core::ok_status();
    }
    PRESCENE_RETURN_IF_ERROR(unpack(order[next_segment++]));
  }
  return core::ok_status();
}

Status McapReader::Impl::unpack(std::size_t index) {
  const McapSegment& segment = layout.segments[index];
  Unpacked out;
  out.segment = index;
  PRESCENE_TRY(out.bytes, segment_bytes(segment));
  list_entries(segment, &out);
  if (out.entries.empty()) return core::ok_status();
  if (layout.indexed) {
    std::stable_sort(out.entries.begin(), out.entries.end(),
                     [](const Entry& a, const Entry& b) { return a.log_time_ns < b.log_time_ns; });
  }
  unpacked_bytes += out.bytes.size();
  unpacked.push_back(std::move(out));
  return core::ok_status();
}

Result<std::vector<std::uint8_t>> McapReader::Impl::segment_bytes(const McapSegment& segment) {
  const std::uint64_t size = segment.chunk ? std::max(segment.head.uncompressed_size, segment.length) : segment.length;
  if (size > options.max_chunk_bytes) {
    ++loss.refused_chunks;
    return std::vector<std::uint8_t>();
  }
  std::vector<std::uint8_t> stored(static_cast<std::size_t>(segment.length));
  PRESCENE_RETURN_IF_ERROR(source.read(segment.offset, stored));
  if (!segment.chunk) return stored;

  const records::ChunkHead& head = segment.head;
  const std::optional<McapCompression> compression = find_compression(head.compression);
  if (!compression) {
    ++loss.damaged_chunks;
    loss.unknown_compression = head.compression;
    return std::vector<std::uint8_t>();
  }
  Decompressed content = decompress(*compression, stored, head.uncompressed_size);
  if (segment.cut) {
    if (content.bytes.empty()) loss.lost_bytes += segment.length;
    return std::move(content.bytes);
  }
  const bool wrong = !content.complete || (head.uncompressed_crc != 0 && head.uncompressed_crc != crc32(content.bytes));
  if (!wrong) return std::move(content.bytes);
  ++loss.damaged_chunks;
  return std::vector<std::uint8_t>();
}

void McapReader::Impl::list_entries(const McapSegment& segment, Unpacked* out) {
  records::RecordWalk walk(out->bytes);
  bool sound = true;
  while (sound && walk.next()) {
    if (walk.op() == Op::kMessage) {
      sound = walk.content().size() >= records::MessageHead::kBytes;
      if (sound) add_message(walk.content(), out);
    } else if (walk.op() == Op::kSchema) {
      records::Schema schema;
      sound = parse(walk.content(), &schema);
      if (sound) schemas[schema.id] = std::move(schema.schema);
    } else if (walk.op() == Op::kChannel) {
      records::Channel channel;
      sound = parse(walk.content(), &channel);
      if (sound) define_channel(channel);
    } else {
      sound = !segment.chunk || static_cast<std::uint8_t>(walk.op()) >= 0x80;  // Chunks hold nothing else.
    }
  }
  if (sound && walk.whole()) return;
  if (segment.cut) {
    loss.lost_bytes += out->bytes.size() - walk.position();
  } else {
    ++loss.damaged_chunks;
  }
}

void McapReader::Impl::add_message(std::span<const std::uint8_t> content, Unpacked* out) {
  records::MessageHead head;
  parse(content, &head);
  const auto channel = channel_of_id.find(head.channel_id);
  if (channel == channel_of_id.end()) {
    ++loss.stray_messages;
    return;
  }
  Entry entry;
  entry.log_time_ns = saturated(head.log_time);
  entry.publish_time_ns = saturated(head.publish_time);
  entry.sequence = head.sequence;
  entry.channel = channel->second;
  entry.offset = static_cast<std::size_t>(content.data() - out->bytes.data()) + records::MessageHead::kBytes;
  entry.size = content.size() - records::MessageHead::kBytes;
  const bool in_time = (!options.begin_ns || entry.log_time_ns >= *options.begin_ns) &&
                       (!options.end_ns || entry.log_time_ns < *options.end_ns);
  if (in_time && wanted[static_cast<std::size_t>(entry.channel)]) out->entries.push_back(entry);
}

Unpacked* McapReader::Impl::earliest() {
  Unpacked* found = nullptr;
  for (Unpacked& candidate : unpacked) {
    const bool earlier =
        found == nullptr || std::pair(candidate.entries[candidate.next].log_time_ns, candidate.segment) <
                                std::pair(found->entries[found->next].log_time_ns, found->segment);
    if (earlier) found = &candidate;
  }
  return found;
}

std::string McapLoss::text() const {
  std::string out;
  const auto say = [&](const std::string& sentence) { out += (out.empty() ? "" : "; ") + sentence; };
  if (truncated) say("the recording was not closed (cut, or still being written)");
  if (bad_index) say("its index is wrong, it was read front to back");
  if (lost_bytes > 0) say(size_text(static_cast<std::size_t>(lost_bytes)) + " after the last whole record are lost");
  if (damaged_chunks > 0)
    say(std::to_string(damaged_chunks) + " damaged chunks were left out or read to their last sound record");
  if (!unknown_compression.empty())
    say("the compression " + quote(unknown_compression) + " is unknown (none, lz4 and zstd are)");
  if (refused_chunks > 0) say(std::to_string(refused_chunks) + " chunks above the size limit were left out");
  if (stray_messages > 0) say(std::to_string(stray_messages) + " messages of unknown channels were left out");
  return out;
}

McapReader::McapReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
McapReader::~McapReader() = default;

Result<std::unique_ptr<McapReader>> McapReader::open(const std::filesystem::path& path,
                                                     const McapReaderOptions& options) {
  PRESCENE_TRY(InputFile file, InputFile::open(path));
  auto impl = std::make_unique<Impl>(McapSource(std::move(file)), options);
  PRESCENE_TRY(impl->layout, find_layout(&impl->source));
  impl->start();
  return std::unique_ptr<McapReader>(new McapReader(std::move(impl)));
}

Result<std::unique_ptr<McapReader>> McapReader::open_bytes(std::vector<std::uint8_t> bytes,
                                                           const McapReaderOptions& options) {
  auto impl = std::make_unique<Impl>(McapSource(std::move(bytes)), options);
  PRESCENE_TRY(impl->layout, find_layout(&impl->source));
  impl->start();
  return std::unique_ptr<McapReader>(new McapReader(std::move(impl)));
}

const std::string& McapReader::profile() const { return impl_->layout.header.profile; }
const std::vector<McapChannel>& McapReader::channels() const { return impl_->channels; }
const std::vector<McapMetadata>& McapReader::metadata() const { return impl_->layout.metadata; }
const McapLoss& McapReader::loss() const { return impl_->loss; }

std::optional<std::uint64_t> McapReader::message_count() const {
  if (!impl_->layout.statistics) return std::nullopt;
  return impl_->layout.statistics->message_count;
}

Result<std::optional<McapMessage>> McapReader::next() {
  Impl& impl = *impl_;
  PRESCENE_RETURN_IF_ERROR(impl.unpack_due());
  Unpacked* from = impl.earliest();
  if (from == nullptr) return std::optional<McapMessage>();
  const Entry& entry = from->entries[from->next];
  McapMessage message{entry.channel, entry.sequence, entry.log_time_ns, entry.publish_time_ns, {}};
  const auto begin = from->bytes.begin() + static_cast<std::ptrdiff_t>(entry.offset);
  message.data.assign(begin, begin + static_cast<std::ptrdiff_t>(entry.size));
  if (++from->next == from->entries.size()) {
    impl.unpacked_bytes -= from->bytes.size();
    impl.unpacked.erase(impl.unpacked.begin() + (from - impl.unpacked.data()));
  }
  return std::optional<McapMessage>(std::move(message));
}

}  // namespace prescene::interfaces
