// SPDX-License-Identifier: Apache-2.0
#include "neural_gas.h"

#include <algorithm>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "neural_gas.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

#ifndef PRESCENE_COLLISION_NEURAL_GAS_ONCE
#define PRESCENE_COLLISION_NEURAL_GAS_ONCE
namespace prescene::collision {
namespace {

constexpr std::size_t kBlock = 16;

// Sums of point lanes of each prototype; 16 lanes whatever the machine's width, so that the sums are the same.
struct Sums {
  alignas(64) std::array<std::array<float, kBlock>, kMostPrototypes> x = {};
  alignas(64) std::array<std::array<float, kBlock>, kMostPrototypes> y = {};
  alignas(64) std::array<std::array<float, kBlock>, kMostPrototypes> z = {};
  alignas(64) std::array<std::array<float, kBlock>, kMostPrototypes> weight = {};
};

}  // namespace
}  // namespace prescene::collision
#endif

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = HWY_CAPPED(float, 16);
using V = hn::Vec<Floats>;

// No fused operations anywhere here: rounding must not depend on the target.
HWY_INLINE V squared_distance(Floats d, const Prototypes& prototypes, std::size_t k, V x, V y, V z) {
  const V dx = hn::Sub(hn::Set(d, prototypes.x[k]), x);
  const V dy = hn::Sub(hn::Set(d, prototypes.y[k]), y);
  const V dz = hn::Sub(hn::Set(d, prototypes.z[k]), z);
  return hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
}

HWY_INLINE void add_to(Floats d, V value, float* sum) { hn::Store(hn::Add(hn::Load(d, sum), value), d, sum); }

// `step` is the factor from one rank to the next.
void add_round(const WeightedPoints& points, const Prototypes& prototypes, float step, Sums& sums) {
  const Floats d;
  const V one = hn::Set(d, 1.0F);
  const V factor = hn::Set(d, step);
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t i = 0; i < points.x.size(); i += lanes) {
    const std::size_t lane = i % kBlock;
    const V x = hn::LoadU(d, &points.x[i]);
    const V y = hn::LoadU(d, &points.y[i]);
    const V z = hn::LoadU(d, &points.z[i]);
    const V weight = hn::LoadU(d, &points.weight[i]);
    HWY_ALIGN std::array<float, kMostPrototypes * kBlock> distances;
    for (std::size_t k = 0; k < prototypes.count; ++k)
      hn::Store(squared_distance(d, prototypes, k, x, y, z), d, &distances[k * lanes]);
    for (std::size_t k = 0; k < prototypes.count; ++k) {
      const V own = hn::Load(d, &distances[k * lanes]);
      V share = weight;
      for (std::size_t j = 0; j < k; ++j)  // Of equal ones the first is closer.
        share = hn::Mul(share, hn::IfThenElse(hn::Le(hn::Load(d, &distances[j * lanes]), own), factor, one));
      for (std::size_t j = k + 1; j < prototypes.count; ++j)
        share = hn::Mul(share, hn::IfThenElse(hn::Lt(hn::Load(d, &distances[j * lanes]), own), factor, one));
      add_to(d, hn::Mul(share, x), &sums.x[k][lane]);
      add_to(d, hn::Mul(share, y), &sums.y[k][lane]);
      add_to(d, hn::Mul(share, z), &sums.z[k][lane]);
      add_to(d, share, &sums.weight[k][lane]);
    }
  }
}

