// SPDX-License-Identifier: Apache-2.0
// STL, binary and text. The normals in the file are passed over: the order of the corners says which side is out.
#include <algorithm>
#include <array>

#include "prescene/interfaces/bytes/byte_reader.h"
#include "prescene/interfaces/bytes/text.h"
#include "raw_mesh.h"
#include "text_scanner.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kTriangleBytes = 50;

bool same_word(std::string_view word, std::string_view lower_case) {
  return std::equal(word.begin(), word.end(), lower_case.begin(), lower_case.end(),
                    [](char a, char b) { return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b; });
}

void append_corner(const geometry::Vector3d& vertex, const char* place_kind, std::size_t place, RawMesh* mesh) {
  const auto index = static_cast<std::uint32_t>(mesh->mesh.vertices.size());
  mesh->mesh.vertices.push_back(vertex);
  note_vertex(vertex, place_kind, place, index, mesh);
  if (index % 3 == 2) mesh->mesh.triangles.push_back({index - 2, index - 1, index});
}

Result<RawMesh> parse_binary(std::span<const std::uint8_t> bytes, const MeshReadOptions& options) {
  ByteReader in(bytes);
  in.take(kHeaderBytes);
  const auto count = in.read<std::uint32_t>();
  if (!in.ok())
    return core::data_loss("byte " + std::to_string(bytes.size()) + ": ends within the header; copy it again");
  if (count > in.remaining() / kTriangleBytes) {
    return core::data_loss("byte 80: says it has " + std::to_string(count) + " triangles, but holds " +
                           std::to_string(in.remaining() / kTriangleBytes) + "; the file is cut or no STL");
  }
  PRESCENE_RETURN_IF_ERROR(check_triangle_count(count, options));
  RawMesh out;
  out.mesh.vertices.reserve(std::size_t{3} * count);
  out.mesh.triangles.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    in.take(3 * sizeof(float));
    for (int corner = 0; corner < 3; ++corner) {
      const std::size_t place = in.position();
      const auto x = in.read<float>();
      const auto y = in.read<float>();
      const auto z = in.read<float>();
      append_corner(Eigen::Vector3f(x, y, z).cast<double>(), "byte", place, &out);
    }
    in.take(2);
  }
  if (in.remaining() > 0)
    out.warnings.push_back(size_text(in.remaining()) + " after the last triangle were passed over");
  return out;
}

class TextParser {
 public:
  TextParser(std::string_view text, const MeshReadOptions& options) : words_(text), options_(options) {}

  Result<RawMesh> parse() {
    std::string_view line;
    words_.next_line(&line);  // "solid" and a name of any words.
    for (;;) {
      const std::string_view word = words_.word();
      if (word.empty()) return core::data_loss(place() + "the file ends before endsolid; copy it again");
      if (same_word(word, "facet")) {
        PRESCENE_RETURN_IF_ERROR(parse_facet());
        PRESCENE_RETURN_IF_ERROR(check_triangle_count(out_.mesh.triangles.size(), options_));
      } else if (same_word(word, "endsolid")) {
        words_.next_line(&line);
        if (!next_solid()) return std::move(out_);
      } else {
        return core::invalid_input(place() + quote(word) + " instead of facet or endsolid");
      }
    }
  }

 private:
  std::string place() const { return "line " + std::to_string(words_.line()) + ": "; }

  /// Passes over what follows a solid; true at the beginning of another.
  bool next_solid() {
    std::string_view line;
    while (words_.next_line(&line)) {
      if (same_word(TextScanner(line).word(), "solid")) return true;
    }
    return false;
  }

  Status expect(std::string_view expected) {
    const std::string_view word = words_.word();
    if (same_word(word, expected)) return core::ok_status();
    if (word.empty()) return core::data_loss(place() + "the file ends within a facet; copy it again");
    return core::invalid_input(place() + quote(word) + " instead of " + std::string(expected));
  }

  Status read_vector(geometry::Vector3d* out) {
    for (double& value : *out) {
      const std::string_view word = words_.word();
      if (word.empty()) return core::data_loss(place() + "the file ends within a facet; copy it again");
      if (!parse_number(word, &value)) return core::invalid_input(place() + quote(word) + " is no number");
    }
    return core::ok_status();
  }

  Status parse_facet() {
    geometry::Vector3d ignored;
    PRESCENE_RETURN_IF_ERROR(expect("normal"));
    PRESCENE_RETURN_IF_ERROR(read_vector(&ignored));
    PRESCENE_RETURN_IF_ERROR(expect("outer"));
    PRESCENE_RETURN_IF_ERROR(expect("loop"));
    std::array<geometry::Vector3d, 3> corners;
    for (geometry::Vector3d& corner : corners) {
      PRESCENE_RETURN_IF_ERROR(expect("vertex"));
      PRESCENE_RETURN_IF_ERROR(read_vector(&corner));
    }
    PRESCENE_RETURN_IF_ERROR(expect("endloop"));
    PRESCENE_RETURN_IF_ERROR(expect("endfacet"));
    for (const geometry::Vector3d& corner : corners) append_corner(corner, "line", words_.line(), &out_);
    return core::ok_status();
  }

  TextScanner words_;
  const MeshReadOptions& options_;
  RawMesh out_;
};

/// Binary files may begin with "solid", too: what decides is whether the size is that of their count of triangles, and
/// else whether a facet follows.
bool is_text(std::span<const std::uint8_t> bytes) {
  if (bytes.size() >= kHeaderBytes + 4) {
    ByteReader in(bytes);
    in.take(kHeaderBytes);
    if (in.read<std::uint32_t>() * std::uint64_t{kTriangleBytes} == in.remaining()) return false;
  }
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  TextScanner words(text);
  if (!same_word(words.word(), "solid")) return false;
  std::string_view line;
  words.next_line(&line);
  const std::string_view next = words.word();
  return same_word(next, "facet") || same_word(next, "endsolid") || next.empty();
}

}  // namespace

Result<RawMesh> parse_stl(std::span<const std::uint8_t> bytes, const MeshReadOptions& options) {
  if (!is_text(bytes)) return parse_binary(bytes, options);
  return TextParser({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, options).parse();
}

}  // namespace prescene::interfaces
