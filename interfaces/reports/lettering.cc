// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/reports/lettering.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

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

using Stroke = std::vector<Vector2d>;

/// A letter on a grid: x to the right, y upwards, both one hexadecimal digit a point; the base line is at y = 3, small
/// letters reach 10, capitals 13. '~' begins a rounded stroke, 'o' a rounded closed one, '|' ends a stroke.
struct Glyph {
  char32_t character;
  int width;
  const char* strokes;
};
constexpr double kBase = 3.0, kCapital = 10.0, kGap = 2.4, kSpace = 4.2;
constexpr double kStrokeWidth = 0.135;  // of the height of capitals

constexpr Glyph kGlyphs[] = {
    {U'0', 6, "o03636D0D"},
    {U'1', 3, "0A3D33"},
    {U'2', 6, "~0A0D6D6803|0363"},
    {U'3', 6, "~0B0D5D5828|~2868630305"},
    {U'4', 6, "434D0666"},
    {U'5', 6, "5D0D08|~086A630305"},
    {U'6', 6, "~5D0D06|o03636909"},
    {U'7', 6, "0D6D23"},
    {U'8', 6, "o18585D1D|o03636808"},
    {U'9', 6, "o07676D0D|~6A6313"},
    {U'A', 8, "034D83|1676"},
    {U'B', 6, "030D|0D3D|~3D5D5838|0838|~38686333|3303"},
    {U'C', 6, "~6B6D0D036365"},
    {U'D', 7, "030D|0D2D|~2D7D7323|2303"},
    {U'E', 5, "5D0D0353|0848"},
    {U'F', 5, "5D0D03|0848"},
    {U'G', 6, "~6B6D0D036368|6838"},
    {U'H', 6, "030D|636D|0868"},
    {U'I', 0, "030D"},
    {U'J', 4, "~4D430306"},
    {U'K', 6, "030D|6D07|2863"},
    {U'L', 5, "0D0353"},
    {U'M', 8, "030D468D83"},
    {U'N', 6, "030D636D"},
    {U'O', 7, "o03737D0D"},
    {U'P', 6, "030D|0D3D|~3D6D6737|3707"},
    {U'Q', 7, "o03737D0D|4673"},
    {U'R', 6, "030D|0D3D|~3D6D6737|3707|3763"},
    {U'S', 6, "~6B6D0D0838|~3868630305"},
    {U'T', 6, "0D6D|3D33"},
    {U'U', 6, "0D07|~07036367|676D"},
    {U'V', 6, "0D336D"},
    {U'W', 10, "0D235D83AD"},
    {U'X', 6, "036D|0D63"},
    {U'Y', 6, "0D386D|3833"},
    {U'Z', 6, "0D6D0363"},
    {U'a', 5, "o03535A0A|5A53"},
    {U'b', 5, "0D03|o03535A0A"},
    {U'c', 5, "~595A0A035354"},
    {U'd', 5, "5D53|o03535A0A"},
    {U'e', 5, "0757|~575A0A035354"},
    {U'f', 3, "0A3A|~3D1D19|1913"},
    {U'g', 5, "o03535A0A|5A53|~53500001"},
    {U'h', 5, "0D03|~070A5A57|5753"},
    {U'i', 0, "030A|0D0D"},
    {U'j', 2, "2A21|~212000|2D2D"},
    {U'k', 5, "0D03|4A06|1753"},
    {U'l', 2, "0D05|~050323"},
    {U'm', 8, "0A03|~070A4A47|4743|~474A8A87|8783"},
    {U'n', 5, "0A03|~070A5A57|5753"},
    {U'o', 5, "o03535A0A"},
    {U'p', 5, "0A00|o03535A0A"},
    {U'q', 5, "5A50|o03535A0A"},
    {U'r', 3, "0A03|~070A3A"},
    {U's', 4, "~494A0A0727|~2747430304"},
    {U't', 4, "1D15|~151343|0A3A"},
    {U'u', 5, "0A06|~06035356|5A53"},
    {U'v', 6, "0A336A"},
    {U'w', 8, "0A234A638A"},
    {U'x', 5, "035A|0A53"},
    {U'y', 6, "0A33|6A20"},
    {U'z', 5, "0A5A0353"},
    {U'.', 0, "0303"},
    {U',', 1, "1301"},
    {U':', 0, "0303|0909"},
    {U';', 1, "1301|1909"},
    {U'-', 4, "0747"},
    {U'+', 6, "0868|3B35"},
    {U'%', 8, "038D|o09393D0D|o53838757"},
    {U'(', 2, "~2F0C0522"},
    {U')', 2, "~0F2C2502"},
    {U'/', 4, "024E"},
    {U'_', 5, "0252"},
    {U'=', 6, "0666|0969"},
    {U'\'', 0, "0D0B"},
    {U'!', 0, "0D06|0303"},
    {U'?', 5, "~0B0D5D5826|2625|2323"},
    {U'[', 2, "2E0E0222"},
    {U']', 2, "0E2E2202"},
    {U'<', 5, "5B0753"},
    {U'>', 5, "0B5703"},
    {U'|', 0, "0E02"},
    {U'^', 4, "0A2D4A"},
    {U'\u00b1', 6, "0969|3C36|0363"},
};
constexpr Glyph kUnknown = {U'?', 6, "03636D0D03"};

