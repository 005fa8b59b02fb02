// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/images/jpeg.h"

#include <cstdio>  // jpeglib.h uses FILE without including it.
//
#include <jerror.h>
#include <jpeglib.h>

#include <array>
#include <csetjmp>
#include <cstdlib>
#include <string>

#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;
using geometry::ColorImage;

// At best one bit a block of 8 x 8 pixels; what claims more than this has no data for most of its pixels.
constexpr std::uint64_t kMaxPixelsPerByte = 512;
// Each scan of a progressive image walks all of it again. Real encoders use about ten.
constexpr int kMaxScans = 100;
constexpr long kMaxLibraryMemory = 512L << 20;
constexpr int kMaxJpegSide = 65500;

/// libjpeg leaves its functions by longjmp, so that the members which call it hold no object with a destructor.
class JpegDecoder {
 public:
  explicit JpegDecoder(std::span<const std::uint8_t> bytes) {
    decompress_.err = jpeg_std_error(&error_manager_);
    decompress_.client_data = this;
    error_manager_.error_exit = &JpegDecoder::on_error;
    error_manager_.emit_message = &JpegDecoder::on_message;
    progress_.progress_monitor = &JpegDecoder::on_progress;
    created_ = create(bytes.data(), bytes.size());
  }
  ~JpegDecoder() {
    if (created_) jpeg_destroy_decompress(&decompress_);
  }
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;

  bool read_header(ImageSize* size) {
    if (!created_ || setjmp(escape_) != 0) return false;
    jpeg_read_header(&decompress_, TRUE);
    *size = {static_cast<int>(decompress_.image_width), static_cast<int>(decompress_.image_height)};
    return true;
  }

  bool read_rows(geometry::Rgb* pixels) {
    if (setjmp(escape_) != 0) return false;
    decompress_.out_color_space = JCS_RGB;
    jpeg_start_decompress(&decompress_);
    while (decompress_.output_scanline < decompress_.output_height) {
      JSAMPROW row = pixels[std::size_t{decompress_.output_scanline} * decompress_.output_width].data();
      jpeg_read_scanlines(&decompress_, &row, 1);
    }
    jpeg_finish_decompress(&decompress_);
    return true;
  }

  Status error() const {
    if (error_code_ == JERR_CONVERSION_NOTIMPL) {
      return core::unsupported("is a JPEG in a colour space that can't be made RGB (CMYK?); convert it to RGB");
    }
    if (error_code_ == JERR_NO_SOI) return core::invalid_input("not a JPEG file (bad signature); give a JPEG file");
    return core::data_loss("is a broken or cut JPEG: " + quote(message_.data()) + "; copy or write the file again");
  }

 private:
  bool create(const std::uint8_t* data, std::size_t size) {
    if (setjmp(escape_) != 0) return false;
    jpeg_create_decompress(&decompress_);
    decompress_.progress = &progress_;
    decompress_.mem->max_memory_to_use = kMaxLibraryMemory;
    jpeg_mem_src(&decompress_, data, size);
    return true;
  }

  [[noreturn]] static void on_error(j_common_ptr common) {
    auto* self = static_cast<JpegDecoder*>(common->client_data);
    self->error_code_ = common->err->msg_code;
    common->err->format_message(common, self->message_.data());
    std::longjmp(self->escape_, 1);
  }
  /// libjpeg goes on after these with grey pixels; we don't want a picture that was never taken.
  static void on_message(j_common_ptr common, int level) {
    if (level >= 0) return;
    const int code = common->err->msg_code;
    if (code == JWRN_EXTRANEOUS_DATA || code == JWRN_JFIF_MAJOR || code == JWRN_ADOBE_XFORM || code == JWRN_BOGUS_ICC)
      return;
    on_error(common);
  }
  static void on_progress(j_common_ptr common) {
    const auto* decompress = reinterpret_cast<j_decompress_ptr>(common);
    if (decompress->input_scan_number > kMaxScans) ERREXIT(common, JERR_BAD_PROGRESSION);
  }

  jpeg_decompress_struct decompress_{};
  jpeg_error_mgr error_manager_{};
  jpeg_progress_mgr progress_{};
  std::jmp_buf escape_{};
  bool created_ = false;
  int error_code_ = 0;
  std::array<char, JMSG_LENGTH_MAX> message_{};
};

