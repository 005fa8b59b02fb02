// SPDX-License-Identifier: Apache-2.0
// Hypotheses about one object, and circumstances: where all else is, and by how much the object is off. Each hypothesis
// is looked at under the same circumstances, so that only what distinguishes the hypotheses makes images differ.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/next_view.h"
#include "prior.h"

namespace prescene::queries {

/// One state of the world as it is drawn.
struct Imagined {
  belief::WorldState state;
  std::vector<char> is_there;  ///< By object.
};

/// What is to be told apart, under which circumstances: states[h * circumstances + j].
struct Imagining {
  std::vector<belief::NextViewAnswer::Hypothesis> hypotheses;
  std::vector<double> probabilities;
  std::size_t circumstances = 1;
  std::vector<Imagined> states;

  void add(std::optional<belief::Pose> X_WO, double probability) {
    hypotheses.push_back({std::move(X_WO), probability});
    probabilities.push_back(probability);
  }
};

/// `particles`: of the object; empty = its places are those of the draws.
Imagining imagine(const Prior& prior, std::size_t object, const belief::NextViewQuery& query,
                  std::span<const belief::Particle> particles);

}  // namespace prescene::queries
