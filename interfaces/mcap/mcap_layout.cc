// SPDX-License-Identifier: Apache-2.0
#include "mcap_layout.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>

#include "mcap_compression.h"
#include "prescene/interfaces/bytes/byte_reader.h"
#include "prescene/interfaces/bytes/crc32.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;
namespace records = mcap_records;
using records::Op;

constexpr std::size_t kMagicBytes = records::kMagic.size();
constexpr std::size_t kFooterBytes = records::kFrameBytes + records::Footer::kContentBytes;
constexpr std::uint64_t kMaxRunBytes = std::uint64_t{4} << 20;
constexpr std::uint64_t kMaxHeaderBytes = std::uint64_t{1} << 20;
constexpr std::size_t kMaxIds = 65535;  // of schemas and of channels: they have 16 bits
constexpr std::uint64_t kDataEndBytes = records::kFrameBytes + sizeof(std::uint32_t);
constexpr std::size_t kCheckStep = std::size_t{1} << 20;
constexpr std::uint64_t kMaxAttachmentHead = std::uint64_t{8} << 10;  // with its name
constexpr std::uint64_t kMaxChunkHead = records::ChunkHead::kBytesBeforeName + records::ChunkHead::kMaxNameBytes + 8;

struct Frame {
  Op op{};
  std::uint64_t length = 0;
};

/// What the summary says of a chunk.
struct KnownChunk {
  std::uint64_t length = 0;  ///< With the frame.
  std::uint64_t message_index_length = 0;
  std::vector<std::uint16_t> channel_ids;
};

class LayoutFinder {
 public:
  LayoutFinder(McapSource* source, bool salvage, bool check_data)
      : source_(*source), salvage_(salvage), check_data_(check_data), limit_(source->size()) {}

  Result<McapLayout> find() {
    PRESCENE_RETURN_IF_ERROR(check_magic());
    PRESCENE_RETURN_IF_ERROR(read_header());
    PRESCENE_RETURN_IF_ERROR(read_summary());
    PRESCENE_RETURN_IF_ERROR(walk());
    PRESCENE_RETURN_IF_ERROR(check_data_section());
    PRESCENE_RETURN_IF_ERROR(refuse_damage());
    out_.indexed = !out_.channels.empty();
    return std::move(out_);
  }

 private:
  Status check_magic() {
    const auto available = static_cast<std::size_t>(std::min<std::uint64_t>(source_.size(), kMagicBytes));
    PRESCENE_TRY(const std::span<const std::uint8_t> magic, source_.peek(0, available));
    if (!std::equal(magic.begin(), magic.end(), records::kMagic.begin())) {
      return core::invalid_input(source_.name() + ": not an MCAP file (bad signature); give a recording");
    }
    if (available < kMagicBytes) return nothing_readable();
    position_ = kMagicBytes;
    return core::ok_status();
  }

  Status nothing_readable() const {
    return core::data_loss(source_.name() + ": has " + size_text(static_cast<std::size_t>(source_.size())) +
                           " and ends before the first message; record again");
  }

  Status read_header() {
    const std::optional<Frame> frame = frame_at(position_);
    const bool is_header = frame && frame->op == Op::kHeader;
    if (!frame || (is_header && frame->length > limit_ - position_ - records::kFrameBytes)) {
      return salvage_ ? pass_over_header() : nothing_readable();
    }
    if (is_header && frame->length <= kMaxHeaderBytes) {
      PRESCENE_TRY(const std::vector<std::uint8_t> content, content_at(position_, *frame));
      if (parse(content, &out_.header)) {
        position_ += records::kFrameBytes + frame->length;
        return core::ok_status();
      }
    }
    if (salvage_) return pass_over_header();
    return core::data_loss(source_.name() + ": its header is damaged" + kDamageRemedy);
  }

  /// The walk begins where it stands, and finds its way from there.
  Status pass_over_header() {
    out_.header = {};
    out_.loss.damaged_header = true;
    return core::ok_status();
  }