void find_closest(const WeightedPoints& points, const Prototypes& prototypes, std::span<std::uint8_t> closest) {
  const Floats d;
  const std::size_t lanes = hn::Lanes(d);
  HWY_ALIGN std::array<float, kBlock> found;
  for (std::size_t i = 0; i < points.count; i += lanes) {
    const V x = hn::LoadU(d, &points.x[i]);
    const V y = hn::LoadU(d, &points.y[i]);
    const V z = hn::LoadU(d, &points.z[i]);
    V best = squared_distance(d, prototypes, 0, x, y, z);
    V number = hn::Zero(d);
    for (std::size_t k = 1; k < prototypes.count; ++k) {
      const V distance = squared_distance(d, prototypes, k, x, y, z);
      const auto closer = hn::Lt(distance, best);
      best = hn::IfThenElse(closer, distance, best);
      number = hn::IfThenElse(closer, hn::Set(d, static_cast<float>(k)), number);
    }
    hn::Store(number, d, found.data());
    for (std::size_t lane = 0; lane < std::min(lanes, points.count - i); ++lane)
      closest[i + lane] = static_cast<std::uint8_t>(found[lane]);
  }
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {
namespace {

HWY_EXPORT(add_round);
HWY_EXPORT(find_closest);

constexpr int kMostRounds = 40;
constexpr int kCoolingRounds = 20;
constexpr float kLastLambda = 0.01F;
constexpr float kStill = 1e-5F;  // Of the box's diagonal.
// Smaller factors from rank to rank count as none, lest their powers are subnormal numbers.
constexpr float kSmallestStep = 0.003F;

float squared_distance(const Prototypes& prototypes, std::size_t k, const WeightedPoints& points, std::size_t i) {
  const float dx = prototypes.x[k] - points.x[i];
  const float dy = prototypes.y[k] - points.y[i];
  const float dz = prototypes.z[k] - points.z[i];
  return dx * dx + dy * dy + dz * dz;
}

// Each as far from those before as a point can be, so that none starts at the place of another.
Prototypes spread(const WeightedPoints& points, std::size_t count) {
  Prototypes prototypes;
  std::vector<float> distances(points.count, std::numeric_limits<float>::infinity());
  std::size_t next = 0;
  while (true) {
    const std::size_t k = prototypes.count++;
    prototypes.x[k] = points.x[next];
    prototypes.y[k] = points.y[next];
    prototypes.z[k] = points.z[next];
    if (prototypes.count == count) return prototypes;
    for (std::size_t i = 0; i < points.count; ++i)
      distances[i] = std::min(distances[i], squared_distance(prototypes, k, points, i));
    next = static_cast<std::size_t>(std::max_element(distances.begin(), distances.end()) - distances.begin());
    if (!(distances[next] > 0.0F)) return prototypes;
  }
}

float diagonal(const WeightedPoints& points) {
  const auto extent = [&](const std::vector<float>& values) {
    const auto end = values.begin() + static_cast<std::ptrdiff_t>(points.count);
    const auto [low, high] = std::minmax_element(values.begin(), end);
    return *high - *low;
  };
  return std::hypot(extent(points.x), extent(points.y), extent(points.z));
}

float sum_of(const std::array<float, kBlock>& lanes) {
  float sum = 0.0F;
  for (const float value : lanes) sum += value;
  return sum;
}

// Returns the largest move.
float move(Prototypes& prototypes, const Sums& sums) {
  float moved = 0.0F;
  for (std::size_t k = 0; k < prototypes.count; ++k) {
    const float weight = sum_of(sums.weight[k]);
    if (!(weight > 1e-30F)) continue;  // Nobody's closest: it waits where it is.
    const float x = sum_of(sums.x[k]) / weight;
    const float y = sum_of(sums.y[k]) / weight;
    const float z = sum_of(sums.z[k]) / weight;
    moved = std::max(moved, std::hypot(x - prototypes.x[k], y - prototypes.y[k], z - prototypes.z[k]));
    prototypes.x[k] = x;
    prototypes.y[k] = y;
    prototypes.z[k] = z;
  }
  return moved;
}

}  // namespace

WeightedPoints::WeightedPoints(std::size_t number) : count(number) {
  const std::size_t size = (number + kBlock - 1) / kBlock * kBlock;
  for (std::vector<float>* values : {&x, &y, &z, &weight}) values->resize(size, 0.0F);
}

void WeightedPoints::set(std::size_t i, const std::array<float, 3>& position, float importance) {
  x[i] = position[0];
  y[i] = position[1];
  z[i] = position[2];
  weight[i] = importance;
}

Prototypes neural_gas(const WeightedPoints& points, std::size_t count) {
  Prototypes prototypes = spread(points, count);
  const float still = kStill * diagonal(points);
  const float first_lambda = 0.5F * static_cast<float>(count);
  for (int round = 0; round < kMostRounds; ++round) {
    const float progress = std::min(1.0F, static_cast<float>(round) / kCoolingRounds);
    const float lambda = first_lambda * std::pow(kLastLambda / first_lambda, progress);
    const float step = std::exp(-1.0F / lambda);
    Sums sums;
    HWY_DYNAMIC_DISPATCH(add_round)(points, prototypes, step > kSmallestStep ? step : 0.0F, sums);
    if (move(prototypes, sums) <= still) break;
  }
  return prototypes;
}

void closest_prototypes(const WeightedPoints& points, const Prototypes& prototypes, std::span<std::uint8_t> closest) {
  HWY_DYNAMIC_DISPATCH(find_closest)(points, prototypes, closest);
}

}  // namespace prescene::collision
#endif
