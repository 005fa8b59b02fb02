// SPDX-License-Identifier: Apache-2.0
// PLY [Turk 1994]: a text header that declares elements with properties, then their values as text or binary.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "ply_header.h"
#include "prescene/interfaces/bytes/byte_reader.h"
#include "prescene/interfaces/bytes/text.h"
#include "raw_mesh.h"
#include "text_scanner.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

// Rounding that a floating-point colour may have beyond its range of 0 to 1.
constexpr double kColorExcess = 0.01;

/// Values one after another, as text.
class TextSource {
 public:
  TextSource(std::string_view text, const PlyHeader& header)
      : words_(text.substr(header.body_byte), header.body_line) {}

  bool number(PlyType /*type*/, double* value) {
    const std::string_view word = words_.word();
    bad_word_ = word;
    return parse_number(word, value);
  }
  bool skip(PlyType type, std::uint64_t count) {
    double ignored = 0.0;
    for (; count > 0; --count) {
      if (!number(type, &ignored)) return false;
    }
    return true;
  }
  Status error() const {
    const std::string place = "line " + std::to_string(words_.line()) + ": ";
    if (bad_word_.empty())
      return core::data_loss(place + "the file ends before all that its header names; copy it again");
    return core::invalid_input(place + quote(bad_word_) + " is no number");
  }
  std::string place_kind() const { return "line"; }
  std::size_t place() const { return words_.line(); }
  /// At least one character and one space a value; the last may lack the space.
  std::uint64_t max_values() const { return (words_.rest().size() + 1) / 2; }
  static std::uint64_t cost(PlyType /*type*/) { return 1; }

 private:
  TextScanner words_;
  std::string_view bad_word_;
};

/// Values one after another, binary.
class BinarySource {
 public:
  BinarySource(std::span<const std::uint8_t> bytes, const PlyHeader& header)
      : start_(header.body_byte),
        in_(bytes.subspan(header.body_byte),
            header.encoding == PlyEncoding::kBigEndian ? std::endian::big : std::endian::little) {}

  bool number(PlyType type, double* value) {
    switch (type) {
      case PlyType::kI8:
        *value = in_.read<std::int8_t>();
        break;
      case PlyType::kU8:
        *value = in_.read<std::uint8_t>();
        break;
      case PlyType::kI16:
        *value = in_.read<std::int16_t>();
        break;
      case PlyType::kU16:
        *value = in_.read<std::uint16_t>();
        break;
      case PlyType::kI32:
        *value = in_.read<std::int32_t>();
        break;
      case PlyType::kU32:
        *value = in_.read<std::uint32_t>();
        break;
      case PlyType::kF32:
        *value = static_cast<double>(in_.read<float>());
        break;
      case PlyType::kF64:
        *value = in_.read<double>();
        break;
    }
    return in_.ok();
  }
  bool skip(PlyType type, std::uint64_t count) {
    if (count > in_.remaining() / bytes_of(type)) return false;
    in_.take(count * bytes_of(type));
    return true;
  }
  Status error() const {
    return core::data_loss("byte " + std::to_string(place()) +
                           ": the file ends before all that its header names; copy it again");
  }
  std::string place_kind() const { return "byte"; }
  std::size_t place() const { return start_ + in_.position(); }
  std::uint64_t max_values() const { return in_.remaining(); }
  static std::uint64_t cost(PlyType type) { return bytes_of(type); }

 private:
  std::size_t start_;
  ByteReader in_;
};

template <class Source>
class Body {
 public:
  Body(const PlyHeader& header, const MeshReadOptions& options, Source source)
      : header_(header), options_(options), in_(std::move(source)) {}

