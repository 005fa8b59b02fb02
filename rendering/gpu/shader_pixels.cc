// SPDX-License-Identifier: Apache-2.0
#include "pose_shader.h"

#include <bit>

#include "prescene/rendering/sensor/pixel_classes.h"

namespace prescene::rendering {
namespace {

constexpr const char* kPixels = R"(
struct Pixel {
  vec2 ray;  // z = 1
  float depth, inverse_depth, measured, slope, cosine;
  vec3 normal;
};

// Whether the pixel is in view, before the end of the range.
bool in_range(uint bits, out float depth) {
  depth = 0.0;
  if (bits == 0u) return false;
  depth = divided(1.0, uintBitsToFloat(bits));
  return depth < max_depth;
}
// Whether no known surface hides it.
bool seen(float depth, int x, int y) {
  float known = layer(3, x, y);
  return !(known > 0.0 && known < depth);
}
Pixel pixel_of(float depth, uint bits, uint face, int x, int y) {
  Pixel p;
  precise float ray_x = (float(x) - cx) * inverse_fx;
  precise float ray_y = (float(y) - cy) * inverse_fy;
  Plane plane = plane_of(face);
  precise float slope = plane.distance * uintBitsToFloat(bits);
  precise float cosine = -slope * layer(5, x, y);
  p.ray = vec2(ray_x, ray_y);
  p.depth = depth;
  p.measured = layer(0, x, y);
  p.slope = slope;
  p.inverse_depth = uintBitsToFloat(bits);
  p.cosine = max(cosine, LEAST_COSINE);
  p.normal = plane.normal;
  return p;
}

// Lanes are those of blocks of 16 pixels, of which the last of a row ends within the image.
int column_of(int block, int lane) { return min(block, width - 16) + lane; }
bool in_block(int block, int x) { return x >= block && x <= rect.z; }

#ifdef EVIDENCE
const uint kOccluded = 0x80000000u;

// What a covered pixel says: the bits of its ratio, and kOccluded.
uint ratio_of(Pixel p, int x, int y, bool outline, inout int measured, inout int visible, inout int hits) {
  uint m = h.material;
  int incidence = 0;
  for (int i = 0; i < 3; ++i) incidence += p.cosine > materials[m].bounds[i] ? 1 : 0;
  PixelClass c = materials[m].classes[2 * incidence + (outline ? 1 : 0)];
  float absent_missing = layer(2, x, y);
  if (p.measured == 0.0)
    return floatBitsToUint(absent_missing < 0.0 ? c.missing_ratio : divided(c.missing, absent_missing));
  precise float tilt = p.cosine * precision_per_cosine;
  precise float precision_here = precision_scale * p.inverse_depth * p.inverse_depth * clamp(tilt, least_precision, 1.0);
  precise float deviation = (p.measured - p.depth) * precision_here;
  precise float density = materials[m].outlier_density;
  if (abs(deviation) < HIT_SIGMAS) {
    precise float power = NORMAL_EXPONENT * deviation * deviation;
    precise float hit = materials[m].hit * precision_here * exp2_of(power);
    precise float colored = h.color < 0 ? hit : hit * layer(h.color, x, y);
    density = density + colored;
  }
  precise float before = p.depth - min_depth;
  if (deviation < 0.0) density = density + divided(materials[m].occluder, before);
  precise float share = c.returned * layer(4, x, y);
  float returned = absent_missing < 0.0 ? c.returned_ratio : share;
  precise float ratio = returned * (density * layer(1, x, y) + materials[m].behind);
  ratio = max(ratio, MIN_RATIO);
  ++measured;
  if (deviation < -MATCH_SIGMAS) return floatBitsToUint(ratio) | kOccluded;
  ++visible;
  if (deviation <= MATCH_SIGMAS) ++hits;
  return floatBitsToUint(ratio);
}

bool empty_at(int at) { return tile_depth[at] == 0u; }

// Replaces the faces of the tile's rows y0 to y1 by what their pixels say.
void weigh_pixels(int y0, int y1, int pitch) {
  int columns = rect.z - rect.x + 1;
  int pixels = columns * (y1 - y0 + 1);
  int in_view = 0, covered = 0, measured = 0, visible = 0, hits = 0;
  for (int i = lid; i < pixels; i += THREADS) {
    int x = rect.x + i % columns;
    int y = y0 + i / columns;
    int at = (y - y0 + 1) * pitch + (x - rect.x + 1);
    uint says = 0u;
    float depth;
    if (in_range(tile_depth[at], depth)) {
      ++in_view;
      if (seen(depth, x, y)) {
        ++covered;
        bool outline = (x > 0 && empty_at(at - 1)) || (x + 1 < width && empty_at(at + 1)) ||
                       (y > 0 && empty_at(at - pitch)) || (y + 1 < height && empty_at(at + pitch));
        Pixel p = pixel_of(depth, tile_depth[at], tile_face[at], x, y);
        says = ratio_of(p, x, y, outline, measured, visible, hits);
      }
    }
    tile_face[at] = says;
  }
  atomicAdd(counts[0], in_view);
  atomicAdd(counts[1], covered);
  atomicAdd(counts[2], measured);
  atomicAdd(counts[3], visible);
  atomicAdd(counts[4], hits);
}

// The product of the ratios of one kind (0 visible, 1 occluded, 2 missing) in one lane, as mantissa and exponent.
void multiply_lane(int kind, int lane, int y0, int y1, int pitch, inout float mantissa, inout int exponent) {
  for (int y = y0; y <= y1; ++y) {
    for (int block = rect.x; block <= rect.z; block += 16) {
      int x = column_of(block, lane);
      if (!in_block(block, x)) continue;
      uint says = tile_face[(y - y0 + 1) * pitch + (x - rect.x + 1)];
      if (says == 0u) continue;
      int its_kind = layer(0, x, y) == 0.0 ? 2 : int(says >> 31);
      if (its_kind != kind) continue;
      exponent += int((says >> 23) & 255u) - 127;
      precise float product = mantissa * uintBitsToFloat((says & 0x007fffffu) | 0x3f800000u);
      bool over = product >= 2.0;
      exponent += over ? 1 : 0;
      mantissa = over ? 0.5 * product : product;
    }
  }
}
#endif

)";

constexpr const char* kEquationOfPixel = R"(
void add_equations(Pixel p, inout float sums[29]) {
  precise float residual = p.slope * (p.measured - p.depth);
  precise float scaled = two_over_gate * residual;
  precise float under = 1.0 + scaled * scaled;
  float root = divided(1.0, under);
  precise float robust = root * root;
  precise float precision_here = precision_scale * p.inverse_depth * p.inverse_depth;
  precise float weight = robust * precision_here * precision_here;
  vec3 n = p.normal;
  precise float to_x = p.ray.x * p.depth - h.translation[0];
  precise float to_y = p.ray.y * p.depth - h.translation[1];
  precise float to_z = p.depth - h.translation[2];
)";

/// The sums of equations, written out: loops over them would cost turns, and their order is that of H row by row.
std::string equation_sums() {
  const char* row[6] = {
      "to_y * n.z - to_z * n.y", "to_z * n.x - to_x * n.z", "to_x * n.y - to_y * n.x", "n.x", "n.y", "n.z"};
  std::string text;
  for (int i = 0; i < 6; ++i) {
    const std::string number = std::to_string(i);
    text += "  precise float row" + number + " = " + row[i] + ";\n";
    text += "  precise float weighted" + number + " = weight * row" + number + ";\n";
  }
  const auto add = [&](int k, const std::string& term) {
    const std::string number = std::to_string(k);
    text += "  precise float sum" + number + " = sums[" + number + "] + " + term + ";\n  sums[" + number + "] = sum" +
            number + ";\n";
  };
  int k = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) add(k++, "weighted" + std::to_string(i) + " * row" + std::to_string(j));
  for (int i = 0; i < 6; ++i) add(k++, "weighted" + std::to_string(i) + " * residual");
  add(k++, "robust");
  add(k++, "robust * residual * residual");
  return text + "}\n";
}

