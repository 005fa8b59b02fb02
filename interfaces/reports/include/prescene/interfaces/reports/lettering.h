// SPDX-License-Identifier: Apache-2.0
// Lines and letters on pictures, smooth at their edges. Letters are those of DejaVu Sans, drawn by FreeType; the font
// is part of the program.
//
//   draw_line({{{10, 10}, {200, 40}}}, 3.0, {200, 60, 20}, 1.0, picture);
//   draw_text("in_bin 62 %", {20, 60}, 14.0, {30, 30, 30}, picture);
#pragma once

#include <Eigen/Core>
#include <span>
#include <string_view>
#include <vector>

#include "prescene/geometry/image.h"

namespace prescene::interfaces {

/// `share` of `color` over the pixel, 0 to 1.
void mix(geometry::Rgb& pixel, const geometry::Rgb& color, double share);
/// A line through points (pixels; x right, y down; pixel centres at integers) with round joints and ends, `width`
/// pixels wide. What lies outside of the picture is left out; points that are not finite break the line.
void draw_line(std::span<const Eigen::Vector2d> points, double width, const geometry::Rgb& color, double opacity,
               geometry::ColorImage& picture);
/// Dashes and gaps of `dash` pixels.
void draw_dashed_line(std::span<const Eigen::Vector2d> points, double dash, double width, const geometry::Rgb& color,
                      double opacity, geometry::ColorImage& picture);
/// Pixels x0 <= x < x1, y0 <= y < y1, cut to the picture.
void fill_rectangle(int x0, int y0, int x1, int y1, const geometry::Rgb& color, double opacity,
                    geometry::ColorImage& picture);

enum class TextAlign { kLeft, kCenter, kRight };
/// Width of a text in pixels whose capitals are `height` pixels high: the sum of those of its characters.
double text_width(std::string_view text, double height);
/// `at` is the left end of the text's base line (its middle, its right end); y is rounded to a whole pixel. UTF-8;
/// bytes that are none, and characters that the font does not have, are drawn as a box or a question mark.
void draw_text(std::string_view text, const Eigen::Vector2d& at, double height, const geometry::Rgb& color,
               geometry::ColorImage& picture, TextAlign align = TextAlign::kLeft);
/// The same on a light halo, readable on any picture.
void draw_label(std::string_view text, const Eigen::Vector2d& at, double height, const geometry::Rgb& color,
                geometry::ColorImage& picture, TextAlign align = TextAlign::kLeft);

}  // namespace prescene::interfaces
