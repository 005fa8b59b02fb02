// SPDX-License-Identifier: Apache-2.0
#include "hostile_meshes.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "prescene/core/check.h"
#include "prescene/geometry/primitives.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"

namespace prescene::tests {
namespace {

using interfaces::MeshEncoding;
using nlohmann::ordered_json;

constexpr std::size_t kLeastCrafted = 80;

std::string repeated(std::string_view text, std::size_t times) {
  std::string out;
  out.reserve(text.size() * times);
  for (std::size_t i = 0; i < times; ++i) out += text;
  return out;
}

template <class T>
std::string bytes_of(T value) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}

std::string replaced(std::string text, std::string_view what, std::string_view by) {
  const std::size_t at = text.find(what);
  PRESCENE_CHECK_MSG(at != std::string::npos, "the sound file has that");
  return text.replace(at, what.size(), by);
}

struct Piece {
  std::size_t begin;
  std::size_t length;
};

// The numbers of a text.
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

constexpr const char* kOddNumbers[] = {"-1",
                                       "4294967295",
                                       "1e308",
                                       "2147483648",
                                       "",
                                       "nan",
                                       "18446744073709551615",
                                       "0",
                                       "4000000000",
                                       "-9223372036854775808",
                                       "0.5",
                                       "inf",
                                       "99999999999999999999999999",
                                       "x",
                                       "1e-320",
                                       "[]",
                                       "-1e308",
                                       "1e999",
                                       "0x10",
                                       "1 1 1 1 1 1 1 1"};

// Other numbers in each place of a text, spread over places and numbers, so many that there are enough files.
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

// 32-bit words of `count` places from `begin` on, each replaced by others.
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

// ------------------------------------------------------------------------------------------------- glTF, GLB

ordered_json sound_gltf() {
  // One triangle (0,0,0), (1,0,0), (0,1,0), then its indices 0, 1, 2 in 16 bits.
  return ordered_json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
 "nodes":[{"mesh":0,"translation":[0,0,5],"children":[1]},{"mesh":0,"rotation":[0,0,0,1],"scale":[1,1,-1]}],
 "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"mode":4}]}],
 "accessors":[{"bufferView":0,"byteOffset":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
              {"bufferView":1,"byteOffset":0,"componentType":5123,"count":3,"type":"SCALAR"}],
 "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36,"byteStride":12},{"buffer":0,"byteOffset":36,"byteLength":6}],
 "buffers":[{"byteLength":44,
             "uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA="}]})");
}

std::string sound_buffer() {
  return std::string(12, '\0') + bytes_of(1.0F) + std::string(12, '\0') + bytes_of(1.0F) + std::string(4, '\0') +
         std::string("\0\0\1\0\2\0\0\0", 8);
}

std::string glb_of(ordered_json document, std::string buffer) {
  if (document.is_object() && document.contains("buffers") && document["buffers"].is_array() &&
      !document["buffers"].empty() && document["buffers"][0].is_object() && document["buffers"][0].contains("uri") &&
      document["buffers"][0]["uri"].get<std::string>().starts_with("data:"))
    document["buffers"][0].erase("uri");
  std::string json = document.dump();
  json.resize((json.size() + 3) / 4 * 4, ' ');
  buffer.resize((buffer.size() + 3) / 4 * 4, '\0');
  return "glTF" + bytes_of(2U) + bytes_of(static_cast<std::uint32_t>(28 + json.size() + buffer.size())) +
         bytes_of(static_cast<std::uint32_t>(json.size())) + "JSON" + json +
         bytes_of(static_cast<std::uint32_t>(buffer.size())) + std::string("BIN\0", 4) + buffer;
}

