// SPDX-License-Identifier: Apache-2.0
// Mesh files by hand, format by format: sound ones and ones that are hard to read. hostile_meshes.h gives them by kind.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/check.h"

namespace prescene::tests {

/// Files of each kind.
inline constexpr std::size_t kLeastCrafted = 80;

inline std::string repeated(std::string_view text, std::size_t times) {
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

inline std::string replaced(std::string text, std::string_view what, std::string_view by) {
  const std::size_t at = text.find(what);
  PRESCENE_CHECK_MSG(at != std::string::npos, "the sound file has that");
  return text.replace(at, what.size(), by);
}

struct Piece {
  std::size_t begin;
  std::size_t length;
};
/// The numbers of a text.
std::vector<Piece> numbers_in(std::string_view text);

/// What stands in place of a number.
inline constexpr const char* kOddNumbers[] = {"-1",
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

/// Other numbers in each place of a text, spread over places and numbers, so many that there are enough files.
void add_odd_numbers(const std::string& text, std::vector<std::string>* files);
/// 32-bit words of `places` places from `begin` on, each replaced by others.
void add_odd_words(const std::string& bytes, std::size_t begin, std::size_t places, std::vector<std::string>* files);

std::vector<std::string> sound_obj();
std::vector<std::string> crafted_obj();
std::vector<std::string> sound_ply(bool text);
std::vector<std::string> crafted_ply(bool text);
std::vector<std::string> sound_stl(bool text);
std::vector<std::string> crafted_stl(bool text);

nlohmann::ordered_json sound_gltf();
std::string glb_of(nlohmann::ordered_json document, std::string buffer);
std::string sound_buffer();
std::vector<std::string> crafted_gltf();
std::vector<std::string> crafted_glb();
std::string sound_collada();
/// The same as polygons instead of triangles.
std::string collada_polygons();
std::vector<std::string> crafted_collada();

}  // namespace prescene::tests