  /// From the footer, if there is one, to the channels, statistics and chunk indexes.
  Status read_summary() {
    const std::uint64_t size = source_.size();
    out_.loss.truncated = true;
    if (size < position_ + kFooterBytes + kMagicBytes) return core::ok_status();
    const std::uint64_t footer_at = size - kFooterBytes - kMagicBytes;
    std::vector<std::uint8_t> tail(kFooterBytes + kMagicBytes);
    PRESCENE_RETURN_IF_ERROR(source_.read(footer_at, tail));
    ByteReader in(tail);
    const auto op = static_cast<Op>(in.read<std::uint8_t>());
    const auto length = in.read<std::uint64_t>();
    const bool whole = op == Op::kFooter && length == records::Footer::kContentBytes &&
                       std::equal(records::kMagic.begin(), records::kMagic.end(), tail.begin() + kFooterBytes);
    if (!whole) return core::ok_status();
    out_.loss.truncated = false;
    limit_ = footer_at;
    records::Footer footer;
    parse(std::span(tail).subspan(records::kFrameBytes, records::Footer::kContentBytes), &footer);
    out_.unchecked.index = footer.summary_start != 0 && footer.summary_crc == 0;

    // Without a summary the checksum, where there is one, is that of the footer alone.
    const std::uint64_t summary_start = footer.summary_start == 0 ? footer_at : footer.summary_start;
    bool good = summary_start >= position_ && summary_start <= footer_at;
    if (good && footer_at - summary_start > kMaxSummaryBytes) {
      return core::resource_exhausted(source_.name() + ": its index has " +
                                      size_text(static_cast<std::size_t>(footer_at - summary_start)) + "; up to " +
                                      size_text(kMaxSummaryBytes) + " are read");
    }
    if (good) {
      std::vector<std::uint8_t> summary(static_cast<std::size_t>(footer_at - summary_start));
      PRESCENE_RETURN_IF_ERROR(source_.read(summary_start, summary));
      const std::span<const std::uint8_t> covered_footer(tail.data(), kFooterBytes - sizeof footer.summary_crc);
      good = footer.summary_crc == 0 || footer.summary_crc == crc32(covered_footer, crc32(summary));
      good = good && parse_summary(summary, summary_start);
    }
    if (good) {
      limit_ = summary_start;
      return core::ok_status();
    }
    out_.loss.bad_index = true;
    out_.schemas.clear();
    out_.channels.clear();
    out_.statistics.reset();
    known_chunks_.clear();
    return core::ok_status();
  }

  bool parse_summary(std::span<const std::uint8_t> summary, std::uint64_t data_end) {
    records::RecordWalk walk(summary);
    while (walk.next()) {
      bool good = true;
      if (walk.op() == Op::kSchema) {
        good = walk.content().size() <= kMaxDefinitionBytes && out_.schemas.size() < kMaxIds &&
               parse(walk.content(), &out_.schemas.emplace_back());
      } else if (walk.op() == Op::kChannel) {
        good = walk.content().size() <= kMaxDefinitionBytes && out_.channels.size() < kMaxIds &&
               parse(walk.content(), &out_.channels.emplace_back());
      } else if (walk.op() == Op::kStatistics) {
        good = parse(walk.content(), &out_.statistics.emplace());
      } else if (walk.op() == Op::kChunkIndex) {
        records::ChunkIndex index;
        good = parse(walk.content(), &index) && index.chunk_offset < data_end &&
               index.chunk_length <= data_end - index.chunk_offset &&
               index.message_index_length <= data_end - index.chunk_offset - index.chunk_length;
        KnownChunk& known = known_chunks_[index.chunk_offset];
        known = {index.chunk_length, index.message_index_length, {}};
        known.channel_ids.reserve(index.message_index_offsets.size());
        for (const auto& [id, offset] : index.message_index_offsets) known.channel_ids.push_back(id);
      }
      if (!good) return false;
    }
    return walk.whole();
  }

