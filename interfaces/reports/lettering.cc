// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/reports/lettering.h"

#include <freetype/freetype.h>
#include <freetype/ftglyph.h>
#include <freetype/ftstroke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <new>
#include <string_view>
#include <vector>

#include "font_file.h"
#include "prescene/core/check.h"
#include "prescene/core/utf8.h"

namespace prescene::interfaces {
namespace {

using Eigen::Vector2d;
using geometry::ColorImage;
using geometry::Rgb;

/// How much of each pixel a shape covers; the union of what is added.
class Coverage {
 public:
  Coverage(const ColorImage& picture, Vector2d low, Vector2d high) {
    x0_ = std::max(0, static_cast<int>(std::floor(low.x())));
    y0_ = std::max(0, static_cast<int>(std::floor(low.y())));
    width_ = std::max(0, std::min(picture.width() - 1, static_cast<int>(std::ceil(high.x()))) - x0_ + 1);
    height_ = std::max(0, std::min(picture.height() - 1, static_cast<int>(std::ceil(high.y()))) - y0_ + 1);
    shares_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0.0f);
  }
  bool empty() const { return shares_.empty(); }

  void add_segment(const Vector2d& a, const Vector2d& b, double width) {
    const double reach = 0.5 * width + 1.0;
    const Vector2d along = b - a;
    const double square = along.squaredNorm();
    const int x_begin = std::max(0, static_cast<int>(std::floor(std::min(a.x(), b.x()) - reach)) - x0_);
    const int x_end = std::min(width_ - 1, static_cast<int>(std::ceil(std::max(a.x(), b.x()) + reach)) - x0_);
    const int y_begin = std::max(0, static_cast<int>(std::floor(std::min(a.y(), b.y()) - reach)) - y0_);
    const int y_end = std::min(height_ - 1, static_cast<int>(std::ceil(std::max(a.y(), b.y()) + reach)) - y0_);
    for (int y = y_begin; y <= y_end; ++y) {
      for (int x = x_begin; x <= x_end; ++x) {
        const Vector2d p(x + x0_, y + y0_);
        const double t = square > 0.0 ? std::clamp((p - a).dot(along) / square, 0.0, 1.0) : 0.0;
        const double distance = (p - a - t * along).norm();
        float& share = shares_[index(x, y)];
        share = std::max(share, static_cast<float>(std::clamp(0.5 * width + 0.5 - distance, 0.0, 1.0)));
      }
    }
  }
  /// Its upper left pixel at (left, top).
  void add_bitmap(const FT_Bitmap& bitmap, int left, int top) {
    for (int row = 0; row < static_cast<int>(bitmap.rows); ++row)
      for (int column = 0; column < static_cast<int>(bitmap.width); ++column) {
        const int x = left + column - x0_, y = top + row - y0_;
        if (x < 0 || y < 0 || x >= width_ || y >= height_) continue;
        const auto value = static_cast<float>(bitmap.buffer[row * bitmap.pitch + column]) / 255.0f;
        float& share = shares_[index(x, y)];
        share = std::max(share, value);
      }
  }
  void paint(const Rgb& color, double opacity, ColorImage& picture) const {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        if (const float share = shares_[index(x, y)]; share > 0.0f)
          mix(picture(x + x0_, y + y0_), color, opacity * static_cast<double>(share));
  }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  int x0_, y0_, width_, height_;
  std::vector<float> shares_;
};

constexpr FT_Int32 kUnhinted = FT_LOAD_NO_HINTING | FT_LOAD_NO_BITMAP;

/// The font is part of the program: nothing but a lack of memory can go wrong.
void check_font(FT_Error error) {
  if (error == FT_Err_Out_Of_Memory) throw std::bad_alloc();
  PRESCENE_CHECK_MSG(error == FT_Err_Ok, "FreeType cannot use the program's own font");
}

struct DoneGlyph {
  void operator()(FT_Glyph glyph) const { FT_Done_Glyph(glyph); }
};
using OwnedGlyph = std::unique_ptr<FT_GlyphRec_, DoneGlyph>;

/// The letters of the font. One a thread: FreeType's faces must not be shared.
class Letters {
 public:
  static Letters& of_thread() {
    thread_local Letters letters;
    return letters;
  }
  Letters(const Letters&) = delete;
  Letters& operator=(const Letters&) = delete;

