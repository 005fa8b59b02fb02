// SPDX-License-Identifier: Apache-2.0
#include "pose_shader.h"

namespace prescene::rendering {
namespace {

// OpenGL promises that additions, subtractions and multiplications are rounded correctly, and `precise` that they are
// not fused. Of divisions it promises about two units in the last place: the rest is found in integers, from
// the remainder, of which the lowest 32 bits are all.
constexpr const char* kArithmetic = R"(
uint mantissa_of(uint bits) { return (bits & 0x007fffffu) | 0x00800000u; }
int exponent_of(uint bits) { return int((bits >> 23) & 255u); }

// Bits of q moved by whole units towards A / B, as far as one unit holds: at powers of two it changes.
uint nearer_quotient(uint bits, uint A, uint B, int spread) {
  uint Q = mantissa_of(bits);
  int remainder = int((A << uint(spread - exponent_of(bits))) - Q * B);
  int twice = 2 * remainder;
  // Below a power of two floats are twice as dense.
  int half_down = Q == 0x00800000u ? int(B >> 1) : int(B);
  if (twice > int(B)) return bits + uint((twice + int(B)) / (2 * int(B)));
  if (twice < -half_down) return bits - uint(max(1, (int(B) - twice) / (2 * int(B))));
  return bits;
}

float disturbed(float q) { return uintBitsToFloat(uint(int(floatBitsToUint(q)) + DIVISION_ERROR)); }

// a / b, rounded as the processor does.
float divided(float a, float b) {
  precise float q = a / b;
  int e = exponent_of(floatBitsToUint(q));
  if (a == 0.0 || e < 2 || e > 252) return q;
  uint A = mantissa_of(floatBitsToUint(a)), B = mantissa_of(floatBitsToUint(b));
  int spread = exponent_of(floatBitsToUint(a)) - exponent_of(floatBitsToUint(b)) + 150;
  uint bits = floatBitsToUint(disturbed(q));
  return uintBitsToFloat(nearer_quotient(nearer_quotient(bits, A, B, spread), A, B, spread));
}

// As snapped() of triangle_raster.h: 1/256 pixel, ties to even.
int snapped(float place) {
  const float kEnd = 4096000.0;
  const float kWhole = 12582912.0;
  precise float scaled = place * 256.0;
  precise float up = clamp(scaled, -kEnd, kEnd) + kWhole;
  precise float whole = up - kWhole;
  return int(whole);
}

// As portable_exp2().
float exp2_of(float x) {
  const float kWhole = 12582912.0;
  precise float shifted = x + kWhole;
  precise float r = x - (shifted - kWhole);
  precise float r2 = r * r;
  precise float p = (1.0 + r * 0.69314698) +
                    r2 * ((0.24022242 + r * 0.055507337) + r2 * (0.0096715127 + r * 0.0013264727));
  precise float result = p * uintBitsToFloat((floatBitsToUint(shifted) << 23) + 0x3f800000u);
  return result;
}
)";

constexpr const char* kProbe = R"(
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Inputs { float inputs[]; };
layout(std430, binding = 5) writeonly buffer Outputs { uint outputs[]; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  float a = inputs[4u * i], b = inputs[4u * i + 1u], c = inputs[4u * i + 2u], d = inputs[4u * i + 3u];
  precise float sum = a * b + c;
  precise float dot = a * b + c * d + a * c;
  precise float cross = a * d - b * c;
  precise double wide = double(a) + double(b) * double(c);
  uvec2 wide_bits = unpackDouble2x32(wide);
  outputs[7u * i] = floatBitsToUint(sum);
  outputs[7u * i + 1u] = floatBitsToUint(dot);
  outputs[7u * i + 2u] = floatBitsToUint(cross);
  outputs[7u * i + 3u] = floatBitsToUint(divided(a, b));
  outputs[7u * i + 4u] = uint(snapped(c));
  outputs[7u * i + 5u] = floatBitsToUint(exp2_of(max(-abs(d), -126.0)));
  outputs[7u * i + 6u] = wide_bits.x ^ wide_bits.y;
}
)";

}  // namespace

std::string shader_arithmetic(int division_error) {
  return "#version 430 core\n#define DIVISION_ERROR (" + std::to_string(division_error) + ")\n" + kArithmetic;
}

std::string probe_program(int division_error) { return shader_arithmetic(division_error) + kProbe; }

}  // namespace prescene::rendering
