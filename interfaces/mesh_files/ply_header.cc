// SPDX-License-Identifier: Apache-2.0
#include "ply_header.h"

#include <algorithm>
#include <utility>

#include "prescene/interfaces/bytes/text.h"
#include "text_scanner.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

// Headers in use have some dozens; each element and property is kept.
constexpr std::size_t kMaxHeaderLines = 10'000;

struct TypeName {
  std::string_view name;
  PlyType type;
};
constexpr std::array<TypeName, 16> kTypeNames = {{{"char", PlyType::kI8},
                                                  {"int8", PlyType::kI8},
                                                  {"uchar", PlyType::kU8},
                                                  {"uint8", PlyType::kU8},
                                                  {"short", PlyType::kI16},
                                                  {"int16", PlyType::kI16},
                                                  {"ushort", PlyType::kU16},
                                                  {"uint16", PlyType::kU16},
                                                  {"int", PlyType::kI32},
                                                  {"int32", PlyType::kI32},
                                                  {"uint", PlyType::kU32},
                                                  {"uint32", PlyType::kU32},
                                                  {"float", PlyType::kF32},
                                                  {"float32", PlyType::kF32},
                                                  {"double", PlyType::kF64},
                                                  {"float64", PlyType::kF64}}};

std::optional<PlyType> find_type(std::string_view name) {
  for (const TypeName& entry : kTypeNames) {
    if (entry.name == name) return entry.type;
  }
  return std::nullopt;
}

Status parse_property(TextScanner words, std::vector<PlyElement>* elements) {
  if (elements->empty()) return core::invalid_input("a property stands before the first element");
  PlyProperty property;
  std::string_view type_name = words.word();
  if (type_name == "list") {
    const std::string_view count_name = words.word();
    property.list_count = find_type(count_name);
    const bool integer =
        property.list_count && *property.list_count != PlyType::kF32 && *property.list_count != PlyType::kF64;
    if (!integer)
      return core::invalid_input(quote(count_name) + " is no type for the length of a list; use uchar or int");
    type_name = words.word();
  }
  const std::optional<PlyType> type = find_type(type_name);
  if (!type) return core::invalid_input(quote(type_name) + " is no type; use float, double, int, uchar and so on");
  property.type = *type;
  property.name = words.word();
  if (property.name.empty()) return core::invalid_input("the property has no name");
  elements->back().properties.push_back(std::move(property));
  return core::ok_status();
}

Status parse_header_line(std::string_view line, PlyHeader* header, bool* done) {
  TextScanner words(line);
  const std::string_view keyword = words.word();
  if (keyword == "comment" && words.word() == "TextureFile") header->names_texture = true;
  if (keyword.empty() || keyword == "comment" || keyword == "obj_info") return core::ok_status();
  if (keyword == "end_header") {
    *done = true;
    return core::ok_status();
  }
  if (keyword == "format") {
    const std::string_view name = words.word();
    if (name == "ascii") {
      header->encoding = PlyEncoding::kText;
    } else if (name == "binary_little_endian") {
      header->encoding = PlyEncoding::kLittleEndian;
    } else if (name == "binary_big_endian") {
      header->encoding = PlyEncoding::kBigEndian;
    } else {
      return core::unsupported("the format " + quote(name) +
                               " is unknown; use ascii, binary_little_endian or binary_big_endian");
    }
    return core::ok_status();
  }
  if (keyword == "element") {
    PlyElement element;
    element.name = words.word();
    long long count = 0;
    if (!parse_integer(words.word(), &count) || count < 0) {
      return core::invalid_input("the element " + quote(element.name) + " has no count");
    }
    element.count = static_cast<std::uint64_t>(count);
    const auto is_same = [&element](const PlyElement& other) { return other.name == element.name; };
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

}  // namespace

Result<PlyHeader> parse_ply_header(std::string_view text) {
  TextScanner lines(text);
  std::string_view line;
  if (!lines.next_line(&line) || trimmed(line) != "ply") {
    return core::invalid_input("does not begin with a line \"ply\"; give a PLY file");
  }
  PlyHeader header;
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

}  // namespace prescene::interfaces
