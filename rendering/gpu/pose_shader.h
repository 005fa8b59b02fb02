// SPDX-License-Identifier: Apache-2.0
// The programs that the device runs, as text: arithmetic that rounds as the processor's, and from a pose to its sums.
// The operations are those of rendering/simd, one by one, and so are the orders in which sums are rounded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace prescene::rendering {

inline constexpr int kThreads = 128;      ///< Of a work group, which scores one hypothesis.
inline constexpr int kLanes = 16;         ///< Sums are kept apart in as many as in rendering/simd.
inline constexpr int kEquationSums = 29;  ///< 21 of H, 6 of g, weights, squares.

/// What a program computes.
struct PoseWork {
  bool evidence = false;
  bool equations = false;
};

/// Pixels of the image, those at the sides included, that a work group keeps at a time.
int tile_pixels(const PoseWork& work);
/// The widest image of which a tile holds four rows, which are summed together, and one more on each side.
inline int widest_image(const PoseWork& work) { return tile_pixels(work) / 6 - 2; }
/// The narrowest of which blocks end within the image.
inline constexpr int kNarrowestImage = kLanes;

// As the programs read and write them; 4 bytes each.
struct DeviceHypothesis {
  float rotation[9];
  float translation[3];
  float from_camera_O[3];
  std::uint32_t vertices_at;  ///< In words of the meshes: x of all, y of all, z of all.
  std::uint32_t vertices;
  std::uint32_t faces_at;  ///< Corners a of all, b, c, normals x, y, z, offsets.
  std::uint32_t faces;
  std::uint32_t closed;
  std::uint32_t material;
  std::int32_t color;  ///< Layer of the frame, negative = none.
};
static_assert(sizeof(DeviceHypothesis) == 22 * 4);

struct DeviceClass {
  float missing, returned, returned_ratio, missing_ratio;
};
struct DeviceMaterial {
  float bounds[3];
  float hit, occluder, behind, outlier_density;
  DeviceClass classes[8];  ///< By incidence, inside and at the outline.
};
static_assert(sizeof(DeviceMaterial) == 39 * 4);

/// What goes before the layers of a frame: depth, inverse_absent, absent_missing, known, inverse_returns, inverse_ray,
/// and colours.
struct DeviceFrame {
  std::int32_t width, height;
  float fx, fy, cx, cy, inverse_fx, inverse_fy;
  float max_depth, min_depth, precision_scale, precision_per_cosine, least_precision;
  float two_over_gate, min_cosine;
  std::uint32_t scratch_stride;  ///< Words of scratch memory a hypothesis.
  std::int32_t most_turns;       ///< Of loops, for one thread.
};
static_assert(sizeof(DeviceFrame) == 17 * 4);
inline constexpr int kPlainLayers = 6;

/// Words of scratch memory that a mesh needs.
inline std::size_t scratch_words(std::size_t vertices, std::size_t faces) { return 2 * vertices + 2 * faces; }

struct DeviceResult {
  std::int32_t in_view, covered, measured, visible, hits, equation_pixels;
  std::int32_t exponents[3];  ///< Of the products of ratios: visible, occluded, missing.
  std::int32_t complete;      ///< 0: it would have taken more turns than allowed, and nothing else means anything.
  double products[3];
  double sums[kEquationSums];
};
static_assert(sizeof(DeviceResult) == (10 + 2 * (3 + kEquationSums)) * 4);

/// Buffers by the numbers at which the programs find them.
enum Binding : unsigned { kHypotheses, kMeshes, kFrame, kMaterials, kScratch, kResults };

/// The program that scores hypotheses. Divisions are computed from approximations that are `division_error` units in
/// the last place off, for tests.
std::string pose_program(const PoseWork& work, int division_error);

// Its parts: arithmetic, with the head of the program, and what pixels say.
std::string shader_arithmetic(int division_error);
std::string shader_pixels(const PoseWork& work);

// What the arithmetic is checked with: four numbers in, the bits of eight out.
inline constexpr int kProbeInputs = 4;
inline constexpr int kProbeOutputs = 7;
/// Reads kHypotheses as numbers, writes kResults as bits; see arithmetic_probe.cc.
std::string probe_program(int division_error);

}  // namespace prescene::rendering
