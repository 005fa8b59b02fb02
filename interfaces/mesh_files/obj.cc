// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ: positions (with colours, if any) and faces; everything else is passed over.
#include <algorithm>
#include <array>
#include <cmath>

#include "prescene/interfaces/bytes/text.h"
#include "raw_mesh.h"
#include "text_scanner.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

class ObjParser {
 public:
  ObjParser(std::string_view text, const MeshReadOptions& options) : lines_(text), options_(options) {}

  Result<RawMesh> parse() {
    std::string joined;
    std::string_view line;
    for (;;) {
      const std::size_t number = lines_.line();
      if (!lines_.next_line(&line)) break;
      if (line.ends_with('\\')) {
        PRESCENE_RETURN_IF_ERROR(join_continued(line, &joined));
        line = joined;
      }
      const Status status = parse_line(line, number);
      if (!status.ok()) return status.at("line " + std::to_string(number));
    }
    if (largest_index_ > out_.mesh.vertices.size()) {
      return core::invalid_input("line " + std::to_string(largest_index_line_) + ": the face names vertex " +
                                 std::to_string(largest_index_) + ", but the file has " +
                                 std::to_string(out_.mesh.vertices.size()) + "; it is cut or a part of a larger one");
    }
    if (!any_colors_) out_.colors.clear();
    if (small_faces_ > 0) {
      out_.warnings.push_back(std::to_string(small_faces_) + " faces with fewer than three corners were left out");
    }
    return std::move(out_);
  }

 private:
  Status join_continued(std::string_view line, std::string* joined) {
    // A face of a million corners is shorter, and what is joined is a copy.
    constexpr std::size_t kLongest = std::size_t{16} << 20;
    const std::size_t number = lines_.line();
    joined->assign(line.substr(0, line.size() - 1));
    std::string_view next;
    while (lines_.next_line(&next)) {
      if (joined->size() + next.size() > kLongest) {
        return core::resource_exhausted("line " + std::to_string(number) + ": is continued over more than " +
                                        size_text(kLongest) + "; cut its polygon into triangles");
      }
      *joined += ' ';
      const bool goes_on = next.ends_with('\\');
      *joined += goes_on ? next.substr(0, next.size() - 1) : next;
      if (!goes_on) break;
    }
    return core::ok_status();
  }

  Status parse_line(std::string_view line, std::size_t number) {
    TextScanner words(line);
    const std::string_view keyword = words.word();
    if (keyword == "v") return parse_vertex(words, number);
    if (keyword == "f") return parse_face(words, number);
    if (keyword == "mtllib" || keyword == "usemtl") out_.unread_look = true;
    return core::ok_status();
  }

  /// x y z, optionally w, optionally r g b from 0 to 1.
  Status parse_vertex(TextScanner words, std::size_t number) {
    std::array<double, 7> values{};
    std::size_t count = 0;
    for (std::string_view word = words.word(); !word.empty() && !word.starts_with('#'); word = words.word()) {
      if (count == values.size()) return core::invalid_input("a vertex has at most seven numbers");
      if (!parse_number(word, &values[count])) return core::invalid_input(quote(word) + " is no number");
      ++count;
    }
    if (count < 3) return core::invalid_input("a vertex needs three numbers, here are " + std::to_string(count));
    out_.mesh.vertices.push_back({values[0], values[1], values[2]});
    note_vertex(out_.mesh.vertices.back(), "line", number, out_.mesh.vertices.size() - 1, &out_);
    geometry::Rgb color = {255, 255, 255};
    if (count >= 6) {
      any_colors_ = true;
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = values[count - 3 + c];
        color[c] = value > 0.0 ? static_cast<std::uint8_t>(std::lround(255.0 * std::min(value, 1.0))) : std::uint8_t{0};
      }
    }
    out_.colors.push_back(color);
    return check_triangle_count(out_.mesh.vertices.size(), options_);
  }

  /// Corners i, i/t, i//n or i/t/n; i counts from 1, or back from the last vertex when negative.
  Status parse_face(TextScanner words, std::size_t number) {
    corners_.clear();
    for (std::string_view word = words.word(); !word.empty() && !word.starts_with('#'); word = words.word()) {
      long long index = 0;
      if (!parse_integer(word.substr(0, word.find('/')), &index) || index == 0) {
        return core::invalid_input(quote(word) + " is no corner of a face; vertices count from 1");
      }
      const auto known = static_cast<long long>(out_.mesh.vertices.size());
      if (index < -known) {
        return core::invalid_input("vertex " + std::to_string(index) + " counted back from the last of " +
                                   std::to_string(known) + " is none");
      }
      if (index < 0) index += known + 1;
      if (index > static_cast<long long>(options_.max_triangles)) return check_triangle_count(SIZE_MAX, options_);
      if (static_cast<std::size_t>(index) > largest_index_) {
        largest_index_ = static_cast<std::size_t>(index);
        largest_index_line_ = number;
      }
      corners_.push_back(static_cast<std::uint32_t>(index - 1));
      if (corners_.size() > options_.max_triangles) return check_triangle_count(SIZE_MAX, options_);
    }
    if (corners_.size() < 3) ++small_faces_;
    append_fan(corners_, &out_.mesh);
    return check_triangle_count(out_.mesh.triangles.size(), options_);
  }

  TextScanner lines_;
  const MeshReadOptions& options_;
  RawMesh out_;
  std::vector<std::uint32_t> corners_;
  std::size_t largest_index_ = 0;
  std::size_t largest_index_line_ = 0;
  std::size_t small_faces_ = 0;
  bool any_colors_ = false;
};

}  // namespace

Result<RawMesh> parse_obj(std::string_view text, const MeshReadOptions& options) {
  return ObjParser(text, options).parse();
}

}  // namespace prescene::interfaces
