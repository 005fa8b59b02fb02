// SPDX-License-Identifier: Apache-2.0
// Outcome problems with known probabilities: starts are standard normal vectors z, laid out three to an object's
// position.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "tests/support/fake_simulator.h"

namespace prescene::tests {

inline simulation::StartComponent normal_starts(int dimensions, double shift = 0.0, double weight = 1.0) {
  return {weight, dimensions, [dimensions, shift](std::span<const double> uniforms) {
            belief::WorldState state;
            state.objects.resize(static_cast<std::size_t>((dimensions + 2) / 3));
            for (std::size_t i = 0; i < uniforms.size(); ++i)
              state.objects[i / 3].X_WO.translation[static_cast<Eigen::Index>(i % 3)] =
                  core::inverse_normal_cdf(uniforms[i]) + shift;
            return state;
          }};
}

inline double z_of(const belief::WorldState& state, std::size_t i) {
  return state.objects[i / 3].X_WO.translation[static_cast<Eigen::Index>(i % 3)];
}

/// Ends where it starts: the outcome is judged from z itself.
inline FakeSimulator standing_still() {
  return FakeSimulator(
      [](const belief::WorldState& start, const simulation::RunRequest&, core::RandomStream) { return start; });
}

struct ToyProblem {
  std::string name;
  int dimensions;
  std::vector<double> probabilities;
  std::function<int(const belief::WorldState&)> classify;

  simulation::StartDistribution starts() const { return {{normal_starts(dimensions)}}; }
  std::vector<simulation::Variable> variables() const {
    simulation::Variable variable;
    for (std::size_t c = 0; c < probabilities.size(); ++c) variable.classes.push_back("class " + std::to_string(c));
    variable.classify = [classify = classify](const belief::Trajectory& run) { return classify(run.final()); };
    return {variable};
  }
};

/// A plane cuts the start distribution; three of eight dimensions decide (a stack that stays or slides off).
inline ToyProblem one_boundary() {
  const double a = std::sqrt(1.0 + 0.25 + 0.04);
  const double p = core::normal_cdf(0.8 / a);
  return {"one boundary", 8, {p, 1.0 - p}, [](const belief::WorldState& s) {
            return z_of(s, 0) + 0.5 * z_of(s, 1) - 0.2 * z_of(s, 2) < 0.8 ? 0 : 1;
          }};
}

/// A curved boundary with a rare class; ten dimensions (a carton over the rim of a bin).
inline ToyProblem curved_boundary() {
  const double inside = 1.0 - std::exp(-0.5 * 2.0);
  const double rim = 1.0 - core::normal_cdf(1.2);
  return {"curved boundary",
          10,
          {inside, (1.0 - inside) * rim, (1.0 - inside) * (1.0 - rim)},
          [](const belief::WorldState& s) {
            const double x = 0.6 * z_of(s, 0) + 0.8 * z_of(s, 3), y = z_of(s, 1);
            if (x * x + y * y < 2.0) return 0;
            return 0.8 * z_of(s, 2) - 0.6 * z_of(s, 4) > 1.2 ? 1 : 2;
          }};
}

/// The outcome flips many times within a standard deviation of each coordinate (a thrown die).
inline ToyProblem chaotic() {
  return {"chaotic", 6, {0.35, 0.25, 0.2, 0.1, 0.06, 0.04}, [](const belief::WorldState& s) {
            // Whole multiples of uniform numbers, modulo one, are uniform again, and so is their sum.
            double turns = 0.0;
            for (std::size_t i = 0; i < 6; ++i)
              turns += (1013.0 + 62.0 * static_cast<double>(i)) * core::normal_cdf(z_of(s, i));
            const double u = turns - std::floor(turns);
            const double ends[] = {0.35, 0.6, 0.8, 0.9, 0.96};
            int c = 0;
            while (c < 5 && u >= ends[c]) ++c;
            return c;
          }};
}

}  // namespace prescene::tests