std::vector<ordered_json> crafted_documents() {
  std::vector<ordered_json> documents;
  const auto add = [&](const std::function<void(ordered_json&)>& change) {
    ordered_json document = sound_gltf();
    change(document);
    documents.push_back(std::move(document));
  };
  add([](ordered_json& d) { d["nodes"][0]["children"] = {0}; });
  add([](ordered_json& d) { d["nodes"][1]["children"] = {0}; });
  add([](ordered_json& d) {  // Nested 50,000 deep.
    d["nodes"] = ordered_json::array();
    for (int i = 1; i <= 50'000; ++i) d["nodes"].push_back({{"children", {i}}});
    d["nodes"].push_back({{"mesh", 0}});
  });
  add([](ordered_json& d) {  // 2^40 nodes by way of 41.
    d["nodes"] = ordered_json::array();
    for (int i = 1; i <= 40; ++i) d["nodes"].push_back({{"children", {i, i}}});
    d["nodes"].push_back({{"mesh", 0}});
  });
  add([](ordered_json& d) { d["scenes"][0]["nodes"] = std::vector<int>(1'000'000, 1); });
  for (const char* uri : {"pipe", "folder", "../pipe", "none.bin", "/dev/zero", "/dev/stdin", "/proc/self/mem",
                          "file:///etc/passwd", "", ".", "http://localhost/x", "data:application/octet-stream;base64,",
                          "data:,", "data:application/octet-stream;base64,@@@@", "%00", "../../../../../../etc/passwd"})
    add([&](ordered_json& d) { d["buffers"][0]["uri"] = uri; });
  add([](ordered_json& d) { d["images"] = {{{"uri", "pipe"}}, {{"bufferView", 7}, {"mimeType", "image/png"}}}; });
  for (const char* type : {"SCALAR", "MAT4", "VEC9", ""})
    add([&](ordered_json& d) { d["accessors"][0]["type"] = type; });
  for (const int mode : {0, 1, 2, 3, 5, 6, 7, -1}) {
    add([&](ordered_json& d) { d["meshes"][0]["primitives"][0]["mode"] = mode; });
  }
  add([](ordered_json& d) { d["accessors"][0].erase("bufferView"); });
  add([](ordered_json& d) {
    d["accessors"][0]["sparse"] = {{"count", 4'000'000'000},
                                   {"indices", {{"bufferView", 1}, {"componentType", 5125}}},
                                   {"values", {{"bufferView", 0}}}};
  });
  add([](ordered_json& d) { d["extensionsRequired"] = {"KHR_draco_mesh_compression"}; });
  add([](ordered_json& d) { d["asset"]["version"] = "1.0"; });
  add([](ordered_json& d) { d["skins"] = {{{"joints", {0, 1, 7}}, {"inverseBindMatrices", 0}}}; });
  add([](ordered_json& d) {
    d["animations"] = {{{"channels", {{{"sampler", 9}}}}, {"samplers", ordered_json::array()}}};
  });
  add([](ordered_json& d) { d["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 9}}}; });
  // Every number in turn, and what is no number.
  const std::vector<ordered_json> odd = {-1,  4'000'000'000, 1, 0x7fffffff,           1e308,
                                         "x", nullptr,       0, ordered_json::array()};
  std::vector<ordered_json::json_pointer> places;
  const ordered_json flat = sound_gltf().flatten();
  for (const auto& [place, value] : flat.items()) {
    if (value.is_number()) places.emplace_back(place);
  }
  for (std::size_t i = 0; documents.size() < kLeastCrafted + 10; ++i) {
    add([&](ordered_json& d) { d[places[i % places.size()]] = odd[(i / places.size() + i) % odd.size()]; });
  }
  return documents;
}

std::vector<std::string> crafted_gltf() {
  std::vector<std::string> files;
  for (const ordered_json& document : crafted_documents()) files.push_back(document.dump());
  const std::string sound = sound_gltf().dump();
  files.push_back("");
  files.push_back("{");
  files.push_back("[]");
  files.push_back("null");
  files.push_back(repeated("[", 2'000'000));
  files.push_back(R"({"extras":)" + repeated("[", 2'000'000) + repeated("]", 2'000'000) + "," + sound.substr(1));
  files.push_back(R"({"extras":)" + repeated("{\"a\":", 500'000) + "1" + repeated("}", 500'000) + "," +
                  sound.substr(1));
  files.push_back(sound.substr(0, sound.size() / 2));
  files.push_back(sound + sound);
  files.push_back("\xef\xbb\xbf" + sound);
  files.push_back(glb_of(sound_gltf(), sound_buffer()));
  return files;
}

std::vector<std::string> crafted_glb() {
  std::vector<std::string> files;
  for (const ordered_json& document : crafted_documents()) files.push_back(glb_of(document, sound_buffer()));
  const std::string sound = glb_of(sound_gltf(), sound_buffer());
  files.push_back(sound.substr(0, 12));
  files.push_back(sound.substr(0, sound.size() - 1));
  files.push_back(sound.substr(0, 40));
  files.push_back(sound + std::string(1'000'000, '\0'));
  files.push_back(glb_of(sound_gltf(), ""));
  files.push_back(sound_gltf().dump());
  for (const std::size_t place : {4, 8, 12, 16}) {
    for (const std::uint32_t word : {0U, 1U, 0x7fffffffU, 0xffffffffU, 0xfffffff0U}) {
      std::string file = sound;
      files.push_back(file.replace(place, 4, bytes_of(word)));
    }
  }
  return files;
}

// ------------------------------------------------------------------------------------------------- COLLADA

std::string sound_collada() {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="9">10 20 30 40 20 30 10 50 30</float_array>
<technique_common><accessor source="#a" count="3" stride="3" offset="0"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/>
</vertices><triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
</library_geometries><library_nodes><node id="n"><instance_geometry url="#g"/></node></library_nodes>
<library_visual_scenes><visual_scene id="s"><node><translate>0 0 1</translate>
<instance_geometry url="#g"/></node><node><instance_node url="#n"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

std::string collada_polygons() {
  return replaced(
      sound_collada(),
      R"(<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>)",
      R"(<polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><vcount>3</vcount><p>0 1 2</p></polylist>)");
}

std::vector<std::string> crafted_collada() {
  const std::string sound = sound_collada();
  const std::string polygons = collada_polygons();
  const std::string inside = R"(<instance_geometry url="#g"/></node></library_nodes>)";
  std::string graph = R"(<node id="n"><instance_geometry url="#g"/></node>)";
  for (int i = 0; i < 30; ++i) {
    const std::string next = i == 0 ? "n" : "n" + std::to_string(i);
    const std::string instance = "<instance_node url=\"#" + next + "\"/>";
    graph += "<node id=\"n" + std::to_string(i + 1) + "\">" + instance + instance + "</node>";
  }
  std::vector<std::string> files = {
      "",
      "<COLLADA>",
      "<?xml version=\"1.0\"?>",
      repeated("<a>", 1'000'000),
      sound.substr(0, sound.size() / 2),
      replaced(sound, inside, R"(<instance_node url="#n"/></node></library_nodes>)"),
      replaced(sound, inside, R"(<node id="m"><instance_node url="#n"/></node></node></library_nodes>)"),
      replaced(replaced(sound, R"(<node id="n"><instance_geometry url="#g"/></node>)", graph),
               R"(<instance_node url="#n"/></node></visual_scene>)",
               R"(<instance_node url="#n30"/></node></visual_scene>)"),
      replaced(sound, "<node><translate>",
               repeated("<node>", 50'000) + repeated("</node>", 50'000) + "<node><translate>"),
      replaced(sound, "<library_nodes>",
               repeated("<extra>", 100'000) + repeated("</extra>", 100'000) + "<library_nodes>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p>" + repeated("0 1 2 ", 500'000) + "</p>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p>0 1 4000000000</p>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p>-1 -2 -3</p>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p></p>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p>0 1 2 0 1</p>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p>0 1 3</p>"),
      replaced(polygons, "<vcount>3</vcount>", "<vcount>4000000000</vcount>"),
      replaced(polygons, "<vcount>3</vcount>", "<vcount>-3</vcount>"),
      replaced(polygons, "<vcount>3</vcount>", "<vcount>0 0 0 3</vcount>"),
      replaced(polygons, "<vcount>3</vcount>", "<vcount></vcount>"),
      replaced(polygons, R"(<polylist count="1">)", R"(<polylist count="4000000000">)"),
      replaced(sound, R"(stride="3")", R"(stride="4000000000")"),
      replaced(sound, R"(stride="3")", R"(stride="0")"),
      replaced(sound, R"(stride="3")", R"(stride="-3")"),
      replaced(sound, R"(stride="3" offset="0")", R"(stride="3" offset="4000000000")"),
      replaced(sound, R"(count="3" stride)", R"(count="4000000000" stride)"),
      replaced(sound, R"(count="9")", R"(count="4000000000")"),
      replaced(sound, R"(offset="0"/><p>)", R"(offset="4000000000"/><p>)"),
      replaced(sound, R"(offset="0"/><p>)", R"(offset="1000000"/><p>)"),
      replaced(sound, "#g", "#none"),
      replaced(sound, "#a", "#none"),
      replaced(sound, "#p", "#p2"),
      replaced(sound, "#v\"", "#g\""),
      replaced(sound, "#s", "file:///dev/zero#s"),
      replaced(sound, "#g", "pipe#g"),
      replaced(sound, "<?xml version=\"1.0\"?>",
               "<?xml version=\"1.0\"?><!DOCTYPE a [<!ENTITY b SYSTEM \"pipe\"><!ENTITY c \"&b;&b;\">]>"),
      replaced(sound, "Z_UP", "&c;"),
      replaced(
          sound, "<library_geometries>",
          R"(<library_images><image id="i"><init_from>pipe</init_from></image></library_images><library_geometries>)"),
      replaced(sound, "<translate>0 0 1</translate>", "<matrix>1 2 3</matrix>"),
      replaced(sound, "<translate>0 0 1</translate>", "<matrix>" + repeated("nan ", 16) + "</matrix>"),
      replaced(sound, R"(<float_array id="a" count="9">)", R"(<float_array id="a" count="9">x)"),
      replaced(sound, "10 20 30 40 20 30 10 50 30", "10 20 30"),
      replaced(sound, "10 20 30 40 20 30 10 50 30", repeated("1 ", 1'000'000)),
      sound + sound,
      std::string(1'000'000, '\0'),
      "\xff\xfe" + sound,
  };
  add_odd_numbers(polygons, &files);
  return files;
}

// ------------------------------------------------------------------------------------------------- mutations

std::string odd_bytes(core::RandomStream* stream) {
  switch (stream->uniform_below(5)) {
    case 0:
      return kOddNumbers[stream->uniform_below(std::size(kOddNumbers))];
    case 1:
      return bytes_of(static_cast<std::uint32_t>(stream->uniform_below(4)) - 2U);
    case 2:
      return bytes_of(std::uint32_t{1} << stream->uniform_below(32));
    case 3:
      return bytes_of(stream->uniform_below(2) == 0 ? std::numeric_limits<float>::infinity() : 1e38F);
    default: {
      const auto byte = static_cast<char>(stream->uniform_below(256));
      return std::string(1 + stream->uniform_below(16), byte);
    }
  }
}

void change(const std::vector<std::string>& sound, core::RandomStream* stream, std::string* file) {
  if (file->empty()) return;
  const std::size_t at = stream->uniform_below(file->size());
  const std::size_t length = std::min<std::size_t>(file->size() - at, 1 + stream->uniform_below(32));
  switch (stream->uniform_below(9)) {
    case 0:
      (*file)[at] = static_cast<char>((*file)[at] ^ (1 << stream->uniform_below(8)));
      break;
    case 1:
      (*file)[at] = static_cast<char>(stream->uniform_below(256));
      break;
    case 2: {
      const std::vector<Piece> numbers = numbers_in(*file);
      if (numbers.empty()) break;
      const Piece& number = numbers[stream->uniform_below(numbers.size())];
      file->replace(number.begin, number.length, kOddNumbers[stream->uniform_below(std::size(kOddNumbers))]);
      break;
    }
    case 3:
      file->erase(at, length);
      break;
    case 4:
      file->insert(at, file->substr(at, length));
      break;
    case 5:
      file->insert(stream->uniform_below(file->size()), file->substr(at, length));
      break;
    case 6:
      file->insert(at, odd_bytes(stream));
      break;
    case 7: {
      const std::string bytes = odd_bytes(stream);
      file->replace(at, std::min(bytes.size(), file->size() - at), bytes);
      break;
    }
    default: {
      const std::string& other = sound[stream->uniform_below(sound.size())];
      if (stream->uniform_below(4) == 0)
        file->resize(at);
      else
        file->replace(at, length, other.substr(stream->uniform_below(other.size()), length));
    }
  }
}

}  // namespace

const char* name_of(MeshKind kind) {
  constexpr const char* kNames[] = {"obj",        "ply_text", "ply_binary", "stl_text",
                                    "stl_binary", "gltf",     "glb",        "collada"};
  return kNames[static_cast<std::size_t>(kind)];
}

const char* extension_of(MeshKind kind) {
  constexpr const char* kExtensions[] = {".obj", ".ply", ".ply", ".stl", ".stl", ".gltf", ".glb", ".dae"};
  return kExtensions[static_cast<std::size_t>(kind)];
}

std::vector<std::string> sound_files(MeshKind kind) {
  switch (kind) {
    case MeshKind::kObj:
      return sound_obj();
    case MeshKind::kPlyText:
    case MeshKind::kPlyBinary:
      return sound_ply(kind == MeshKind::kPlyText);
    case MeshKind::kStlText:
    case MeshKind::kStlBinary:
      return sound_stl(kind == MeshKind::kStlText);
    case MeshKind::kGltf:
      return {sound_gltf().dump(), sound_gltf().dump(1)};
    case MeshKind::kGlb:
      return {glb_of(sound_gltf(), sound_buffer())};
    case MeshKind::kCollada:
      return {sound_collada(), collada_polygons()};
  }
  PRESCENE_CHECK_MSG(false, "no such kind");
}

std::string mutated_file(const std::vector<std::string>& sound, core::RandomStream* stream) {
  std::string file = sound[stream->uniform_below(sound.size())];
  for (std::uint64_t left = 1 + stream->uniform_below(8); left > 0; --left) change(sound, stream, &file);
  return file;
}

std::vector<std::string> crafted_files(MeshKind kind) {
  std::vector<std::string> files;
  switch (kind) {
    case MeshKind::kObj:
      files = crafted_obj();
      break;
    case MeshKind::kPlyText:
    case MeshKind::kPlyBinary:
      files = crafted_ply(kind == MeshKind::kPlyText);
      break;
    case MeshKind::kStlText:
    case MeshKind::kStlBinary:
      files = crafted_stl(kind == MeshKind::kStlText);
      break;
    case MeshKind::kGltf:
      files = crafted_gltf();
      break;
    case MeshKind::kGlb:
      files = crafted_glb();
      break;
    case MeshKind::kCollada:
      files = crafted_collada();
      break;
  }
  PRESCENE_CHECK(files.size() >= kLeastCrafted);
  return files;
}

std::string largest_file(MeshKind kind, std::size_t triangles, bool slivers) {
  core::RandomStream stream(3, core::Purpose::kTest);
  const auto count = static_cast<std::uint32_t>(triangles);
  const std::uint32_t vertices = slivers ? count + 2 : count / 2;
  const auto vertex = [&](std::uint32_t v) {
    // Slivers: corners along a line, now and then one beside it.
    if (slivers) return bytes_of(static_cast<float>(v)) + bytes_of(v % 1000 == 0 ? 1.0F : 0.0F) + bytes_of(0.0F);
    core::RandomStream place(v, core::Purpose::kTest);
    std::string bytes;
    for (int i = 0; i < 3; ++i) bytes += bytes_of(static_cast<float>(place.uniform()));
    return bytes;
  };
  const auto corner = [&](std::uint32_t t, std::uint32_t k) {
    return slivers ? t + k : static_cast<std::uint32_t>(stream.uniform_below(vertices));
  };
  std::string file;
  if (kind == MeshKind::kPlyBinary) {
    file = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices) +
           "\nproperty float x\nproperty float y\nproperty float z\nelement face " + std::to_string(count) +
           "\nproperty list uchar uint vertex_indices\nend_header\n";
    for (std::uint32_t v = 0; v < vertices; ++v) file += vertex(v);
    for (std::uint32_t t = 0; t < count; ++t) {
      file += '\3';
      for (std::uint32_t k = 0; k < 3; ++k) file += bytes_of(corner(t, k));
    }
    return file;
  }
  PRESCENE_CHECK(kind == MeshKind::kStlBinary);
  file = std::string(80, '\0') + bytes_of(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    file.append(12, '\0');
    for (std::uint32_t k = 0; k < 3; ++k) file += vertex(corner(t, k));
    file.append(2, '\0');
  }
  return file;
}

}  // namespace prescene::tests
