// SPDX-License-Identifier: Apache-2.0
// Clusters of centres as the parts of a node.
#include <algorithm>

#include "hierarchy_splitter.h"
#include "neural_gas.h"

namespace prescene::collision {
namespace {

// Larger ranges find their prototypes with evenly picked centres: means over more change nothing that matters.
constexpr std::uint32_t kMostSamples = 16'384;

class NeuralGasSplitter final : public Splitter {
 public:
  NeuralGasSplitter(std::span<const Item> items, const HierarchyOptions& options)
      : weighted_(options.builder == Builder::kWeightedNeuralGas),
        branching_(static_cast<std::uint32_t>(options.branching)),
        leaf_items_(static_cast<std::uint32_t>(options.leaf_items)),
        centres_(centres_of(items)) {}

  std::uint32_t item(std::size_t i) const override { return centres_[i].item; }

  Cuts split(std::uint32_t begin, std::uint32_t end) override {
    const std::uint32_t count = end - begin;
    if (leaf_items_ == 1 && count <= branching_) return equal_cuts(begin, end, count);
    const std::span<Centre> range = std::span(centres_).subspan(begin, count);
    const std::uint32_t wanted = std::min(branching_, (count + leaf_items_ - 1) / leaf_items_);
    const Prototypes prototypes = neural_gas(points(range, std::min(count, kMostSamples)), wanted);
    const Cuts cuts = group(range, begin, in_line(prototypes));
    if (cuts.parts >= 2) return cuts;
    const std::uint32_t middle = halve_at_median(centres_, begin, end, box_of(range).axes_by_length()[0]);
    return {.at = {begin, middle, end}, .parts = 2};
  }

 private:
  // Evenly picked ones of the range.
  WeightedPoints points(std::span<const Centre> range, std::size_t count) const {
    WeightedPoints picked(count);
    for (std::size_t i = 0; i < count; ++i) {
      const Centre& centre = range[i * range.size() / count];
      picked.set(i, centre.position, weighted_ ? centre.weight : 1.0F);
    }
    return picked;
  }

  // Along the longest axis of their box, so that parts beside each other lie beside each other.
  static Prototypes in_line(const Prototypes& prototypes) {
    std::vector<Centre> centres(prototypes.count);
    for (std::size_t k = 0; k < prototypes.count; ++k)
      centres[k].position = {prototypes.x[k], prototypes.y[k], prototypes.z[k]};
    const std::size_t axis = box_of(centres).axes_by_length()[0];
    std::stable_sort(centres.begin(), centres.end(),
                     [axis](const Centre& a, const Centre& b) { return a.position[axis] < b.position[axis]; });
    Prototypes sorted = prototypes;
    for (std::size_t k = 0; k < prototypes.count; ++k) {
      sorted.x[k] = centres[k].position[0];
      sorted.y[k] = centres[k].position[1];
      sorted.z[k] = centres[k].position[2];
    }
    return sorted;
  }

  // Puts the centres that are closest to the same prototype together; prototypes without any make no part.
  Cuts group(std::span<Centre> range, std::uint32_t begin, const Prototypes& prototypes) const {
    std::vector<std::uint8_t> closest(range.size());
    closest_prototypes(points(range, range.size()), prototypes, closest);
    std::array<std::uint32_t, kMostPrototypes> counts = {};
    for (const std::uint8_t k : closest) ++counts[k];
    Cuts cuts;
    cuts.at[0] = begin;
    std::array<std::uint32_t, kMostPrototypes> next = {};
    std::uint32_t end = 0;
    for (std::size_t k = 0; k < prototypes.count; ++k) {
      next[k] = end;
      end += counts[k];
      if (counts[k] > 0) cuts.at[++cuts.parts] = begin + end;
    }
    const std::vector<Centre> old(range.begin(), range.end());
    for (std::size_t i = 0; i < old.size(); ++i) range[next[closest[i]]++] = old[i];
    return cuts;
  }

  bool weighted_;
  std::uint32_t branching_;
  std::uint32_t leaf_items_;
  std::vector<Centre> centres_;
};

}  // namespace

std::unique_ptr<Splitter> neural_gas_splitter(std::span<const Item> items, const HierarchyOptions& options) {
  return std::make_unique<NeuralGasSplitter>(items, options);
}

}  // namespace prescene::collision