/// `what` for each of the sums, with @ for its number.
std::string each_sum(const std::string& what) {
  std::string text;
  for (int k = 0; k < kEquationSums; ++k) {
    for (const char letter : what) text += letter == '@' ? std::to_string(k) : std::string(1, letter);
    text += '\n';
  }
  return text;
}

constexpr const char* kEquationRows = R"(
// Adds the tile's rows y0 to y1. Four rows of one lane are summed by one thread, eight times four rows at a time; then
// each sum by one thread over lanes and rows, in their order.
void sum_equations(int y0, int y1, int pitch, inout double total) {
  int lane = lid & 15;
  int used = 0;
  for (int rows = y0 / 4; 4 * rows <= y1; rows += THREADS / 16) {
    int mine = 4 * (rows + (lid >> 4));
    float sums[29];
    @clear
    for (int y = max(y0, mine); y <= min(y1, mine + 3); ++y) {
      for (int block = rect.x; block <= rect.z; block += 16) {
        int x = column_of(block, lane);
        if (!in_block(block, x)) continue;
        int at = (y - y0 + 1) * pitch + (x - rect.x + 1);
        float depth;
        if (!in_range(tile_depth[at], depth) || !seen(depth, x, y)) continue;
        Pixel p = pixel_of(depth, tile_depth[at], tile_face[at], x, y);
        if (p.measured == 0.0 || p.cosine < min_cosine) continue;
        ++used;
        add_equations(p, sums);
      }
    }
    @store
    barrier();
    if (lid < 29) {
      for (int i = 0; i < THREADS; i += 16) {
        precise double sum = 0.0;
        for (int k = 0; k < 16; ++k) {
          precise double next = sum + double(partial[lid * THREADS + i + k]);
          sum = next;
        }
        precise double joined = total + sum;
        total = joined;
      }
    }
    barrier();
  }
  atomicAdd(counts[5], used);
}
)";

std::string equation_rows() {
  std::string text = kEquationRows;
  const auto put = [&](const std::string& mark, const std::string& lines) {
    text.replace(text.find(mark), mark.size(), lines);
  };
  put("@clear", each_sum("sums[@] = 0.0;"));
  put("@store", each_sum("partial[@ * THREADS + lid] = sums[@];"));
  return text;
}

/// By its bits: how exactly compilers read decimals is their affair.
std::string constant(const std::string& name, float value) {
  return "#define " + name + " uintBitsToFloat(" + std::to_string(std::bit_cast<std::uint32_t>(value)) + "u)\n";
}

}  // namespace

std::string shader_pixels(const PoseWork& work) {
  std::string text = constant("HIT_SIGMAS", kHitSigmas) + constant("MATCH_SIGMAS", kMatchSigmas) +
                     constant("MIN_RATIO", kMinRatio) + constant("NORMAL_EXPONENT", kNormalExponent) +
                     constant("LEAST_COSINE", 1e-6f) + kPixels;
  if (work.equations) text += kEquationOfPixel + equation_sums() + equation_rows();
  return text;
}

}  // namespace prescene::rendering