  /// Pixels of the square that letters are drawn on, for capitals of `height` pixels.
  void set_height(double height) {
    constexpr double kLargest = 16000.0;  // pixels; FreeType counts them in 16 bits
    const double em = std::clamp(height / capital_, 1.0, kLargest);
    check_font(FT_Set_Char_Size(face_, 0, std::lround(64.0 * em), 72, 72));
  }

  /// Calls `use(x)` with each character loaded and where it begins, in pixels from the text's left end; returns the
  /// text's width.
  template <class Use>
  double lay_out(std::string_view text, const Use& use) {
    double x = 0.0;
    for (std::size_t i = 0; i < text.size(); i += std::max<std::size_t>(1, core::utf8_length_at(text, i))) {
      check_font(FT_Load_Char(face_, core::utf8_character_at(text, i), kUnhinted));
      use(x);
      x += static_cast<double>(face_->glyph->linearHoriAdvance) / 65536.0;
    }
    return x;
  }

  /// Adds the loaded character with its origin at `at` (pixels, y down) and widened by `halo` pixels all around.
  void add_to(Coverage& coverage, const Vector2d& at, double halo) const {
    FT_Glyph glyph = nullptr;
    check_font(FT_Get_Glyph(face_->glyph, &glyph));
    OwnedGlyph owner(glyph);
    if (halo > 0.0 && glyph->format == FT_GLYPH_FORMAT_OUTLINE) {
      FT_Stroker_Set(stroker_, std::lround(64.0 * halo), FT_STROKER_LINECAP_ROUND, FT_STROKER_LINEJOIN_ROUND, 0);
      check_font(FT_Glyph_StrokeBorder(&glyph, stroker_, 0, 0));
      owner.reset(glyph);
    }
    // FreeType's pixels begin at integers, ours are about them. The lowest row of letters is that of the base line, so
    // that they stand sharp on it.
    const int left = static_cast<int>(std::floor(at.x() + 0.5));
    FT_Vector shift{std::lround(64.0 * (at.x() + 0.5 - left)), 0};
    check_font(FT_Glyph_To_Bitmap(&glyph, FT_RENDER_MODE_NORMAL, &shift, 0));
    const OwnedGlyph drawn(glyph);
    const auto* bitmap = reinterpret_cast<const FT_BitmapGlyphRec_*>(glyph);
    coverage.add_bitmap(bitmap->bitmap, left + bitmap->left, static_cast<int>(std::lround(at.y())) + 1 - bitmap->top);
  }

 private:
  Letters() {
    check_font(FT_Init_FreeType(&library_));
    const std::span<const unsigned char> file = font_file();
    check_font(FT_New_Memory_Face(library_, file.data(), static_cast<FT_Long>(file.size()), 0, &face_));
    check_font(FT_Stroker_New(library_, &stroker_));
    check_font(FT_Load_Char(face_, 'H', FT_LOAD_NO_SCALE));
    capital_ = static_cast<double>(face_->glyph->metrics.horiBearingY) / face_->units_per_EM;
  }
  ~Letters() {
    FT_Stroker_Done(stroker_);
    FT_Done_FreeType(library_);  // and its faces
  }

