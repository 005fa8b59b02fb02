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
#include "prescene/interfaces/bytes/byte_reader.h"
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

/// A message of an unpacked segment. Small, as a chunk may be full of empty messages; what is not needed to sort them
/// is read from the bytes again.
struct Entry {
  std::int64_t log_time_ns = 0;
  std::uint32_t offset = 0;  ///< Of its record's content in the segment's bytes.
  std::uint32_t size = 0;    ///< Of that content.
  int channel = 0;
};

struct Unpacked {
  std::size_t segment = 0;
  Decompressed content;
  std::vector<Entry> entries;
  std::size_t next = 0;
  std::size_t memory() const { return content.size + entries.size() * sizeof(Entry); }
};

/// What a definition takes in memory, generously.
std::size_t memory_of(const McapSchema& schema) {
  return 256 + schema.name.size() + schema.encoding.size() + schema.data.size();
}
std::size_t memory_of(const McapChannel& channel) {
  std::size_t bytes = 256 + channel.topic.size() + channel.message_encoding.size() + memory_of(channel.schema);
  for (const auto& [key, value] : channel.metadata) bytes += 128 + key.size() + value.size();
  return bytes;
}

}  // namespace

struct McapReader::Impl {
  Impl(McapSource from, McapReaderOptions with) : source(std::move(from)), options(std::move(with)) {
    PRESCENE_CHECK(options.max_chunk_bytes <= std::numeric_limits<std::uint32_t>::max());  // for Entry
  }

  McapSource source;
  McapReaderOptions options;
  McapLayout layout;
  McapLoss loss;
  McapUnchecked unchecked;

  std::map<std::uint16_t, McapSchema> schemas;
  std::vector<McapChannel> channels;
  std::vector<bool> wanted;  ///< By channel.
  std::map<std::uint16_t, int> channel_of_id;
  std::size_t definition_bytes = 0;

  std::vector<std::size_t> order;  ///< Segments in the order of reading.
  std::size_t next_segment = 0;    ///< Place in `order`.
  std::vector<Unpacked> unpacked;
  std::size_t unpacked_bytes = 0;

  Status start();
  Status define_schema(std::uint16_t id, McapSchema schema);
  Status define_channel(const records::Channel& record);
  Status too_many_definitions() const;
  bool may_hold_wanted(const McapSegment& segment) const;
  Status unpack_due();
  Status unpack(std::size_t index);
  /// The bytes of a segment's records; none when they are left out.
  Result<Decompressed> segment_bytes(const McapSegment& segment);
  Status leave_out(const McapSegment& segment, const std::string& reason, Status status);
  Status list_entries(const McapSegment& segment, Unpacked* out);
  Result<bool> take_record(const records::RecordWalk& walk, const McapSegment& segment, Unpacked* out);
  void add_message(std::span<const std::uint8_t> content, Unpacked* out);
  Unpacked* earliest();
};

Status McapReader::Impl::start() {
  loss = layout.loss;
  unchecked = layout.unchecked;
  for (records::Schema& schema : layout.schemas) {
    PRESCENE_RETURN_IF_ERROR(define_schema(schema.id, std::move(schema.schema)));
  }
  for (const records::Channel& channel : layout.channels) PRESCENE_RETURN_IF_ERROR(define_channel(channel));
  layout.schemas = {};
  layout.channels = {};
  for (std::size_t i = 0; i < layout.segments.size(); ++i) {
    if (may_hold_wanted(layout.segments[i])) order.push_back(i);
  }
  if (!layout.indexed) return core::ok_status();
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return layout.segments[a].start_time < layout.segments[b].start_time;
  });
  return core::ok_status();
}

Status McapReader::Impl::too_many_definitions() const {
  return core::resource_exhausted(source.name() + ": its schemas and channels take more than " +
                                  size_text(kMaxDefinitionsBytes) + " in memory, which is the limit");
}