  Result<RawMesh> read() {
    for (const PlyElement& element : header_.elements) {
      if (element.name == "vertex") vertex_count_ = element.count;
    }
    for (const PlyElement& element : header_.elements) {
      PRESCENE_RETURN_IF_ERROR(check_count(element));
      if (element.name == "vertex") {
        PRESCENE_RETURN_IF_ERROR(read_vertices(element));
      } else if (element.name == "face") {
        PRESCENE_RETURN_IF_ERROR(read_faces(element));
      } else {
        has_strips_ |= element.name == "tristrips";
        PRESCENE_RETURN_IF_ERROR(skip_element(element));
      }
    }
    if (has_strips_ && out_.mesh.triangles.empty()) {
      return core::unsupported("has triangle strips (tristrips) instead of faces; save it with faces");
    }
    if (small_faces_ > 0) {
      out_.warnings.push_back(std::to_string(small_faces_) + " faces with fewer than three corners were left out");
    }
    out_.unread_look = header_.names_texture;
    return std::move(out_);
  }

 private:
  /// So that nothing is reserved or looped over which the file can't hold.
  Status check_count(const PlyElement& element) const {
    std::uint64_t cost = 0;
    for (const PlyProperty& property : element.properties)
      cost += Source::cost(property.list_count.value_or(property.type));
    if (cost > 0 && element.count > in_.max_values() / cost) {
      return core::data_loss(in_.place_kind() + " " + std::to_string(in_.place()) + ": the header names " +
                             std::to_string(element.count) + " of " + quote(element.name) +
                             ", more than the rest of the file can hold; copy it again");
    }
    if (element.name == "vertex" || element.name == "face") return check_triangle_count(element.count, options_);
    return core::ok_status();
  }