bool starts_like_png(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= 2 && bytes[0] == 0x89 && bytes[1] == 'P';
}

// Writing to memory has no outside that could fail: an error is a bug of ours.
[[noreturn]] void on_encode_error(j_common_ptr common) {
  std::array<char, JMSG_LENGTH_MAX> message{};
  common->err->format_message(common, message.data());
  core::check_failed(__FILE__, __LINE__, "libjpeg writes", message.data());
}

Result<ColorImage> decode_file(const std::filesystem::path& path, const ImageLimits& limits,
                               Result<ColorImage> (*decode)(std::span<const std::uint8_t>, const ImageLimits&)) {
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, read_file(path, limits.max_file_bytes));
  Result<ColorImage> image = decode(bytes, limits);
  if (!image) return image.status().at(path.string());
  return image;
}

}  // namespace

Result<ColorImage> decode_jpeg(std::span<const std::uint8_t> bytes, const ImageLimits& limits) {
  if (bytes.empty()) return core::data_loss("is empty; write the JPEG again");
  JpegDecoder decoder(bytes);
  ImageSize size;
  if (!decoder.read_header(&size)) return decoder.error();
  const std::string size_words = std::to_string(size.width) + " x " + std::to_string(size.height) + " pixels";
  const std::uint64_t pixels = static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height);
  if (size.width > limits.max_side || size.height > limits.max_side ||
      pixels > static_cast<std::uint64_t>(limits.max_pixels)) {
    return core::resource_exhausted("has " + size_words + "; the limits are " + std::to_string(limits.max_side) +
                                    " a side and " + std::to_string(limits.max_pixels) + " in all");
  }
  if (pixels > kMaxPixelsPerByte * bytes.size()) {
    return core::data_loss("says it has " + size_words + ", more than its " + size_text(bytes.size()) +
                           " can hold; copy the file again");
  }
  ColorImage image(size.width, size.height);
  if (!decoder.read_rows(image.data())) return decoder.error();
  return image;
}

std::vector<std::uint8_t> encode_jpeg(ColorView image, int quality) {
  PRESCENE_CHECK(image.width() > 0 && image.width() <= kMaxJpegSide && image.height() > 0 &&
                 image.height() <= kMaxJpegSide);
  PRESCENE_CHECK(quality >= 1 && quality <= 100);
  jpeg_error_mgr error_manager{};
  jpeg_compress_struct compress{};
  compress.err = jpeg_std_error(&error_manager);
  error_manager.error_exit = on_encode_error;
  jpeg_create_compress(&compress);
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&compress, &buffer, &size);
  compress.image_width = static_cast<JDIMENSION>(image.width());
  compress.image_height = static_cast<JDIMENSION>(image.height());
  compress.input_components = 3;
  compress.in_color_space = JCS_RGB;
  jpeg_set_defaults(&compress);
  jpeg_set_quality(&compress, quality, TRUE);
  if (quality >= 90) {
    for (int i = 0; i < compress.num_components; ++i) {
      compress.comp_info[i].h_samp_factor = 1;
      compress.comp_info[i].v_samp_factor = 1;
    }
  }
  jpeg_start_compress(&compress, TRUE);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(image.width()) * 3);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) std::copy_n(image(x, y).data(), 3, &row[static_cast<std::size_t>(x) * 3]);
    JSAMPROW pointer = row.data();
    jpeg_write_scanlines(&compress, &pointer, 1);
  }
  jpeg_finish_compress(&compress);
  jpeg_destroy_compress(&compress);
  std::vector<std::uint8_t> out(buffer, buffer + size);
  std::free(buffer);
  return out;
}

Result<ColorImage> decode_color(std::span<const std::uint8_t> bytes, const ImageLimits& limits) {
  if (starts_like_png(bytes)) return decode_png_color(bytes, limits);
  if (bytes.size() >= 2 && bytes[0] == 0xff && bytes[1] == 0xd8) return decode_jpeg(bytes, limits);
  return core::invalid_input("neither a PNG nor a JPEG file (bad signature); convert it to one");
}

Result<ColorImage> read_color(const std::filesystem::path& path, const ImageLimits& limits) {
  return decode_file(path, limits, decode_color);
}

}  // namespace prescene::interfaces