  FT_Library library_ = nullptr;
  FT_Face face_ = nullptr;
  FT_Stroker stroker_ = nullptr;
  double capital_ = 1.0;  // height of a capital, of the square that letters are drawn on
};

void draw_letters(std::string_view text, const Vector2d& at, double height, double halo, const Rgb& color,
                  double opacity, ColorImage& picture) {
  const double limit = 16.0 * std::max(picture.width(), picture.height());
  if (!(height > 0.0) || !at.allFinite() || at.cwiseAbs().maxCoeff() > limit) return;
  Letters& letters = Letters::of_thread();
  letters.set_height(height);
  const double width = letters.lay_out(text, [](double) {});
  const Vector2d room = Vector2d::Constant(2.0 * height + halo);  // beyond base line and ends: accents, overhangs
  Coverage coverage(picture, at - room, at + Vector2d(width, 0.0) + room);
  if (coverage.empty()) return;
  letters.lay_out(text, [&](double x) { letters.add_to(coverage, at + Vector2d(x, 0.0), halo); });
  coverage.paint(color, opacity, picture);
}

Vector2d left_end(std::string_view text, const Vector2d& at, double height, TextAlign align) {
  const double width = text_width(text, height);
  const double shift = align == TextAlign::kLeft ? 0.0 : align == TextAlign::kCenter ? 0.5 * width : width;
  return at - Vector2d(shift, 0.0);
}

}  // namespace

void mix(Rgb& pixel, const Rgb& color, double share) {
  for (std::size_t c = 0; c < 3; ++c)
    pixel[c] = static_cast<std::uint8_t>(std::lround((1.0 - share) * pixel[c] + share * color[c]));
}

void draw_line(std::span<const Vector2d> points, double width, const Rgb& color, double opacity, ColorImage& picture) {
  Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  const double limit = 16.0 * std::max(picture.width(), picture.height());  // bounds the work of a wild point
  const auto usable = [&](const Vector2d& p) { return p.allFinite() && p.cwiseAbs().maxCoeff() < limit; };
  for (const Vector2d& point : points) {
    if (!usable(point)) continue;
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Vector2d room = Vector2d::Constant(0.5 * width + 1.0);
  Coverage coverage(picture, low - room, high + room);
  if (coverage.empty()) return;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector2d& next = points[std::min(i + 1, points.size() - 1)];
    if (usable(points[i]) && usable(next)) coverage.add_segment(points[i], next, width);
  }
  coverage.paint(color, opacity, picture);
}

void draw_dashed_line(std::span<const Vector2d> points, double dash, double width, const Rgb& color, double opacity,
                      ColorImage& picture) {
  double way = 0.0;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const Vector2d along = points[i + 1] - points[i];
    const double length = along.norm();
    if (!std::isfinite(length) || length > 1e5) continue;
    for (double from = 0.0; from < length;) {
      const double phase = std::fmod(way + from, 2.0 * dash);
      const double to = std::min(length, from + std::max(1e-3, (phase < dash ? dash : 2.0 * dash) - phase));
      const std::array<Vector2d, 2> piece{points[i] + from / length * along, points[i] + to / length * along};
      if (phase < dash) draw_line(piece, width, color, opacity, picture);
      from = to;
    }
    way += length;
  }
}

void fill_rectangle(int x0, int y0, int x1, int y1, const Rgb& color, double opacity, ColorImage& picture) {
  for (int y = std::max(0, y0); y < std::min(picture.height(), y1); ++y)
    for (int x = std::max(0, x0); x < std::min(picture.width(), x1); ++x) mix(picture(x, y), color, opacity);
}

double text_width(std::string_view text, double height) {
  if (!(height > 0.0)) return 0.0;
  Letters& letters = Letters::of_thread();
  letters.set_height(height);
  return letters.lay_out(text, [](double) {});
}

void draw_text(std::string_view text, const Vector2d& at, double height, const Rgb& color, ColorImage& picture,
               TextAlign align) {
  draw_letters(text, left_end(text, at, height, align), height, 0.0, color, 1.0, picture);
}

void draw_label(std::string_view text, const Vector2d& at, double height, const Rgb& color, ColorImage& picture,
                TextAlign align) {
  draw_letters(text, left_end(text, at, height, align), height, 0.225 * height, {255, 255, 255}, 0.8, picture);
  draw_text(text, at, height, color, picture, align);
}

}  // namespace prescene::interfaces
