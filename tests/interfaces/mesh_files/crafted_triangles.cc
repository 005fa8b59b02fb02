// SPDX-License-Identifier: Apache-2.0
// OBJ, PLY and STL: lists of numbers.
#include <algorithm>
#include <cctype>
#include <iterator>

#include "crafted_meshes.h"
#include "prescene/geometry/primitives.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"

namespace prescene::tests {

using interfaces::MeshEncoding;

std::vector<Piece> numbers_in(std::string_view text) {
  std::vector<Piece> found;
  constexpr std::string_view kBegin = "-0123456789", kInside = "-+.0123456789eE";
  for (std::size_t i = 0; i < text.size();) {
    const bool in_a_word = i > 0 && std::isalnum(static_cast<unsigned char>(text[i - 1])) != 0;
    if (in_a_word || kBegin.find(text[i]) == std::string_view::npos) {
      ++i;
      continue;
    }
    const std::size_t end = std::min(text.find_first_not_of(kInside, i), text.size());
    found.push_back({i, end - i});
    i = end;
  }
  return found;
}

void add_odd_numbers(const std::string& text, std::vector<std::string>* files) {
  const std::vector<Piece> places = numbers_in(text);
  PRESCENE_CHECK(!places.empty());
  constexpr std::size_t kNumbers = std::size(kOddNumbers);
  const std::size_t all = places.size() * kNumbers;
  const std::size_t wanted = std::max(kLeastCrafted - std::min(kLeastCrafted, files->size()), std::size_t{20});
  for (std::size_t i = 0; i < wanted; ++i) {
    const std::size_t place = i % places.size();
    const std::size_t number = (i / places.size() + 3 * place) % kNumbers;
    if (i >= all) break;
    std::string file = text;
    files->push_back(file.replace(places[place].begin, places[place].length, kOddNumbers[number]));
  }
}

void add_odd_words(const std::string& bytes, std::size_t begin, std::size_t places, std::vector<std::string>* files) {
  const std::uint32_t words[] = {0,          1,          0x7fffffff, 0x80000000, 0xffffffff, 0xfffffffe,
                                 0x00010000, 0x7f800000, 0x7fc00000, 0xff7fffff, 1000000};
  for (std::size_t i = 0; files->size() < kLeastCrafted; ++i) {
    const std::size_t place = begin + 4 * (i % places);
    PRESCENE_CHECK(place + 4 <= bytes.size() && i / places < std::size(words));
    std::string file = bytes;
    files->push_back(file.replace(place, 4, bytes_of(words[(i / places + 3 * i) % std::size(words)])));
  }
}

// ------------------------------------------------------------------------------------------------- OBJ

std::vector<std::string> sound_obj() {
  return {interfaces::encode_obj(geometry::make_mesh(geometry::BoxShape{{0.1, 0.2, 0.3}})),
          "# x\nmtllib a.mtl\no a\nv 0 0 0 1 0 0\nv 1 0 0 1\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nusemtl b\n"
          "f 1/1/1 2//2 -2 \\\n 4\nl 1 2\n"};
}

std::vector<std::string> crafted_obj() {
  const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  std::vector<std::string> files = {
      square + "f" + repeated(" 1 2 3", 1'500'000) + "\n",
      square + "f 1 2 3 " + repeated("\\\n1 ", 3'000'000),
      square + repeated("f 1 2 3\n", 1'000'000),
      repeated("v 0 0 0\n", 4'100'000),
      square + "f 1 2 4000000000\n",
      square + "f 1 2 3999999\n",
      square + "f -1 -2 -5\n",
      square + "f -9223372036854775808 1 2\n",
      square + "mtllib pipe\nmtllib folder\nmtllib /dev/zero\nf 1 2 3\n",
      square + "call pipe\nshadow_obj pipe\nf 1 2 3\n",
      std::string(1'000'000, '\0'),
      std::string(10'000'000, 'f'),
      std::string(10'000'000, ' '),
      repeated("\n", 5'000'000),
      repeated("\\\n", 5'000'000),
      repeated("#\\\n", 1'000'000),
      "\xff\xfev\0 \0",
      square + "f 1/1/1/1/1/1 2/////// 3\n",
      square + "f 1 2 3",
      square + "f\n",
      square + "f 1 1 1\nf 1 2 1\n",
      "v\n",
      "v 1 2\n",
      "v 1 2 3 4 5 6 7 8\n",
      "v nan nan nan\nv inf inf inf\nv 1 2 3\nf 1 2 3\n",
      "v 1e308 1e308 1e308\nv -1e308 0 0\nv 0 -1e308 1\nf 1 2 3\n",
      "f 1 2 3\n",
      square + "p 1\nl 1 2 3\ncurv 0 1 1 2 3\nsurf 0 1 0 1 1 2 3\n",
  };
  add_odd_numbers(sound_obj()[1], &files);
  return files;
}

// ------------------------------------------------------------------------------------------------- PLY

std::vector<std::string> sound_ply(bool text) {
  const geometry::TriangleMesh box = geometry::make_mesh(geometry::BoxShape{{0.1, 0.2, 0.3}});
  const std::vector<geometry::Rgb> colors(box.vertices.size(), {1, 2, 3});
  if (text) {
    return {interfaces::encode_ply(box, MeshEncoding::kText, colors),
            "ply\nformat ascii 1.0\ncomment x\nelement a 1\nproperty list uchar float l\nelement vertex 4\n"
            "property double x\nproperty float y\nproperty short z\nelement face 1\nproperty uchar f\n"
            "property list int uint vertex_index\nend_header\n2 1 2\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n9 4 0 1 2 3\n"};
  }
  return {interfaces::encode_ply(box, MeshEncoding::kBinary, colors), interfaces::encode_ply(box),
          std::string("ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty char x\nproperty char y\n"
                      "property char z\nelement face 1\nproperty list uchar uchar vertex_indices\nend_header\n") +
              std::string("\0\0\0\1\0\0\0\1\0\3\0\1\2", 13)};
}

std::vector<std::string> crafted_ply(bool text) {
  const std::string begin = std::string("ply\nformat ") + (text ? "ascii" : "binary_little_endian") + " 1.0\n";
  const std::string vertices = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string three =
      text ? "0 0 0\n1 0 0\n0 1 0\n"
           : std::string(12, '\0') + bytes_of(1.0F) + std::string(12, '\0') + bytes_of(1.0F) + std::string(4, '\0');
  const auto number = [&](std::int32_t value) { return text ? std::to_string(value) + " " : bytes_of(value); };
  const std::string one_face =
      (text ? std::string("3 ") : std::string(1, '\3')) + number(0) + number(1) + number(2) + (text ? "\n" : "");
  std::vector<std::string> files = {
      begin + repeated("element a 0\n", 2'000'000) + "end_header\n",
      begin + "element a 1\n" + repeated("property char p\n", 2'000'000) + "end_header\n" + std::string(1000, ' '),
      begin + repeated("comment\n", 2'000'000) + vertices + faces + "end_header\n" + three + one_face,
      begin + std::string(10'000'000, 'x'),
      begin + vertices + faces,
      begin + vertices + faces + "end_header",
      begin + vertices + faces + "end_header\n",
      begin + vertices + faces + "end_header\n" + three,
      begin + vertices + faces + "end_header\n" + three + one_face,
      begin + faces + vertices + "end_header\n" + one_face + three,
      begin + vertices + vertices + faces + "end_header\n" + three + three + one_face,
      begin + vertices + faces + faces + "end_header\n" + three + one_face + one_face,
      begin + "element vertex 3\nproperty list uchar float x\nproperty float y\nproperty float z\n" + faces +
          "end_header\n" + three + one_face,
      begin + vertices + "element face 1\nproperty list float int vertex_indices\nend_header\n" + three + one_face,
      begin + vertices + "element face 1\nproperty list double double vertex_indices\nend_header\n" + three + one_face,
      begin + vertices + "element face 1\nproperty list uint uchar vertex_indices\nend_header\n" + three + number(-1) +
          std::string(1'000'000, text ? ' ' : '\0'),
      begin + vertices + "element face 1\nproperty list uint uchar vertex_indices\nend_header\n" + three +
          number(3'900'000) + (text ? repeated("0 ", 3'900'000) : std::string(3'900'000, '\0')),
      begin + vertices + "element face 4000000\nproperty list uchar uchar vertex_indices\nend_header\n" + three +
          (text ? repeated("0 ", 4'000'000) : std::string(4'000'000, '\0')),
      begin + vertices + "element face 30000\nproperty list uchar uchar vertex_indices\nend_header\n" + three +
          repeated(text ? "255 " + repeated("0 1 2 ", 85) : "\xff" + repeated(std::string("\0\1\2", 3), 85), 30'000),
      begin + vertices + "element face 4000000\nend_header\n" + three,
      begin + "element vertex 4000000\nproperty char x\nproperty char y\nproperty char z\n" + faces + "end_header\n" +
          (text ? repeated("0 1 2 ", 4'000'000) : std::string(12'000'000, '\0')) + one_face,
      begin + "element a 1000000000000000000\n" + vertices + faces + "end_header\n" + three + one_face,
      begin + "element a 9223372036854775807\nproperty list uchar uchar l\n" + vertices + faces + "end_header\n" +
          three + one_face,
      begin + "element a 3000000\nproperty list uchar double l\n" + vertices + faces + "end_header\n" +
          (text ? repeated("0 ", 3'000'000) : std::string(3'000'000, '\0')) + three + one_face,
      begin + vertices + "element tristrips 1\nproperty list int int vertex_indices\nend_header\n" + three + number(3) +
          number(0) + number(1) + number(2),
      begin + "format ascii 1.0\nformat binary_big_endian 1.0\n" + vertices + faces + "end_header\n" + three + one_face,
      "ply\n" + vertices + faces + "end_header\n" + three + one_face,
      "ply\nformat binary_middle_endian 1.0\n" + vertices + faces + "end_header\n" + three + one_face,
      "ply\r\nformat ascii 1.0\r\nelement vertex 0\r\nend_header\r\n",
      begin + "property float x\n" + vertices + faces + "end_header\n",
      begin + "obj_info pipe\ncomment TextureFile pipe\n" + vertices + faces + "end_header\n" + three + one_face,
      begin + "element vertex 3\nproperty float x\nproperty float x\nproperty float y\nproperty float z\n" + faces +
          "end_header\n" + three + three + one_face,
  };
  const std::string header = begin + vertices + faces + "end_header\n";
  std::vector<std::string> headers;
  add_odd_numbers(header, &headers);
  for (std::size_t i = 0; i < 20; ++i) files.push_back(headers[i] + three + one_face);
  if (text)
    add_odd_numbers(sound_ply(true)[1], &files);
  else
    add_odd_words(header + three + one_face, header.size(), 12, &files);
  return files;
}

// ------------------------------------------------------------------------------------------------- STL

std::vector<std::string> sound_stl(bool text) {
  const geometry::TriangleMesh box = geometry::make_mesh(geometry::BoxShape{{0.1, 0.2, 0.3}});
  const geometry::TriangleMesh ball = geometry::make_mesh(geometry::Sphere{0.1}, 8);
  const MeshEncoding encoding = text ? MeshEncoding::kText : MeshEncoding::kBinary;
  return {interfaces::encode_stl(box, encoding), interfaces::encode_stl(ball, encoding)};
}

std::vector<std::string> crafted_stl(bool text) {
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  if (text) {
    std::vector<std::string> files = {
        "solid",
        "solid\n",
        "solid a\nendsolid a\n",
        "solid a\n" + facet,
        "solid a\n" + facet + "endsolid a\nsolid b\n" + facet + "endsolid b\n",
        "solid a\n" + facet + "endsolid a\n" + std::string(5'000'000, ' '),
        "solid " + std::string(5'000'000, 'a') + "\n" + facet + "endsolid\n",
        "solid a\n" + repeated(facet, 100'000) + "endsolid a\n",
        repeated("solid a\nendsolid\n", 500'000),
        "solid a\n" + repeated("facet ", 1'000'000),
        "solid a\nfacet normal 0 0 1\nouter loop\n" + repeated("vertex 0 0 0\n", 1'000'000),
        "SOLID A\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 0 0\nVERTEX 0 1 "
        "0\nENDLOOP\nENDFACET\nENDSOLID",
        "solid a\n" + std::string(1'000'000, '\0'),
        "solid a\nfacet normal nan nan nan outer loop vertex nan nan nan vertex inf inf inf vertex 1 2 3 endloop "
        "endfacet endsolid",
        "solid a\nfacet normal 0 0 1 outer loop vertex 1e308 0 0 vertex -1e308 0 0 vertex 0 1e308 0 endloop endfacet "
        "endsolid",
        std::string(84, 's'),
    };
    add_odd_numbers("solid a\n" + facet + facet + "endsolid a\n", &files);
    return files;
  }
  const std::string header = "solid" + std::string(75, '\0');
  const std::string triangle =
      std::string(24, '\0') + bytes_of(1.0F) + std::string(12, '\0') + bytes_of(1.0F) + std::string(6, '\0');
  std::vector<std::string> files = {
      std::string(83, '\0'),
      header,
      header + bytes_of(0U),
      header + bytes_of(0xffffffffU),
      header + bytes_of(1U) + triangle.substr(0, 49),
      header + bytes_of(1U) + triangle,
      header + bytes_of(1U) + triangle + std::string(5'000'000, '\0'),
      header + bytes_of(2U) + triangle,
      header + bytes_of(100'000U) + repeated(triangle, 100'000),
      header + bytes_of(4'000'001U) + std::string(std::size_t{50} * 4'000'001, '\0'),
      header + bytes_of(1'000'000U) + std::string(std::size_t{50} * 1'000'000, '\xff'),
      "solid\nfacet" + std::string(69, '\0') + bytes_of(1U) + triangle,
      std::string(10'000'000, '\xff'),
  };
  const std::string two = header + bytes_of(2U) + triangle + triangle;
  add_odd_words(two, 80, 25, &files);
  return files;
}

}  // namespace prescene::tests