  Status read_vertices(const PlyElement& element) {
    static constexpr std::array<std::array<std::string_view, 2>, 6> kNames = {{{"x", "x"},
                                                                               {"y", "y"},
                                                                               {"z", "z"},
                                                                               {"red", "diffuse_red"},
                                                                               {"green", "diffuse_green"},
                                                                               {"blue", "diffuse_blue"}}};
    std::array<std::optional<std::size_t>, 6> where;
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      for (std::size_t n = 0; n < 6; ++n) {
        const std::string& name = element.properties[p].name;
        if (!element.properties[p].list_count && (name == kNames[n][0] || name == kNames[n][1])) where[n] = p;
      }
    }
    if (!where[0] || !where[1] || !where[2]) {
      return core::invalid_input("the header gives the vertices no properties x, y and z");
    }
    const bool has_colors = where[3] && where[4] && where[5];
    std::vector<double> values(element.properties.size());
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (std::size_t p = 0; p < values.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        if (property.list_count) {
          PRESCENE_RETURN_IF_ERROR(skip_list(property));
        } else if (!in_.number(property.type, &values[p])) {
          return in_.error();
        }
      }
      out_.mesh.vertices.push_back({values[*where[0]], values[*where[1]], values[*where[2]]});
      note_vertex(out_.mesh.vertices.back(), in_.place_kind(), in_.place(), out_.mesh.vertices.size() - 1, &out_);
      if (!has_colors) continue;
      geometry::Rgb color{};
      for (std::size_t c = 0; c < 3; ++c) {
        const PlyType type = element.properties[*where[3 + c]].type;
        const double value = values[*where[3 + c]], full = full_channel(type);
        const double excess = full == 1.0 ? kColorExcess : 0.0;
        if (!(value >= -excess && value <= full + excess)) return bad_color(value, full);
        is_dark_ &= type == PlyType::kU16 && value <= 255.0;
        color[c] = static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value / full, 0.0, 1.0)));
      }
      out_.colors.push_back(color);
    }
    if (is_dark_ && !out_.colors.empty()) {
      out_.warnings.emplace_back(
          "the colours are of type ushort, 0 to 65535, but none is above 255: all is drawn black; if they are meant as "
          "0 to 255, save them as uchar");
    }
    return core::ok_status();
  }

  /// The number of a channel at full brightness: integers are 0 to 255, but ushort 0 to 65535; floating-point numbers
  /// 0 to 1.
  static double full_channel(PlyType type) {
    if (type == PlyType::kF32 || type == PlyType::kF64) return 1.0;
    return type == PlyType::kU16 ? 65535.0 : 255.0;
  }

  Status bad_color(double value, double full) const {
    return core::invalid_input(in_.place_kind() + " " + std::to_string(in_.place()) + ": a colour of " +
                               number_text(value) + "; numbers of this type are from 0 to " + number_text(full) +
                               " in colours: save them as uchar, 0 to 255");
  }

  Status read_faces(const PlyElement& element) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const PlyProperty& property : element.properties) {
        const bool corners =
            property.list_count && (property.name == "vertex_indices" || property.name == "vertex_index");
        if (corners) {
          PRESCENE_RETURN_IF_ERROR(read_corners(property));
        } else if (property.list_count) {
          PRESCENE_RETURN_IF_ERROR(skip_list(property));
        } else if (!in_.skip(property.type, 1)) {
          return in_.error();
        }
      }
    }
    return core::ok_status();
  }

  Status read_corners(const PlyProperty& property) {
    std::uint64_t count = 0;
    PRESCENE_RETURN_IF_ERROR(read_length(property, &count));
    corners_.clear();
    PRESCENE_RETURN_IF_ERROR(check_triangle_count(count, options_));
    for (std::uint64_t i = 0; i < count; ++i) {
      double index = 0.0;
      if (!in_.number(property.type, &index)) return in_.error();
      if (!(index >= 0.0 && index < static_cast<double>(vertex_count_)) || index != std::floor(index)) {
        return core::invalid_input(in_.place_kind() + " " + std::to_string(in_.place()) + ": a face names vertex " +
                                   number_text(index) + " of " + std::to_string(vertex_count_) + " (counted from 0)");
      }
      corners_.push_back(static_cast<std::uint32_t>(index));
    }
    if (corners_.size() < 3) ++small_faces_;
    append_fan(corners_, &out_.mesh);
    return check_triangle_count(out_.mesh.triangles.size(), options_);
  }

  Status read_length(const PlyProperty& property, std::uint64_t* count) {
    double length = 0.0;
    if (!in_.number(*property.list_count, &length)) return in_.error();
    if (!(length >= 0.0 && length <= 4294967295.0) || length != std::floor(length)) {
      return core::invalid_input(in_.place_kind() + " " + std::to_string(in_.place()) + ": a list has the length " +
                                 number_text(length));
    }
    *count = static_cast<std::uint64_t>(length);
    return core::ok_status();
  }

  Status skip_list(const PlyProperty& property) {
    std::uint64_t count = 0;
    PRESCENE_RETURN_IF_ERROR(read_length(property, &count));
    return in_.skip(property.type, count) ? core::ok_status() : in_.error();
  }

  Status skip_element(const PlyElement& element) {
    if (element.properties.empty()) return core::ok_status();
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const PlyProperty& property : element.properties) {
        if (property.list_count) {
          PRESCENE_RETURN_IF_ERROR(skip_list(property));
        } else if (!in_.skip(property.type, 1)) {
          return in_.error();
        }
      }
    }
    return core::ok_status();
  }

  const PlyHeader& header_;
  const MeshReadOptions& options_;
  Source in_;
  RawMesh out_;
  std::uint64_t vertex_count_ = 0;
  std::vector<std::uint32_t> corners_;
  std::size_t small_faces_ = 0;
  bool has_strips_ = false;
  bool is_dark_ = true;  ///< All colours are ushort and at most 255.
};

}  // namespace

Result<RawMesh> parse_ply(std::span<const std::uint8_t> bytes, const MeshReadOptions& options) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  PRESCENE_TRY(const PlyHeader header, parse_ply_header(text));
  if (header.encoding == PlyEncoding::kText) return Body<TextSource>(header, options, TextSource(text, header)).read();
  return Body<BinarySource>(header, options, BinarySource(bytes, header)).read();
}

}  // namespace prescene::interfaces
