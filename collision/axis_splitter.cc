// SPDX-License-Identifier: Apache-2.0
// The builders that cut along coordinate axes, extended to nodes of any width.
#include <algorithm>
#include <cmath>
#include <span>

#include "hierarchy_splitter.h"

namespace prescene::collision {
namespace {

struct AxisPart {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
  std::size_t level = 0;  // Cuts made so far; the first three go along the node's axes, longest first.

  std::uint32_t size() const { return end - begin; }
};

class AxisSplitter final : public Splitter {
 public:
  AxisSplitter(std::span<const Item> items, const HierarchyOptions& options)
      : builder_(options.builder),
        branching_(static_cast<std::uint32_t>(options.branching)),
        leaf_items_(static_cast<std::uint32_t>(options.leaf_items)),
        centres_(centres_of(items)) {}

  std::uint32_t item(std::size_t i) const override { return centres_[i].item; }

  Cuts split(std::uint32_t begin, std::uint32_t end) override {
    if (builder_ == Builder::kLongestAxis) return slice(begin, end);
    return cut_again_and_again(begin, end);
  }

 private:
  CentreBox box(const AxisPart& part) const { return box_of(std::span(centres_).subspan(part.begin, part.size())); }

  Cuts slice(std::uint32_t begin, std::uint32_t end) {
    const Cuts cuts = equal_cuts(begin, end, std::min(branching_, (end - begin + leaf_items_ - 1) / leaf_items_));
    const std::size_t axis = box({begin, end}).axes_by_length()[0];
    std::sort(centres_.begin() + begin, centres_.begin() + end, [axis](const Centre& a, const Centre& b) {
      return a.position[axis] != b.position[axis] ? a.position[axis] < b.position[axis] : a.item < b.item;
    });
    return cuts;
  }

  // Of those that do not fit a leaf the least often cut part, the largest of them.
  std::uint32_t next(std::span<const AxisPart> parts) const {
    std::uint32_t best = 0;
    for (std::uint32_t i = 1; i < parts.size(); ++i) {
      const bool best_splits = parts[best].size() > leaf_items_;
      const bool splits = parts[i].size() > leaf_items_;
      if (splits != best_splits) {
        if (splits) best = i;
      } else if (parts[i].level != parts[best].level) {
        if (parts[i].level < parts[best].level) best = i;
      } else if (parts[i].size() > parts[best].size()) {
        best = i;
      }
    }
    return best;
  }

  Cuts cut_again_and_again(std::uint32_t begin, std::uint32_t end) {
    const CentreBox node = box({begin, end});
    std::array<AxisPart, kMostChildren> parts;
    parts[0] = {begin, end};
    std::uint32_t count = 1;
    while (count < branching_) {
      const std::uint32_t i = next(std::span(parts).first(count));
      AxisPart& part = parts[i];
      if (part.size() <= leaf_items_) break;
      const std::uint32_t middle = cut(part, node);
      ++part.level;
      if (middle == part.begin || middle == part.end) continue;
      std::copy_backward(parts.begin() + i, parts.begin() + count, parts.begin() + count + 1);
      parts[i].end = middle;
      parts[i + 1].begin = middle;
      ++count;
    }
    Cuts cuts;
    cuts.parts = count;
    for (std::uint32_t i = 0; i < count; ++i) cuts.at[i] = parts[i].begin;
    cuts.at[count] = end;
    return cuts;
  }

  // The end of the part's lower side. Only the first three cuts, in the middle of the node, may leave a side empty.
  std::uint32_t cut(const AxisPart& part, const CentreBox& node) {
    const bool of_node = part.level < 3 && builder_ != Builder::kExtendedLongestAxis;
    const CentreBox own = of_node ? node : box(part);
    const std::size_t axis = own.axes_by_length()[of_node ? part.level : 0];
    if (builder_ != Builder::kMiddle || (!of_node && !(own.extent(axis) > 0.0F)))
      return halve_at_median(centres_, part.begin, part.end, axis);
    const float middle = own.low[axis] + 0.5F * own.extent(axis);
    const auto right = std::partition(centres_.begin() + part.begin, centres_.begin() + part.end,
                                      [&](const Centre& centre) { return centre.position[axis] <= middle; });
    const auto place = static_cast<std::uint32_t>(right - centres_.begin());
    const bool stuck = !of_node && (place == part.begin || place == part.end);  // Neighbouring floats.
    return stuck ? halve_at_median(centres_, part.begin, part.end, axis) : place;
  }

  Builder builder_;
  std::uint32_t branching_;
  std::uint32_t leaf_items_;
  std::vector<Centre> centres_;
};

}  // namespace

std::vector<Centre> centres_of(std::span<const Item> items) {
  float largest = 0.0F;
  float heaviest = 0.0F;
  for (const Item& item : items) {
    for (const float x : item.centre) largest = std::max(largest, std::abs(x));
    heaviest = std::max(heaviest, item.weight);
  }
  std::vector<Centre> centres(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    Centre& centre = centres[i];
    for (std::size_t k = 0; k < 3; ++k) centre.position[k] = largest > 0.0F ? items[i].centre[k] / largest : 0.0F;
    centre.weight = heaviest > 0.0F ? items[i].weight / heaviest : 0.0F;
    centre.item = static_cast<std::uint32_t>(i);
  }
  return centres;
}

std::array<std::size_t, 3> CentreBox::axes_by_length() const {
  std::array<std::size_t, 3> axes = {0, 1, 2};
  std::sort(axes.begin(), axes.end(),
            [&](std::size_t a, std::size_t b) { return extent(a) != extent(b) ? extent(a) > extent(b) : a < b; });
  return axes;
}

CentreBox box_of(std::span<const Centre> centres) {
  CentreBox box{centres[0].position, centres[0].position};
  for (const Centre& centre : centres) {
    for (std::size_t k = 0; k < 3; ++k) {
      box.low[k] = std::min(box.low[k], centre.position[k]);
      box.high[k] = std::max(box.high[k], centre.position[k]);
    }
  }
  return box;
}

std::uint32_t halve_at_median(std::span<Centre> centres, std::uint32_t begin, std::uint32_t end, std::size_t axis) {
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(centres.begin() + begin, centres.begin() + middle, centres.begin() + end,
                   [axis](const Centre& a, const Centre& b) {
                     return a.position[axis] != b.position[axis] ? a.position[axis] < b.position[axis]
                                                                 : a.item < b.item;
                   });
  return middle;
}

std::unique_ptr<Splitter> axis_splitter(std::span<const Item> items, const HierarchyOptions& options) {
  return std::make_unique<AxisSplitter>(items, options);
}

}  // namespace prescene::collision