Status McapReader::Impl::define_schema(std::uint16_t id, McapSchema schema) {
  const auto known = schemas.find(id);
  if (known != schemas.end()) {
    if (known->second == schema) return core::ok_status();
    definition_bytes -= memory_of(known->second);
  }
  definition_bytes += memory_of(schema);
  if (definition_bytes > kMaxDefinitionsBytes) return too_many_definitions();
  schemas[id] = std::move(schema);
  return core::ok_status();
}

Status McapReader::Impl::define_channel(const records::Channel& record) {
  McapChannel channel;
  channel.topic = record.topic;
  channel.message_encoding = record.message_encoding;
  channel.metadata = record.metadata;
  if (const auto schema = schemas.find(record.schema_id); schema != schemas.end()) channel.schema = schema->second;
  const auto known = channel_of_id.find(record.id);
  if (known != channel_of_id.end() && channels[static_cast<std::size_t>(known->second)] == channel) {
    return core::ok_status();
  }
  definition_bytes += memory_of(channel);
  if (definition_bytes > kMaxDefinitionsBytes) return too_many_definitions();
  channel_of_id[record.id] = static_cast<int>(channels.size());
  wanted.push_back(options.topics.empty() || options.topics.contains(channel.topic));
  channels.push_back(std::move(channel));
  return core::ok_status();
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
      const std::uint64_t next_bytes = next.unpacked_length;
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
  PRESCENE_TRY(out.content, segment_bytes(segment));
  PRESCENE_RETURN_IF_ERROR(list_entries(segment, &out));
  if (out.entries.empty()) return core::ok_status();
  const auto by_time = [](const Entry& a, const Entry& b) { return a.log_time_ns < b.log_time_ns; };
  if (layout.indexed && !std::is_sorted(out.entries.begin(), out.entries.end(), by_time)) {
    std::stable_sort(out.entries.begin(), out.entries.end(), by_time);
  }
  unpacked_bytes += out.memory();
  unpacked.push_back(std::move(out));
  return core::ok_status();
}

/// A segment that can't be read as it should: refused, or passed over.
Status McapReader::Impl::leave_out(const McapSegment& segment, const std::string& reason, Status status) {
  if (options.salvage) return core::ok_status();
  return {status.code(), source.name() + ": the " + (segment.chunk ? "chunk" : "run of messages") + " at byte " +
                             std::to_string(segment.offset) + " " + reason + status.message()};
}

Result<Decompressed> McapReader::Impl::segment_bytes(const McapSegment& segment) {
  if (std::max(segment.unpacked_length, segment.length) > options.max_chunk_bytes) {
    ++loss.refused_chunks;
    PRESCENE_RETURN_IF_ERROR(leave_out(
        segment, "claims " + size_text(static_cast<std::size_t>(std::max(segment.unpacked_length, segment.length))),
        core::resource_exhausted("; up to " + size_text(options.max_chunk_bytes) + " are read")));
    return Decompressed{};
  }
  const std::optional<McapCompression> compression = find_compression(segment.compression);
  if (!compression) {
    ++loss.damaged_chunks;
    loss.unknown_compression = segment.compression;
    PRESCENE_RETURN_IF_ERROR(leave_out(segment, "has the compression " + quote(segment.compression),
                                       core::unsupported("; none, lz4 and zstd are known")));
    return Decompressed{};
  }
  std::uint64_t taken = 0;
  const StoredBytes stored = [&](std::span<std::uint8_t> out) {
    const std::uint64_t at = segment.offset + std::exchange(taken, taken + out.size());
    return source.read(at, out);
  };
  PRESCENE_TRY(Decompressed content,
               decompress(*compression, stored, segment.length, static_cast<std::size_t>(segment.unpacked_length)));
  if (!segment.chunk) return content;
  if (segment.cut) {
    if (content.size == 0) loss.lost_bytes += segment.length;
    return content;
  }
  if (segment.crc == 0) ++unchecked.chunks;
  if (content.complete && (segment.crc == 0 || segment.crc == crc32(content.bytes()))) return content;
  ++loss.damaged_chunks;
  PRESCENE_RETURN_IF_ERROR(leave_out(segment, "is damaged", core::data_loss(kDamageRemedy)));
  return Decompressed{};
}

