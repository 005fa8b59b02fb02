// SPDX-License-Identifier: Apache-2.0
#include "platform.h"

#include <unistd.h>

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "prescene/core/hash.h"
#include "prescene/core/random.h"

namespace prescene::tests {
namespace {

// The C library picks a variant of these functions by CPU. The variants differ in the last bit of about one result in
// a thousand, so what they return tells more surely than the CPU's name whether they are the same.
std::uint64_t elementary_functions() {
  core::RandomStream stream(1, core::Purpose::kTest);
  core::Hasher hasher;
  for (int i = 0; i < 20000; ++i) {
    const double x = 40.0 * stream.uniform() - 20.0;
    const double positive = 1e-6 + 20.0 * stream.uniform();
    const double cosine = 2.0 * stream.uniform() - 1.0;
    for (const double y :
         {std::exp(x), std::exp2(x), std::expm1(x), std::log(positive), std::log2(positive), std::log1p(positive),
          std::pow(positive, x), std::sin(x), std::cos(x), std::tan(x), std::asin(cosine), std::acos(cosine),
          std::atan(x), std::atan2(x, cosine), std::tanh(x), std::erf(x), std::cbrt(x), std::hypot(x, cosine)}) {
      hasher.value(y);
    }
    const auto xf = static_cast<float>(x);
    const auto pf = static_cast<float>(positive);
    for (const float y : {std::exp(xf), std::log(pf), std::pow(pf, xf), std::sin(xf), std::cos(xf)}) hasher.value(y);
  }
  return hasher.digest();
}

std::string c_library() {
  std::array<char, 64> version{};
  const std::size_t size = confstr(_CS_GNU_LIBC_VERSION, version.data(), version.size());
  return size > 0 && size <= version.size() ? version.data() : "unknown C library";
}

}  // namespace

std::string platform() {
  std::string text = PRESCENE_COMPILER "; Bullet " PRESCENE_BULLET_VERSION "; Eigen ";
  text += std::to_string(EIGEN_WORLD_VERSION) + "." + std::to_string(EIGEN_MAJOR_VERSION) + "." +
          std::to_string(EIGEN_MINOR_VERSION);
  text += "; " + c_library() + " whose elementary functions hash to " + core::hash_text(elementary_functions());
  return text;
}

}  // namespace prescene::tests
