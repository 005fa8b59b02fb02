// SPDX-License-Identifier: Apache-2.0
#include "pose_shader.h"

namespace prescene::rendering {
namespace {

constexpr const char* kBuffers = R"(
layout(local_size_x = THREADS) in;

struct Hypothesis {
  float rotation[9];
  float translation[3];
  float from_camera_O[3];
  uint vertices_at, vertices, faces_at, faces, closed, material;
  int color;
};
struct PixelClass { float missing, returned, returned_ratio, missing_ratio; };
struct Material {
  float bounds[3];
  float hit, occluder, behind, outlier_density;
  PixelClass classes[8];
};
struct Result {
  int in_view, covered, measured, visible, hits, equation_pixels;
  int exponents[3];
  int complete;
  uvec2 products[3];
  uvec2 sums[29];
};

layout(std430, binding = 0) readonly buffer Hypotheses { Hypothesis hypotheses[]; };
layout(std430, binding = 1) readonly buffer Meshes { uint meshes[]; };
layout(std430, binding = 2) readonly buffer Frame {
  int width, height;
  float fx, fy, cx, cy, inverse_fx, inverse_fy;
  float max_depth, min_depth, precision_scale, precision_per_cosine, least_precision;
  float two_over_gate, min_cosine;
  uint scratch_stride;
  int most_turns;
  float layers[];
};
layout(std430, binding = 3) readonly buffer Materials { Material materials[]; };
layout(std430, binding = 4) coherent buffer Scratch { uint scratch[]; };
layout(std430, binding = 5) writeonly buffer Results { Result results[]; };

// 1/z, as the bits of a positive number, which order as the number does, and the face, of the pixels of a tile with
// one more on each side; later what each pixel says.
shared uint tile_depth[TILE];
shared uint tile_face[TILE];
#ifdef EQUATIONS
shared float partial[29 * THREADS];
#endif
shared int low_x, low_y, high_x, high_y;
shared uint least_bits, most_bits, small_count, large_count;
shared int counts[6];
shared int large_turns, small_turns;

const int kLane = 6 * 256;    // 1/256 pixel: faces that are larger are drawn by all threads together
const int kExact = 60 * 256;  // the same of faces whose sides 32 bits hold

int lid;
Hypothesis h;
uint scratch_at, list_at;
ivec4 rect;  // x and y of the first and the last pixel that the object is within
float least, most;

float layer(int k, int x, int y) { return layers[(k * height + y) * width + x]; }
float mesh_value(uint at) { return uintBitsToFloat(meshes[at]); }

float rotated(int row, vec3 p) {
  precise float value = h.rotation[3 * row] * p.x + h.rotation[3 * row + 1] * p.y + h.rotation[3 * row + 2] * p.z;
  return value;
}

ivec2 corner(uint face, uint which) {
  uint vertex = meshes[h.faces_at + which * h.faces + face];
  uint at = scratch_at + 2u * vertex;
  return ivec2(int(scratch[at]), int(scratch[at + 1u]));
}

vec3 normal_O(uint face) {
  uint at = h.faces_at + 3u * h.faces + face;
  return vec3(mesh_value(at), mesh_value(at + h.faces), mesh_value(at + 2u * h.faces));
}

// n . p of the face's plane, > 0 when it is turned away.
float distance_of(uint face, vec3 n) {
  precise float d = n.x * h.from_camera_O[0] + n.y * h.from_camera_O[1] + n.z * h.from_camera_O[2] +
                    mesh_value(h.faces_at + 6u * h.faces + face);
  return d;
}

// n . p = distance < 0 in C.
struct Plane {
  vec3 normal;
  float distance;
};
Plane plane_of(uint face) {
  vec3 n = normal_O(face);
  float d = distance_of(face, n);
  vec3 turned = vec3(rotated(0, n), rotated(1, n), rotated(2, n));
  return Plane(d > 0.0 ? -turned : turned, -abs(d));
}
)";

constexpr const char* kRaster = R"(
void project_vertices() {
  ivec2 low = ivec2(2147483647), high = ivec2(-2147483647);
  uint fewest = 0x7f7fffffu, greatest = 0u;
  for (uint i = uint(lid); i < h.vertices; i += uint(THREADS)) {
    uint at = h.vertices_at + i;
    vec3 p = vec3(mesh_value(at), mesh_value(at + h.vertices), mesh_value(at + 2u * h.vertices));
    precise float x = rotated(0, p) + h.translation[0];
    precise float y = rotated(1, p) + h.translation[1];
    precise float z = rotated(2, p) + h.translation[2];
    float inverse_depth = divided(1.0, z);
    precise float u = fx * x * inverse_depth + cx;
    precise float v = fy * y * inverse_depth + cy;
    ivec2 place = ivec2(snapped(u), snapped(v));
    scratch[scratch_at + 2u * i] = uint(place.x);
    scratch[scratch_at + 2u * i + 1u] = uint(place.y);
    low = min(low, place);
    high = max(high, place);
    fewest = min(fewest, floatBitsToUint(inverse_depth));
    greatest = max(greatest, floatBitsToUint(inverse_depth));
  }
  atomicMin(low_x, low.x);
  atomicMin(low_y, low.y);
  atomicMax(high_x, high.x);
  atomicMax(high_y, high.y);
  atomicMin(least_bits, fewest);
  atomicMax(most_bits, greatest);
}

// The pixels of `area` whose centres lie within the bounding box.
ivec4 pixels_between(ivec2 low, ivec2 high, ivec4 area) {
  return ivec4(max(area.xy, (low + 255) >> 8), min(area.zw, high >> 8));
}

// Lists the faces that are turned to the camera and may cover a pixel: small ones from the front, large ones from the
// back, each with its rows.
void list_faces(int rows) {
  for (uint face = uint(lid); face < h.faces; face += uint(THREADS)) {
    float d = distance_of(face, normal_O(face));
    if (d == 0.0 || (h.closed != 0u && d > 0.0)) continue;
    ivec2 a = corner(face, 0u), b = corner(face, 1u), c = corner(face, 2u);
    ivec2 low = min(a, min(b, c)), high = max(a, max(b, c));
    ivec4 box = pixels_between(low, high, rect);
    if (box.x > box.z || box.y > box.w) continue;
    bool small = max(high.x - low.x, high.y - low.y) <= kLane;
    uint place = small ? atomicAdd(small_count, 1u) : h.faces - 1u - atomicAdd(large_count, 1u);
    ivec2 size = box.zw - box.xy + 1;
    if (small) {
      atomicMax(small_turns, 2 + size.y * (size.x + 2));
    } else {
      int in_tile = min(size.y, rows + 2) * 16 / THREADS + 2;
      atomicAdd(large_turns, (size.y / rows + 3) * (2 + in_tile * (size.x / 16 + 3)));
    }
    scratch[list_at + 2u * place] = face;
    scratch[list_at + 2u * place + 1u] = uint(box.y) | (uint(box.w) << 16);
  }
}

// How often the loops of a thread turn at most while tiles of so many rows are drawn and summed. Some drivers end
// loops after many turns, and what they then do is not defined: such hypotheses are left alone.
int turns_needed(int rows) {
  int columns = rect.z - rect.x + 1, lines = rect.w - rect.y + 1;
  int tiles = lines / rows + 2;
  int blocks = columns / 16 + 3;
  int rounds = int(small_count) / THREADS + 2;
  int turns = tiles * (TILE / THREADS + 4) + 2 * (large_turns + tiles * (int(large_count) + rounds * (small_turns + 1)));
#ifdef EVIDENCE
  turns += 4 * (columns * lines / THREADS + tiles) + (lines + tiles) * blocks + 64;
#endif
#ifdef EQUATIONS
  turns += tiles * (rows / 32 + 2) * (4 * blocks + 4 + 9 * THREADS / 8);
#endif
  return turns;
}

// A side of a face: the pixels on the right of the line from p to q, and on it where the side owns it.
struct Side {
  ivec2 from, to;
  int owned;
};
Side side_of(ivec2 p, ivec2 q) {
  ivec2 d = q - p;
  return Side(p, d, d.y < 0 || (d.y == 0 && d.x > 0) ? 1 : 0);
}
// Exact as long as the face is within kExact.
bool inside(Side s, int x, int y) {
  return s.to.x * (256 * y - s.from.y) - s.to.y * (256 * x - s.from.x) + s.owned > 0;
}
// Whether p q - r s > -owned, in 64 bits.
bool exceeds(int p, int q, int r, int s, int owned) {
  int high_a, high_b;
  int low_a, low_b;
  imulExtended(p, q, high_a, low_a);
  imulExtended(r, s, high_b, low_b);
  uint low = uint(low_a) - uint(low_b);
  int high = high_a - high_b - (uint(low_a) < uint(low_b) ? 1 : 0);
  if (high < 0) return false;
  return high > 0 || low > 0u || owned != 0;
}
bool inside_exact(Side s, int x, int y) {
  return exceeds(s.to.x, 256 * y - s.from.y, s.to.y, 256 * x - s.from.x, s.owned);
}

// The pixels first.xy, first.xy + step, ... of a face within `area`, of which y0 is at row 1 of the tile. The first
// pass leaves the nearest depth at each pixel, the second the first face of the mesh that has it.
void draw_face(uint face, bool second, ivec2 first, ivec2 step_by, ivec4 area, int y0, int pitch) {
  ivec2 a = corner(face, 0u), b = corner(face, 1u), c = corner(face, 2u);
  ivec2 low = min(a, min(b, c)), high = max(a, max(b, c));
  ivec4 box = pixels_between(low, high, area);
  bool wide = max(high.x - low.x, high.y - low.y) > kExact;
  ivec2 ab = b - a, ac = c - a;
  if (wide) {
    if (exceeds(ab.y, ac.x, ab.x, ac.y, 0)) {
      ivec2 kept = b;
      b = c;
      c = kept;
    } else if (!exceeds(ab.x, ac.y, ab.y, ac.x, 0)) {
      return;
    }
  } else {
    int twice_area = ab.x * ac.y - ab.y * ac.x;
    if (twice_area == 0) return;
    if (twice_area < 0) {
      ivec2 kept = b;
      b = c;
      c = kept;
    }
  }
  Side sides[3] = Side[3](side_of(a, b), side_of(b, c), side_of(c, a));
  Plane plane = plane_of(face);
  float scale = divided(1.0, plane.distance);
  precise float at_centre = plane.normal.z * scale;
  precise float along_x = plane.normal.x * inverse_fx * scale;
  precise float along_y = plane.normal.y * inverse_fy * scale;
  for (int y = box.y + first.y; y <= box.w; y += step_by.y) {
    for (int x = box.x + first.x; x <= box.z; x += step_by.x) {
      bool covered = wide ? inside_exact(sides[0], x, y) && inside_exact(sides[1], x, y) && inside_exact(sides[2], x, y)
                          : inside(sides[0], x, y) && inside(sides[1], x, y) && inside(sides[2], x, y);
      if (!covered) continue;
      precise float linear = at_centre + along_x * (float(x) - cx) + along_y * (float(y) - cy);
      uint bits = floatBitsToUint(max(least, min(most, linear)));
      int at = (y - y0 + 1) * pitch + (x - rect.x + 1);
      if (!second) {
        atomicMax(tile_depth[at], bits);
      } else if (tile_depth[at] == bits) {
        atomicMin(tile_face[at], face);
      }
    }
  }
}

void draw_faces(bool second, ivec4 area, int y0, int pitch) {
  uint rounds = (small_count + uint(THREADS - 1)) / uint(THREADS);
  // Small faces one a thread, then large ones together.
  for (uint i = 0u; i < rounds + large_count; ++i) {
    bool together = i >= rounds;
    uint place = together ? h.faces - 1u - (i - rounds) : i * uint(THREADS) + uint(lid);
    if (!together && place >= small_count) continue;
    uint rows = scratch[list_at + 2u * place + 1u];
    if (int(rows & 0xffffu) > area.w || int(rows >> 16) < area.y) continue;
    draw_face(scratch[list_at + 2u * place], second, together ? ivec2(lid & 15, lid >> 4) : ivec2(0),
              together ? ivec2(16, THREADS / 16) : ivec2(1), area, y0, pitch);
  }
}
)";

