// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include <array>
#include <bit>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/byte_reader.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/images/png.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;
using geometry::ColorImage;
using geometry::DepthImage;
using geometry::LabelImage;

// Deflate cannot pack more than this many bytes into one (RFC 1951: 258 bytes in two bits).
constexpr std::uint64_t kMaxDeflateRatio = 1032;
constexpr std::size_t kMaxMetadataChunkBytes = std::size_t{1} << 20;
constexpr std::uint32_t kMaxMetadataChunks = 128;

struct PngHeader {
  ImageSize size;
  int bit_depth = 0;
  int color_type = 0;

  std::uint64_t raw_bytes() const {
    static constexpr std::array<std::uint64_t, 7> kChannels = {1, 0, 3, 1, 2, 0, 4};
    const std::uint64_t row_bits = static_cast<std::uint64_t>(size.width) *
                                   kChannels[static_cast<std::size_t>(color_type)] *
                                   static_cast<std::uint64_t>(bit_depth);
    return (row_bits + 7) / 8 * static_cast<std::uint64_t>(size.height);
  }
};

Result<PngHeader> parse_header(std::span<const std::uint8_t> bytes, const ImageLimits& limits) {
  static constexpr std::array<std::uint8_t, 16> kStart = {0x89, 'P', 'N', 'G', 0x0d, 0x0a, 0x1a, 0x0a,
                                                          0,    0,   0,   13,  'I',  'H',  'D',  'R'};
  const std::size_t compared = std::min(bytes.size(), kStart.size());
  if (compared == 0) return core::data_loss("is empty; write the PNG again");
  if (std::memcmp(bytes.data(), kStart.data(), compared) != 0) {
    return core::invalid_input("not a PNG file (bad signature); give a PNG file");
  }
  ByteReader in(bytes, std::endian::big);
  in.take(kStart.size());
  const auto width = in.read<std::uint32_t>();
  const auto height = in.read<std::uint32_t>();
  const auto bit_depth = in.read<std::uint8_t>();
  const auto color_type = in.read<std::uint8_t>();
  if (!in.ok()) return core::data_loss("is cut within its header; copy the file again");

  const std::string size_words = std::to_string(width) + " x " + std::to_string(height) + " pixels";
  if (width == 0 || height == 0) return core::invalid_input("says it has " + size_words + "; write the PNG again");
  const bool too_large = width > static_cast<std::uint32_t>(limits.max_side) ||
                         height > static_cast<std::uint32_t>(limits.max_side) ||
                         std::uint64_t{width} * height > static_cast<std::uint64_t>(limits.max_pixels);
  if (too_large) {
    return core::resource_exhausted("has " + size_words + "; the limits are " + std::to_string(limits.max_side) +
                                    " a side and " + std::to_string(limits.max_pixels) + " in all");
  }
  const bool known_type = color_type == 0 || color_type == 2 || color_type == 3 || color_type == 4 || color_type == 6;
  if (!known_type || bit_depth == 0 || bit_depth > 16) {
    return core::invalid_input("has the unknown colour type " + std::to_string(color_type) + " with " +
                               std::to_string(bit_depth) + " bits; write the PNG again");
  }
  const PngHeader header{{static_cast<int>(width), static_cast<int>(height)}, bit_depth, color_type};
  if (header.raw_bytes() > bytes.size() * kMaxDeflateRatio) {
    return core::data_loss("says it has " + size_words + ", more than its " + size_text(bytes.size()) +
                           " can hold; copy the file again");
  }
  return header;
}

