// SPDX-License-Identifier: Apache-2.0
#include "arithmetic_probe.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "gl_buffer.h"
#include "pose_shader.h"
#include "prescene/core/random.h"
#include "prescene/rendering/portable_math.h"
#include "prescene/rendering/triangle_raster.h"

namespace prescene::rendering {
namespace {

constexpr std::size_t kNumbers = 4096;
constexpr std::size_t kGroup = 64;  // of probe_program

using Inputs = std::array<float, kProbeInputs>;
using Outputs = std::array<std::uint32_t, kProbeOutputs>;

/// What probe_program computes.
Outputs probe_on_processor(const Inputs& in) {
  const auto [a, b, c, d] = in;
  const double wide = static_cast<double>(a) + static_cast<double>(b) * static_cast<double>(c);
  const auto wide_bits = std::bit_cast<std::uint64_t>(wide);
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
  return {bits(a * b + c),
          bits(a * b + c * d + a * c),
          bits(a * d - b * c),
          bits(a / b),
          static_cast<std::uint32_t>(snapped(c, 0.0f).x),
          bits(portable_exp2(std::max(-std::abs(d), -126.0f))),
          static_cast<std::uint32_t>(wide_bits) ^ static_cast<std::uint32_t>(wide_bits >> 32)};
}

/// Numbers over twenty binary orders of both signs, and each eighth one a power of two or beside one, where quotients
/// change their unit.
std::vector<Inputs> probe_inputs() {
  core::RandomStream stream(17, core::Purpose::kTest);
  std::vector<Inputs> inputs(kNumbers);
  for (std::size_t i = 0; i < kNumbers; ++i) {
    for (float& value : inputs[i]) {
      const int order = static_cast<int>(stream.uniform(-10.0, 10.0));
      double number = std::ldexp(stream.uniform(1.0, 2.0), order);
      if (stream.uniform() < 0.125) {
        number = std::ldexp(1.0, static_cast<int>(stream.uniform(-10.0, 10.0)));
        number *= 1.0 + std::ldexp(std::floor(stream.uniform(-2.0, 3.0)), -23);
      }
      value = static_cast<float>(stream.uniform() < 0.5 ? number : -number);
    }
  }
  return inputs;
}

constexpr const char* kNames[kProbeOutputs] = {
    "a sum of a product", "a sum of products", "a difference of products", "a quotient",
    "a snapped place",    "a power of two",    "a sum in double precision"};

}  // namespace

core::Status probe_arithmetic(int division_error) {
  GlProgram program;
  PRESCENE_RETURN_IF_ERROR(program.compile(probe_program(division_error)));
  const std::vector<Inputs> inputs = probe_inputs();
  GlBuffer in, out;
  in.reserve(inputs.size() * sizeof(Inputs));
  in.write(0, inputs.data(), inputs.size() * sizeof(Inputs));
  out.reserve(inputs.size() * sizeof(Outputs));
  in.bind(kHypotheses);
  out.bind(kResults);
  program.dispatch(kNumbers / kGroup);
  const auto* outputs = static_cast<const Outputs*>(out.map(inputs.size() * sizeof(Outputs)));
  if (outputs == nullptr) return device_failure("what the device computed can't be read");
  core::Status status;
  for (std::size_t i = 0; i < kNumbers && status.ok(); ++i) {
    const Outputs expected = probe_on_processor(inputs[i]);
    for (std::size_t k = 0; k < kProbeOutputs && status.ok(); ++k)
      if (outputs[i][k] != expected[k])
        status =
            core::unsupported("likelihood in compute shaders: the device rounds " + std::string(kNames[k]) +
                              " otherwise than the processor, so that it would cover other pixels: use the processor");
  }
  out.unmap();
  PRESCENE_RETURN_IF_ERROR(gl_errors());
  return status;
}

}  // namespace prescene::rendering