constexpr const char* kMain = R"(
void main() {
  uint group = gl_WorkGroupID.x;
  lid = int(gl_LocalInvocationID.x);
  h = hypotheses[group];
  scratch_at = group * scratch_stride;
  list_at = scratch_at + 2u * h.vertices;
  if (lid == 0) {
    low_x = 2147483647;
    low_y = 2147483647;
    high_x = -2147483647;
    high_y = -2147483647;
    least_bits = 0x7f7fffffu;
    most_bits = 0u;
    small_count = 0u;
    large_count = 0u;
  }
  if (lid < 6) counts[lid] = 0;
  if (lid == 6) large_turns = 0;
  if (lid == 7) small_turns = 0;
  barrier();
  project_vertices();
  memoryBarrierBuffer();
  memoryBarrierShared();
  barrier();
  rect = pixels_between(ivec2(low_x, low_y), ivec2(high_x, high_y), ivec4(0, 0, width - 1, height - 1));
  least = uintBitsToFloat(least_bits);
  most = uintBitsToFloat(most_bits);
  int pitch = max(3, rect.z - rect.x + 3);
  int rows = (TILE / pitch - 2) & ~3;
  list_faces(rows);
  memoryBarrierBuffer();
  memoryBarrierShared();
  barrier();

  float mantissa = 1.0;
  int exponent = 0;
  double total = 0.0;
  bool empty = rect.x > rect.z || rect.y > rect.w;
  bool complete = empty || turns_needed(rows) <= most_turns;
  // Tiles begin at multiples of four rows, so that what is summed together is in one of them.
  for (int top = empty || !complete ? rect.w + 1 : rect.y & ~3; top <= rect.w; top += rows) {
    int y0 = max(rect.y, top);
    int y1 = min(rect.w, top + rows - 1);
    for (int i = lid; i < TILE; i += THREADS) {
      tile_depth[i] = 0u;
      tile_face[i] = 0xffffffffu;
    }
    barrier();
    for (int pass = 0; pass < 2; ++pass) {
      int beside = 1 - pass;
      draw_faces(pass == 1, ivec4(rect.x, max(rect.y, y0 - beside), rect.z, min(rect.w, y1 + beside)), y0, pitch);
      memoryBarrierShared();
      barrier();
    }
#ifdef EQUATIONS
    sum_equations(y0, y1, pitch, total);
#endif
#ifdef EVIDENCE
    weigh_pixels(y0, y1, pitch);
    memoryBarrierShared();
    barrier();
    if (lid < 48) multiply_lane(lid >> 4, lid & 15, y0, y1, pitch, mantissa, exponent);
#endif
    barrier();
  }

#ifdef EVIDENCE
  // The tile is done with: its memory takes the products of the lanes.
  if (lid < 48) {
    tile_depth[lid] = floatBitsToUint(mantissa);
    tile_face[lid] = uint(exponent);
  }
  memoryBarrierShared();
  barrier();
  if (lid < 3) {
    precise double product = 1.0;
    int sum = 0;
    for (int lane = 0; lane < 16; ++lane) {
      precise double next = product * double(uintBitsToFloat(tile_depth[16 * lid + lane]));
      product = next;
      sum += int(tile_face[16 * lid + lane]);
    }
    results[group].products[lid] = unpackDouble2x32(product);
    results[group].exponents[lid] = sum;
  }
#endif
#ifdef EQUATIONS
  if (lid < 29) results[group].sums[lid] = unpackDouble2x32(total);
#endif
  memoryBarrierShared();
  barrier();
  if (lid == 0) {
    results[group].in_view = counts[0];
    results[group].covered = counts[1];
    results[group].measured = counts[2];
    results[group].visible = counts[3];
    results[group].hits = counts[4];
    results[group].equation_pixels = counts[5];
    results[group].complete = complete ? 1 : 0;
  }
}
)";

}  // namespace

int tile_pixels(const PoseWork& work) {
  // With what else is there, below the 32 KiB that every device has.
  return work.equations ? 2048 : 3860;
}

std::string pose_program(const PoseWork& work, int division_error) {
  std::string text = shader_arithmetic(division_error);
  text += "#define THREADS " + std::to_string(kThreads) + "\n#define TILE " + std::to_string(tile_pixels(work)) + '\n';
  if (work.evidence) text += "#define EVIDENCE\n";
  if (work.equations) text += "#define EQUATIONS\n";
  return text + kBuffers + kRaster + shader_pixels(work) + kMain;
}

}  // namespace prescene::rendering