  /// Over the records of the data section. Where the index knows a chunk, its message indexes are passed over unread;
  /// where a record is wrong, the walk goes on at the next chunk that the index knows.
  Status walk() {
    while (position_ < limit_) {
      const std::optional<Frame> frame = frame_at(position_);
      if (frame && frame->op == Op::kDataEnd) data_end_ = position_;
      if (frame && (frame->op == Op::kDataEnd || frame->op == Op::kFooter)) return core::ok_status();
      if (out_.segments.size() > kMaxSegments) {
        return core::resource_exhausted(source_.name() + ": has more than " + std::to_string(kMaxSegments) +
                                        " chunks; split it");
      }
      const bool fits = frame && frame->length <= limit_ - position_ - records::kFrameBytes;
      if (frame && frame->op == Op::kChunk) {
        PRESCENE_TRY(const bool good, add_chunk(*frame));
        if (good) continue;
      } else if (fits) {
        PRESCENE_TRY(const bool good, add_record(*frame));
        if (good) continue;
      }
      PRESCENE_RETURN_IF_ERROR(skip_damage());
    }
    return core::ok_status();
  }

  std::optional<Frame> frame_at(std::uint64_t offset) {
    if (limit_ - offset < records::kFrameBytes) return std::nullopt;
    const Result<std::span<const std::uint8_t>> bytes = source_.peek(offset, records::kFrameBytes);
    if (!bytes) return std::nullopt;
    ByteReader in(*bytes);
    const auto op = in.read<std::uint8_t>();
    if (op == 0) return std::nullopt;
    return Frame{static_cast<Op>(op), in.read<std::uint64_t>()};
  }

  Result<std::vector<std::uint8_t>> content_at(std::uint64_t offset, const Frame& frame) const {
    std::vector<std::uint8_t> content(static_cast<std::size_t>(frame.length));
    PRESCENE_RETURN_IF_ERROR(source_.read(offset + records::kFrameBytes, content));
    return content;
  }