/// libpng's reader over bytes in memory. libpng leaves its functions by longjmp, so that the members which call it
/// hold no object with a destructor.
class PngDecoder {
 public:
  explicit PngDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, &PngDecoder::on_error, &PngDecoder::on_warning);
    PRESCENE_CHECK_MSG(png_ != nullptr, "libpng of another version, or no memory");
    info_ = png_create_info_struct(png_);
    PRESCENE_CHECK(info_ != nullptr);
  }
  ~PngDecoder() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngDecoder(const PngDecoder&) = delete;
  PngDecoder& operator=(const PngDecoder&) = delete;

  enum class Output { kRgb8, kGrey };

  /// Sets up the conversion; `bytes_per_row` of what read_rows() will write. False: see error().
  bool start(Output output, std::size_t* bytes_per_row) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_read_fn(png_, this, &PngDecoder::on_read);
    png_set_chunk_malloc_max(png_, kMaxMetadataChunkBytes);
    png_set_chunk_cache_max(png_, kMaxMetadataChunks);
    png_set_user_limits(png_, 0x7fffffff, 0x7fffffff);  // Checked before, against our own limits.
    png_read_info(png_, info_);
    png_set_interlace_handling(png_);
    if (output == Output::kRgb8) {
      png_set_expand(png_);
      png_set_scale_16(png_);
      png_set_gray_to_rgb(png_);
    } else {
      png_set_packing(png_);
      if (std::endian::native == std::endian::little) png_set_swap(png_);
    }
    png_set_strip_alpha(png_);
    png_read_update_info(png_, info_);
    *bytes_per_row = png_get_rowbytes(png_, info_);
    return true;
  }

  /// All rows, and the end of the file with its checksum.
  bool read_rows(png_bytep* rows) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }

  Status error() const {
    if (cut_) return core::data_loss("is cut; copy the file again");
    return core::data_loss("is broken: " + quote(message_.data()) + " at about byte " + std::to_string(position_) +
                           "; copy or write the file again");
  }

 private:
  static void on_read(png_structp png, png_bytep out, std::size_t count) {
    auto* self = static_cast<PngDecoder*>(png_get_io_ptr(png));
    if (count > self->bytes_.size() - self->position_) {
      self->cut_ = true;
      png_error(png, "cut");
    }
    std::memcpy(out, self->bytes_.data() + self->position_, count);
    self->position_ += count;
  }
  [[noreturn]] static void on_error(png_structp png, png_const_charp message) {
    auto* self = static_cast<PngDecoder*>(png_get_error_ptr(png));
    std::snprintf(self->message_.data(), self->message_.size(), "%s", message);
    png_longjmp(png, 1);
  }
  static void on_warning(png_structp /*png*/, png_const_charp /*message*/) {}

  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::span<const std::uint8_t> bytes_;
  std::size_t position_ = 0;
  bool cut_ = false;
  std::array<char, 96> message_{};
};

template <class Pixel>
Result<geometry::Image<Pixel>> decode(std::span<const std::uint8_t> bytes, const PngHeader& header,
                                      PngDecoder::Output output) {
  PngDecoder decoder(bytes);
  std::size_t bytes_per_row = 0;
  if (!decoder.start(output, &bytes_per_row)) return decoder.error();
  PRESCENE_CHECK(bytes_per_row == static_cast<std::size_t>(header.size.width) * sizeof(Pixel));
  geometry::Image<Pixel> image(header.size.width, header.size.height);
  std::vector<png_bytep> rows;
  for (int y = 0; y < image.height(); ++y) rows.push_back(reinterpret_cast<png_bytep>(image.view().row(y)));
  if (!decoder.read_rows(rows.data())) return decoder.error();
  return image;
}

std::string kind_text(const PngHeader& header) {
  static constexpr std::array<const char*, 7> kNames = {
      "grey", "", "colour", "palette", "grey with alpha", "", "colour with alpha"};
  return std::to_string(header.bit_depth) + "-bit " + kNames[static_cast<std::size_t>(header.color_type)];
}

bool is_grey(const PngHeader& header) {
  return header.color_type == PNG_COLOR_TYPE_GRAY || header.color_type == PNG_COLOR_TYPE_GRAY_ALPHA;
}