Status McapReader::Impl::list_entries(const McapSegment& segment, Unpacked* out) {
  const std::span<const std::uint8_t> bytes = out->content.bytes();
  // Counted before they are kept: a vector that grows would take up to three times their memory.
  std::size_t messages = 0;
  for (records::RecordWalk count(bytes); count.next();) messages += count.op() == Op::kMessage ? 1 : 0;
  out->entries.reserve(messages);
  records::RecordWalk walk(bytes);
  bool sound = true;
  while (sound && walk.next()) {
    PRESCENE_TRY(sound, take_record(walk, segment, out));
  }
  if (sound && walk.whole()) return core::ok_status();
  if (segment.cut) {
    loss.lost_bytes += bytes.size() - walk.position();
    return core::ok_status();
  }
  ++loss.damaged_chunks;
  return leave_out(segment, "is damaged", core::data_loss(kDamageRemedy));
}

/// False when the record is wrong.
Result<bool> McapReader::Impl::take_record(const records::RecordWalk& walk, const McapSegment& segment, Unpacked* out) {
  const std::span<const std::uint8_t> content = walk.content();
  switch (walk.op()) {
    case Op::kMessage:
      if (content.size() < records::MessageHead::kBytes) return false;
      add_message(content, out);
      return true;
    case Op::kSchema: {
      records::Schema schema;
      if (content.size() > kMaxDefinitionBytes) return too_many_definitions();
      if (!parse(content, &schema)) return false;
      PRESCENE_RETURN_IF_ERROR(define_schema(schema.id, std::move(schema.schema)));
      return true;
    }
    case Op::kChannel: {
      records::Channel channel;
      if (content.size() > kMaxDefinitionBytes) return too_many_definitions();
      if (!parse(content, &channel)) return false;
      PRESCENE_RETURN_IF_ERROR(define_channel(channel));
      return true;
    }
    default:
      return !segment.chunk || static_cast<std::uint8_t>(walk.op()) >= 0x80;  // Chunks hold nothing else.
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
  const Entry entry{saturated(head.log_time), static_cast<std::uint32_t>(content.data() - out->content.data.get()),
                    static_cast<std::uint32_t>(content.size()), channel->second};
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
  if (damaged_header) say("its header is damaged");
  if (bad_index) say("its index is wrong, it was read front to back");
  if (damaged_data) say("the checksum of its data section is wrong");
  if (lost_bytes > 0) say(size_text(static_cast<std::size_t>(lost_bytes)) + " that belong to no whole record are lost");
  if (damaged_chunks > 0)
    say(std::to_string(damaged_chunks) + " damaged chunks were left out or read to their last sound record");
  if (!unknown_compression.empty())
    say("the compression " + quote(unknown_compression) + " is unknown (none, lz4 and zstd are)");
  if (refused_chunks > 0) say(std::to_string(refused_chunks) + " chunks above the size limit were left out");
  if (stray_messages > 0) say(std::to_string(stray_messages) + " messages of unknown channels were left out");
  return out;
}

std::string McapUnchecked::text() const {
  std::string of;
  const auto add = [&](bool is, const std::string& what) {
    if (is) of += (of.empty() ? "" : ", ") + what;
  };
  add(data, "its data section");
  add(chunks > 0, std::to_string(chunks) + (chunks == 1 ? " chunk" : " chunks"));
  add(index, "its index");
  if (of.empty()) return of;
  return "the recording holds no checksum of " + of + ": damage to what they hold can't be noticed";
}

McapReader::McapReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
McapReader::~McapReader() = default;

Result<std::unique_ptr<McapReader>> McapReader::open(const std::filesystem::path& path,
                                                     const McapReaderOptions& options) {
  PRESCENE_TRY(InputFile file, InputFile::open(path));
  auto impl = std::make_unique<Impl>(McapSource(std::move(file)), options);
  PRESCENE_TRY(impl->layout, find_layout(&impl->source, options.salvage, options.check_data));
  PRESCENE_RETURN_IF_ERROR(impl->start());
  return std::unique_ptr<McapReader>(new McapReader(std::move(impl)));
}

Result<std::unique_ptr<McapReader>> McapReader::open_bytes(std::vector<std::uint8_t> bytes,
                                                           const McapReaderOptions& options) {
  auto impl = std::make_unique<Impl>(McapSource(std::move(bytes)), options);
  PRESCENE_TRY(impl->layout, find_layout(&impl->source, options.salvage, options.check_data));
  PRESCENE_RETURN_IF_ERROR(impl->start());
  return std::unique_ptr<McapReader>(new McapReader(std::move(impl)));
}

const std::string& McapReader::profile() const { return impl_->layout.header.profile; }
const std::vector<McapChannel>& McapReader::channels() const { return impl_->channels; }
const std::vector<McapMetadata>& McapReader::metadata() const { return impl_->layout.metadata; }
const McapLoss& McapReader::loss() const { return impl_->loss; }
const McapUnchecked& McapReader::unchecked() const { return impl_->unchecked; }

std::vector<McapReader::AttachedFile> McapReader::attachments() const {
  std::vector<AttachedFile> files;
  for (const McapStoredAttachment& stored : impl_->layout.attachments)
    files.push_back({stored.head.name, stored.head.media_type, stored.head.data_size});
  return files;
}

Result<McapAttachment> McapReader::attachment(const std::string& name, std::size_t max_bytes) const {
  const auto& stored = impl_->layout.attachments;
  const auto found =
      std::find_if(stored.rbegin(), stored.rend(), [&](const auto& one) { return one.head.name == name; });
  const std::string file = impl_->source.name() + ": ";
  if (found == stored.rend()) return core::not_found(file + "has no attachment " + quote(name));
  if (found->length > max_bytes) {
    return core::resource_exhausted(file + "its attachment " + quote(name) + " has " +
                                    size_text(static_cast<std::size_t>(found->length)) + "; up to " +
                                    size_text(max_bytes) + " are read");
  }
  std::vector<std::uint8_t> content(static_cast<std::size_t>(found->length));
  PRESCENE_RETURN_IF_ERROR(impl_->source.read(found->offset, content));
  const std::span<const std::uint8_t> covered(content.data(), content.size() - records::AttachmentHead::kChecksumBytes);
  ByteReader tail(std::span<const std::uint8_t>(content).subspan(covered.size()));
  const auto expected = tail.read<std::uint32_t>();
  if (expected != 0 && expected != crc32(covered))
    return core::data_loss(file + "its attachment " + quote(name) + " is damaged" + kDamageRemedy);
  const std::span<const std::uint8_t> data = covered.subspan(found->head.bytes());
  return McapAttachment{found->head.name,
                        found->head.media_type,
                        {data.begin(), data.end()},
                        saturated(found->head.log_time),
                        saturated(found->head.create_time)};
}

std::optional<McapReader::Statistics> McapReader::statistics() const {
  const auto& said = impl_->layout.statistics;
  if (!said) return std::nullopt;
  Statistics statistics{saturated(said->start_time), saturated(said->end_time), said->message_count,
                        std::vector<std::uint64_t>(impl_->channels.size())};
  for (const auto& [id, count] : said->channel_message_counts)
    if (const auto channel = impl_->channel_of_id.find(id); channel != impl_->channel_of_id.end())
      statistics.by_channel[static_cast<std::size_t>(channel->second)] += count;
  return statistics;
}

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
  const std::span<const std::uint8_t> content = from->content.bytes().subspan(entry.offset, entry.size);
  records::MessageHead head;
  parse(content, &head);
  McapMessage message{entry.channel, head.sequence, entry.log_time_ns, saturated(head.publish_time), {}};
  message.data.assign(content.begin() + records::MessageHead::kBytes, content.end());
  if (++from->next == from->entries.size()) {
    impl.unpacked_bytes -= from->memory();
    impl.unpacked.erase(impl.unpacked.begin() + (from - impl.unpacked.data()));
  }
  return std::optional<McapMessage>(std::move(message));
}

}  // namespace prescene::interfaces