/// Corners cut three times [Chaikin 1974].
Stroke rounded(Stroke stroke, bool closed) {
  for (int round = 0; round < 3; ++round) {
    Stroke finer;
    const std::size_t count = stroke.size();
    if (!closed) finer.push_back(stroke.front());
    for (std::size_t i = 0; i + (closed ? 0 : 1) < count; ++i) {
      const Vector2d &a = stroke[i], &b = stroke[(i + 1) % count];
      finer.push_back(0.75 * a + 0.25 * b);
      finer.push_back(0.25 * a + 0.75 * b);
    }
    if (!closed) finer.push_back(stroke.back());
    stroke = std::move(finer);
  }
  if (closed) stroke.push_back(stroke.front());
  return stroke;
}

int digit(char c) { return c <= '9' ? c - '0' : c - 'A' + 10; }

/// Calls `use` with each stroke of a glyph, in grid units.
template <class Use>
void for_each_stroke(const Glyph& glyph, const Use& use) {
  std::string_view rest = glyph.strokes;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('|'), rest.size());
    std::string_view text = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    const char kind = text.front();
    if (kind == '~' || kind == 'o') text.remove_prefix(1);
    Stroke stroke;
    for (std::size_t i = 0; i + 1 < text.size(); i += 2) stroke.emplace_back(digit(text[i]), digit(text[i + 1]));
    if (kind == '~' || kind == 'o') stroke = rounded(std::move(stroke), kind == 'o');
    use(stroke);
  }
}

const Glyph& glyph_of(char32_t character) {
  for (const Glyph& glyph : kGlyphs)
    if (glyph.character == character) return glyph;
  return kUnknown;
}

/// Calls `use(glyph, x)` with each character and where it begins, in grid units; returns the text's width.
template <class Use>
double lay_out(std::string_view text, const Use& use) {
  double x = 0.0, end = 0.0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if ((byte & 0xc0u) == 0x80u) continue;  // the rest of a character of several bytes
    if (byte == ' ') {
      x += kSpace;
      continue;
    }
    char32_t character = byte;
    if (byte == 0xc2u && i + 1 < text.size()) character = static_cast<unsigned char>(text[i + 1]);
    const Glyph& glyph = glyph_of(character);
    use(glyph, x);
    end = x + glyph.width;
    x = end + kGap;
  }
  return end;
}

void draw_strokes(std::string_view text, const Vector2d& at, double height, double width, const Rgb& color,
                  double opacity, ColorImage& picture) {
  const double scale = height / kCapital;
  lay_out(text, [&](const Glyph& glyph, double x) {
    const auto place = [&](const Vector2d& p) {
      return Vector2d(at.x() + scale * (x + p.x()), at.y() - scale * (p.y() - kBase));
    };
    const double room = 0.5 * width + 1.0;
    Coverage coverage(picture, place({0.0, 15.0}) - Vector2d(room, room),
                      place({static_cast<double>(glyph.width), 0.0}) + Vector2d(room, room));
    if (coverage.empty()) return;
    for_each_stroke(glyph, [&](const Stroke& stroke) {
      for (std::size_t i = 0; i + 1 < stroke.size(); ++i)
        coverage.add_segment(place(stroke[i]), place(stroke[i + 1]),
                             stroke.size() == 2 && stroke[0] == stroke[1] ? 1.35 * width  // a dot
                                                                          : width);
    });
    coverage.paint(color, opacity, picture);
  });
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
  return height / kCapital * lay_out(text, [](const Glyph&, double) {});
}

void draw_text(std::string_view text, const Vector2d& at, double height, const Rgb& color, ColorImage& picture,
               TextAlign align) {
  draw_strokes(text, left_end(text, at, height, align), height, std::max(1.0, kStrokeWidth * height), color, 1.0,
               picture);
}

void draw_label(std::string_view text, const Vector2d& at, double height, const Rgb& color, ColorImage& picture,
                TextAlign align) {
  const double width = std::max(1.0, kStrokeWidth * height);
  draw_strokes(text, left_end(text, at, height, align), height, width + 0.45 * height, {255, 255, 255}, 0.8, picture);
  draw_text(text, at, height, color, picture, align);
}

}  // namespace prescene::interfaces
