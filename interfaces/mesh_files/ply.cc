// SPDX-License-Identifier: Apache-2.0
// PLY [Turk 1994]: a text header that declares elements with properties, then their values as text or binary.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "prescene/interfaces/bytes/byte_reader.h"
#include "prescene/interfaces/bytes/text.h"
#include "raw_mesh.h"
#include "text_scanner.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

// Headers in use have some dozens; each element and property is kept.
constexpr std::size_t kMaxHeaderLines = 10'000;
// Rounding that a floating-point colour may have beyond its range of 0 to 1.
constexpr double kColorExcess = 0.01;

enum class Type { kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64 };

struct TypeName {
  std::string_view name;
  Type type;
};
constexpr std::array<TypeName, 16> kTypeNames = {{{"char", Type::kI8},
                                                  {"int8", Type::kI8},
                                                  {"uchar", Type::kU8},
                                                  {"uint8", Type::kU8},
                                                  {"short", Type::kI16},
                                                  {"int16", Type::kI16},
                                                  {"ushort", Type::kU16},
                                                  {"uint16", Type::kU16},
                                                  {"int", Type::kI32},
                                                  {"int32", Type::kI32},
                                                  {"uint", Type::kU32},
                                                  {"uint32", Type::kU32},
                                                  {"float", Type::kF32},
                                                  {"float32", Type::kF32},
                                                  {"double", Type::kF64},
                                                  {"float64", Type::kF64}}};