  /// Where the next chunk after the position begins: one that the index knows or, in what is salvaged without an
  /// index, one that agrees with itself.
  Result<std::uint64_t> next_chunk() {
    const auto known = known_chunks_.upper_bound(position_);
    if (known != known_chunks_.end()) return known->first;
    if (!salvage_ || !known_chunks_.empty()) return limit_;
    std::vector<std::uint8_t> block;
    for (std::uint64_t begin = position_ + 1; begin < limit_; begin += block.size()) {
      block.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kCheckStep, limit_ - begin)));
      PRESCENE_RETURN_IF_ERROR(source_.read(begin, block));
      for (auto at = block.begin();; ++at) {
        at = std::find(at, block.end(), static_cast<std::uint8_t>(Op::kChunk));
        if (at == block.end()) break;
        const std::uint64_t offset = begin + static_cast<std::uint64_t>(at - block.begin());
        if (is_sound_chunk(offset)) return offset;
      }
    }
    return limit_;
  }

  bool is_sound_chunk(std::uint64_t offset) {
    const std::optional<Frame> frame = frame_at(offset);
    if (!frame || frame->op != Op::kChunk) return false;
    const std::uint64_t content_begin = offset + records::kFrameBytes;
    if (frame->length > limit_ - content_begin) return false;
    const Result<std::span<const std::uint8_t>> head =
        source_.peek(content_begin, static_cast<std::size_t>(std::min<std::uint64_t>(frame->length, kMaxChunkHead)));
    records::ChunkHead parsed;
    return head && parse(*head, &parsed) && agree(*frame, parsed) && find_compression(parsed.compression);
  }

  /// A chunk's length is given twice.
  static bool agree(const Frame& frame, const records::ChunkHead& head) {
    return frame.length >= head.bytes() && head.records_size == frame.length - head.bytes();
  }

  Status skip_damage() {
    PRESCENE_TRY(const std::uint64_t next, next_chunk());
    out_.loss.lost_bytes += next - position_;
    position_ = next;
    return core::ok_status();
  }

  /// The chunk at the position, also when it is cut; false when there is not even its head.
  Result<bool> add_chunk(const Frame& frame) {
    const std::uint64_t content_begin = position_ + records::kFrameBytes;
    const auto head_bytes =
        static_cast<std::size_t>(std::min<std::uint64_t>({limit_ - content_begin, frame.length, kMaxChunkHead}));
    PRESCENE_TRY(const std::span<const std::uint8_t> head, source_.peek(content_begin, head_bytes));
    records::ChunkHead parsed;
    if (!parse(head, &parsed)) return false;
    const bool fits = frame.length <= limit_ - content_begin && (!salvage_ || agree(frame, parsed));
    std::uint64_t content_end = content_begin + frame.length;
    if (!fits) {
      PRESCENE_TRY(content_end, next_chunk());
      content_end = std::max(content_end, content_begin + parsed.bytes());
    }
    McapSegment segment;
    segment.chunk = true;
    segment.crc = parsed.uncompressed_crc;
    segment.offset = content_begin + parsed.bytes();
    const std::uint64_t available = content_end - segment.offset;
    segment.cut = parsed.records_size > available;
    segment.length = std::min(parsed.records_size, available);
    segment.unpacked_length = parsed.uncompressed_size;
    segment.start_time = parsed.start_time;
    segment.end_time = parsed.end_time;
    segment.compression = std::move(parsed.compression);
    const auto known = known_chunks_.find(position_);
    position_ = content_end;
    if (known != known_chunks_.end() && fits && known->second.length == records::kFrameBytes + frame.length) {
      segment.channel_ids = known->second.channel_ids;
      position_ += known->second.message_index_length;
    }
    out_.segments.push_back(std::move(segment));
    return true;
  }

  /// A record that fits; false when its content is wrong.
  Result<bool> add_record(const Frame& frame) {
    const std::uint64_t bytes = records::kFrameBytes + frame.length;
    switch (frame.op) {
      case Op::kMessage: {
        if (frame.length < records::MessageHead::kBytes) return false;
        PRESCENE_TRY(const std::span<const std::uint8_t> content,
                     source_.peek(position_ + records::kFrameBytes, records::MessageHead::kBytes));
        records::MessageHead head;
        parse(content, &head);
        McapSegment& run = run_for(bytes);
        run.start_time = std::min(run.start_time, head.log_time);
        run.end_time = std::max(run.end_time, head.log_time);
        extend(&run, bytes);
        break;
      }
      case Op::kSchema:
      case Op::kChannel:
        extend(&run_for(bytes), bytes);
        break;
      case Op::kMetadata: {
        metadata_bytes_ += frame.length;
        if (metadata_bytes_ > kMaxMetadataBytes) {
          return core::resource_exhausted(source_.name() + ": its metadata has more than " +
                                          size_text(kMaxMetadataBytes) + ", which is the limit");
        }
        PRESCENE_TRY(const std::vector<std::uint8_t> content, content_at(position_, frame));
        if (!records::parse(content, &out_.metadata.emplace_back())) {
          out_.metadata.pop_back();
          return false;
        }
        break;
      }
      case Op::kAttachment:
        return add_attachment(frame);
      default:
        break;  // Indexes, and what later versions may add.
    }
    position_ += bytes;
    return true;
  }

  /// Its name is kept, not its data. One that makes no sense is passed over: no message needs it, and whoever asks for
  /// it is reported as not there.
  Result<bool> add_attachment(const Frame& frame) {
    const std::uint64_t begin = position_ + records::kFrameBytes;
    PRESCENE_TRY(
        const std::span<const std::uint8_t> head,
        source_.peek(begin, static_cast<std::size_t>(std::min<std::uint64_t>(frame.length, kMaxAttachmentHead))));
    position_ = begin + frame.length;
    McapStoredAttachment stored;
    if (!records::parse(head, &stored.head)) return true;
    const std::uint64_t beside_data = stored.head.bytes() + records::AttachmentHead::kChecksumBytes;
    if (frame.length < beside_data || stored.head.data_size != frame.length - beside_data) return true;
    metadata_bytes_ += stored.head.bytes() + sizeof stored;
    if (metadata_bytes_ > kMaxMetadataBytes) {
      return core::resource_exhausted(source_.name() +
                                      ": the names of its attachments and its metadata have more than " +
                                      size_text(kMaxMetadataBytes) + ", which is the limit");
    }
    stored.offset = begin;
    stored.length = frame.length;
    out_.attachments.push_back(std::move(stored));
    return true;
  }

  static void extend(McapSegment* run, std::uint64_t bytes) {
    run->length += bytes;
    run->unpacked_length += bytes;
  }

  /// The run of loose records that ends at the position, or a new one.
  McapSegment& run_for(std::uint64_t bytes) {
    const bool goes_on = !out_.segments.empty() && !out_.segments.back().chunk &&
                         out_.segments.back().offset + out_.segments.back().length == position_ &&
                         out_.segments.back().length + bytes <= kMaxRunBytes;
    if (!goes_on) {
      McapSegment& run = out_.segments.emplace_back();
      run.offset = position_;
      run.start_time = ~std::uint64_t{0};
    }
    return out_.segments.back();
  }

  /// Compares the checksum in the record that ends the data section with the bytes before that record. A recording
  /// that was closed has it at the end of the section; in one that was cut the walk may have come to it.
  Status check_data_section() {
    const bool closed = !out_.loss.truncated;
    if (closed && !out_.loss.bad_index && limit_ >= kMagicBytes + kDataEndBytes) {
      data_end_ = limit_ - kDataEndBytes;
    }
    out_.unchecked.data = closed;
    if (!data_end_ || source_.size() - *data_end_ < kDataEndBytes) return core::ok_status();
    std::array<std::uint8_t, kDataEndBytes> record{};
    PRESCENE_RETURN_IF_ERROR(source_.read(*data_end_, record));
    ByteReader in(record);
    const auto op = static_cast<Op>(in.read<std::uint8_t>());
    const auto length = in.read<std::uint64_t>();
    const auto expected = in.read<std::uint32_t>();
    if (op != Op::kDataEnd || length != sizeof expected) return core::ok_status();
    out_.unchecked.data = expected == 0;
    if (expected == 0 || !check_data_) return core::ok_status();
    std::uint32_t found = 0;
    std::vector<std::uint8_t> bytes;
    for (std::uint64_t offset = 0; offset < *data_end_; offset += bytes.size()) {
      bytes.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kCheckStep, *data_end_ - offset)));
      PRESCENE_RETURN_IF_ERROR(source_.read(offset, bytes));
      found = crc32(bytes, found);
    }
    out_.loss.damaged_data = found != expected;
    return core::ok_status();
  }

  /// A recording that was cut is whole up to the cut; one that was closed has no reason to have lost anything.
  Status refuse_damage() const {
    if (salvage_) return core::ok_status();
    const bool closed = !out_.loss.truncated;
    std::string what;
    if (out_.loss.bad_index) {
      what = "its index is";
    } else if (out_.loss.damaged_data) {
      what = "its data section is";
    } else if (closed && out_.loss.lost_bytes > 0) {
      what = size_text(static_cast<std::size_t>(out_.loss.lost_bytes)) + " of it are";
    } else {
      return core::ok_status();
    }
    return core::data_loss(source_.name() + ": " + what + " damaged" + kDamageRemedy);
  }

  McapSource& source_;
  bool salvage_;
  bool check_data_;
  std::uint64_t limit_;  ///< Where the data section must have ended.
  std::uint64_t position_ = 0;
  std::optional<std::uint64_t> data_end_;  ///< Where the record that ends the data section begins.
  std::map<std::uint64_t, KnownChunk> known_chunks_;
  std::uint64_t metadata_bytes_ = 0;
  McapLayout out_;
};

}  // namespace

Result<McapLayout> find_layout(McapSource* source, bool salvage, bool check_data) {
  return LayoutFinder(source, salvage, check_data).find();
}

}  // namespace prescene::interfaces