template <class Decode>
auto decode_file(const std::filesystem::path& path, const ImageLimits& limits, Decode decode_bytes)
    -> decltype(decode_bytes({})) {
  const Result<std::vector<std::uint8_t>> bytes = read_file(path, limits.max_file_bytes);
  if (!bytes) return bytes.status();
  auto image = decode_bytes(std::span<const std::uint8_t>(*bytes));
  if (!image) return image.status().at(path.string());
  return image;
}

}  // namespace

Result<ImageSize> decode_png_size(std::span<const std::uint8_t> bytes, const ImageLimits& limits) {
  PRESCENE_TRY(const PngHeader header, parse_header(bytes, limits));
  return header.size;
}

Result<ColorImage> decode_png_color(std::span<const std::uint8_t> bytes, const ImageLimits& limits) {
  PRESCENE_TRY(const PngHeader header, parse_header(bytes, limits));
  return decode<geometry::Rgb>(bytes, header, PngDecoder::Output::kRgb8);
}

Result<geometry::Image<std::uint16_t>> decode_png_gray16(std::span<const std::uint8_t> bytes,
                                                         const ImageLimits& limits) {
  PRESCENE_TRY(const PngHeader header, parse_header(bytes, limits));
  if (!is_grey(header) || header.bit_depth != 16) {
    return core::invalid_input("is " + kind_text(header) + ", but depth needs 16-bit grey; is it the colour image?");
  }
  return decode<std::uint16_t>(bytes, header, PngDecoder::Output::kGrey);
}

Result<DepthImage> decode_png_depth(std::span<const std::uint8_t> bytes, double metres_per_unit,
                                    const ImageLimits& limits) {
  PRESCENE_CHECK(metres_per_unit > 0.0 && std::isfinite(metres_per_unit));
  PRESCENE_TRY(const geometry::Image<std::uint16_t> units, decode_png_gray16(bytes, limits));
  DepthImage depth(units.width(), units.height());
  for (std::size_t i = 0; i < units.size(); ++i) {
    const std::uint16_t value = units.data()[i];
    const bool missing = value == std::numeric_limits<std::uint16_t>::max();
    depth.data()[i] = missing ? 0.0F : static_cast<float>(value * metres_per_unit);
  }
  return depth;
}

Result<LabelImage> decode_png_label(std::span<const std::uint8_t> bytes, const ImageLimits& limits) {
  PRESCENE_TRY(const PngHeader header, parse_header(bytes, limits));
  if (!is_grey(header) && header.color_type != PNG_COLOR_TYPE_PALETTE) {
    return core::invalid_input("is " + kind_text(header) + ", but labels need grey or a palette");
  }
  if (header.bit_depth == 16) return decode<std::uint16_t>(bytes, header, PngDecoder::Output::kGrey);
  PRESCENE_TRY(const geometry::Image<std::uint8_t> small,
               decode<std::uint8_t>(bytes, header, PngDecoder::Output::kGrey));
  LabelImage labels(small.width(), small.height());
  for (std::size_t i = 0; i < small.size(); ++i) labels.data()[i] = small.data()[i];
  return labels;
}

Result<ImageSize> read_png_size(const std::filesystem::path& path, const ImageLimits& limits) {
  return decode_file(path, limits, [&](std::span<const std::uint8_t> bytes) { return decode_png_size(bytes, limits); });
}

Result<ColorImage> read_png_color(const std::filesystem::path& path, const ImageLimits& limits) {
  return decode_file(path, limits,
                     [&](std::span<const std::uint8_t> bytes) { return decode_png_color(bytes, limits); });
}

Result<DepthImage> read_png_depth(const std::filesystem::path& path, double metres_per_unit,
                                  const ImageLimits& limits) {
  return decode_file(path, limits, [&](std::span<const std::uint8_t> bytes) {
    return decode_png_depth(bytes, metres_per_unit, limits);
  });
}

Result<LabelImage> read_png_label(const std::filesystem::path& path, const ImageLimits& limits) {
  return decode_file(path, limits,
                     [&](std::span<const std::uint8_t> bytes) { return decode_png_label(bytes, limits); });
}

}  // namespace prescene::interfaces