std::size_t size_of(Type type) {
  static constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

std::optional<Type> find_type(std::string_view name) {
  for (const TypeName& entry : kTypeNames) {
    if (entry.name == name) return entry.type;
  }
  return std::nullopt;
}

struct Property {
  std::string name;
  Type type = Type::kF32;
  std::optional<Type> list_count;  ///< Set for lists.
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { kText, kLittleEndian, kBigEndian };

struct Header {
  std::optional<Encoding> encoding;
  std::vector<Element> elements;
  std::size_t body_line = 1;
  std::size_t body_byte = 0;
};

Status parse_property(TextScanner words, std::vector<Element>* elements) {
  if (elements->empty()) return core::invalid_input("a property stands before the first element");
  Property property;
  std::string_view type_name = words.word();
  if (type_name == "list") {
    const std::string_view count_name = words.word();
    property.list_count = find_type(count_name);
    const bool integer =
        property.list_count && *property.list_count != Type::kF32 && *property.list_count != Type::kF64;
    if (!integer)
      return core::invalid_input(quote(count_name) + " is no type for the length of a list; use uchar or int");
    type_name = words.word();
  }
  const std::optional<Type> type = find_type(type_name);
  if (!type) return core::invalid_input(quote(type_name) + " is no type; use float, double, int, uchar and so on");
  property.type = *type;
  property.name = words.word();
  if (property.name.empty()) return core::invalid_input("the property has no name");
  elements->back().properties.push_back(std::move(property));
  return core::ok_status();
}

Status parse_header_line(std::string_view line, Header* header, bool* done) {
  TextScanner words(line);
  const std::string_view keyword = words.word();
  if (keyword.empty() || keyword == "comment" || keyword == "obj_info") return core::ok_status();
  if (keyword == "end_header") {
    *done = true;
    return core::ok_status();
  }
  if (keyword == "format") {
    const std::string_view name = words.word();
    if (name == "ascii") {
      header->encoding = Encoding::kText;
    } else if (name == "binary_little_endian") {
      header->encoding = Encoding::kLittleEndian;
    } else if (name == "binary_big_endian") {
      header->encoding = Encoding::kBigEndian;
    } else {
      return core::unsupported("the format " + quote(name) +
                               " is unknown; use ascii, binary_little_endian or binary_big_endian");
    }
    return core::ok_status();
  }
  if (keyword == "element") {
    Element element;
    element.name = words.word();
    long long count = 0;
    if (!parse_integer(words.word(), &count) || count < 0) {
      return core::invalid_input("the element " + quote(element.name) + " has no count");
    }
    element.count = static_cast<std::uint64_t>(count);
    const auto is_same = [&element](const Element& other) { return other.name == element.name; };
    const bool is_read = element.name == "vertex" || element.name == "face";
    if (is_read && std::any_of(header->elements.begin(), header->elements.end(), is_same)) {
      return core::unsupported("a second element " + quote(element.name) +
                               "; only one is read: merge the parts into one mesh and save it again");
    }
    header->elements.push_back(std::move(element));
    return core::ok_status();
  }
  if (keyword == "property") return parse_property(words, &header->elements);
  return core::invalid_input(quote(keyword) + " is no keyword of a PLY header");
}

Result<Header> parse_header(std::string_view text) {
  TextScanner lines(text);
  std::string_view line;
  if (!lines.next_line(&line) || trimmed(line) != "ply") {
    return core::invalid_input("does not begin with a line \"ply\"; give a PLY file");
  }
  Header header;
  for (bool done = false; !done;) {
    const std::size_t number = lines.line();
    if (number > kMaxHeaderLines) {
      return core::resource_exhausted("line " + std::to_string(number) + ": the header has more than " +
                                      std::to_string(kMaxHeaderLines) + " lines; leave out comments and properties");
    }
    if (!lines.next_line(&line)) return core::data_loss("line " + std::to_string(number) + ": ends before end_header");
    const Status status = parse_header_line(line, &header, &done);
    if (!status.ok()) return status.at("line " + std::to_string(number));
  }
  if (!header.encoding)
    return core::invalid_input("line 2: there is no line with the format; write \"format ascii 1.0\"");
  header.body_line = lines.line();
  header.body_byte = text.size() - lines.rest().size();
  return header;
}

/// Values one after another, as text.
class TextSource {
 public:
  TextSource(std::string_view text, const Header& header) : words_(text.substr(header.body_byte), header.body_line) {}

  bool number(Type /*type*/, double* value) {
    const std::string_view word = words_.word();
    bad_word_ = word;
    return parse_number(word, value);
  }
  bool skip(Type type, std::uint64_t count) {
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
  static std::uint64_t cost(Type /*type*/) { return 1; }

 private:
  TextScanner words_;
  std::string_view bad_word_;
};

/// Values one after another, binary.
class BinarySource {
 public:
  BinarySource(std::span<const std::uint8_t> bytes, const Header& header)
      : start_(header.body_byte),
        in_(bytes.subspan(header.body_byte),
            header.encoding == Encoding::kBigEndian ? std::endian::big : std::endian::little) {}

  bool number(Type type, double* value) {
    switch (type) {
      case Type::kI8:
        *value = in_.read<std::int8_t>();
        break;
      case Type::kU8:
        *value = in_.read<std::uint8_t>();
        break;
      case Type::kI16:
        *value = in_.read<std::int16_t>();
        break;
      case Type::kU16:
        *value = in_.read<std::uint16_t>();
        break;
      case Type::kI32:
        *value = in_.read<std::int32_t>();
        break;
      case Type::kU32:
        *value = in_.read<std::uint32_t>();
        break;
      case Type::kF32:
        *value = static_cast<double>(in_.read<float>());
        break;
      case Type::kF64:
        *value = in_.read<double>();
        break;
    }
    return in_.ok();
  }
  bool skip(Type type, std::uint64_t count) {
    if (count > in_.remaining() / size_of(type)) return false;
    in_.take(count * size_of(type));
    return true;
  }
  Status error() const {
    return core::data_loss("byte " + std::to_string(place()) +
                           ": the file ends before all that its header names; copy it again");
  }
  std::string place_kind() const { return "byte"; }
  std::size_t place() const { return start_ + in_.position(); }
  std::uint64_t max_values() const { return in_.remaining(); }
  static std::uint64_t cost(Type type) { return size_of(type); }

 private:
  std::size_t start_;
  ByteReader in_;
};

template <class Source>
class Body {
 public:
  Body(const Header& header, const MeshReadOptions& options, Source source)
      : header_(header), options_(options), in_(std::move(source)) {}

  Result<RawMesh> read() {
    for (const Element& element : header_.elements) {
      if (element.name == "vertex") vertex_count_ = element.count;
    }
    for (const Element& element : header_.elements) {
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
    return std::move(out_);
  }

 private:
  /// So that nothing is reserved or looped over which the file can't hold.
  Status check_count(const Element& element) const {
    std::uint64_t cost = 0;
    for (const Property& property : element.properties)
      cost += Source::cost(property.list_count.value_or(property.type));
    if (cost > 0 && element.count > in_.max_values() / cost) {
      return core::data_loss(in_.place_kind() + " " + std::to_string(in_.place()) + ": the header names " +
                             std::to_string(element.count) + " of " + quote(element.name) +
                             ", more than the rest of the file can hold; copy it again");
    }
    if (element.name == "vertex" || element.name == "face") return check_triangle_count(element.count, options_);
    return core::ok_status();
  }

  Status read_vertices(const Element& element) {
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
        const Property& property = element.properties[p];
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
        const Type type = element.properties[*where[3 + c]].type;
        const double value = values[*where[3 + c]], full = full_channel(type);
        const double excess = full == 1.0 ? kColorExcess : 0.0;
        if (!(value >= -excess && value <= full + excess)) return bad_color(value, full);
        is_dark_ &= type == Type::kU16 && value <= 255.0;
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
  static double full_channel(Type type) {
    if (type == Type::kF32 || type == Type::kF64) return 1.0;
    return type == Type::kU16 ? 65535.0 : 255.0;
  }

  Status bad_color(double value, double full) const {
    return core::invalid_input(in_.place_kind() + " " + std::to_string(in_.place()) + ": a colour of " +
                               number_text(value) + "; numbers of this type are from 0 to " + number_text(full) +
                               " in colours: save them as uchar, 0 to 255");
  }

  Status read_faces(const Element& element) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const Property& property : element.properties) {
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

  Status read_corners(const Property& property) {
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

  Status read_length(const Property& property, std::uint64_t* count) {
    double length = 0.0;
    if (!in_.number(*property.list_count, &length)) return in_.error();
    if (!(length >= 0.0 && length <= 4294967295.0) || length != std::floor(length)) {
      return core::invalid_input(in_.place_kind() + " " + std::to_string(in_.place()) + ": a list has the length " +
                                 number_text(length));
    }
    *count = static_cast<std::uint64_t>(length);
    return core::ok_status();
  }

  Status skip_list(const Property& property) {
    std::uint64_t count = 0;
    PRESCENE_RETURN_IF_ERROR(read_length(property, &count));
    return in_.skip(property.type, count) ? core::ok_status() : in_.error();
  }

  Status skip_element(const Element& element) {
    if (element.properties.empty()) return core::ok_status();
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (const Property& property : element.properties) {
        if (property.list_count) {
          PRESCENE_RETURN_IF_ERROR(skip_list(property));
        } else if (!in_.skip(property.type, 1)) {
          return in_.error();
        }
      }
    }
    return core::ok_status();
  }

  const Header& header_;
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
  PRESCENE_TRY(const Header header, parse_header(text));
  if (header.encoding == Encoding::kText) return Body<TextSource>(header, options, TextSource(text, header)).read();
  return Body<BinarySource>(header, options, BinarySource(bytes, header)).read();
}

}  // namespace prescene::interfaces
