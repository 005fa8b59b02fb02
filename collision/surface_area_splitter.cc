// SPDX-License-Identifier: Apache-2.0
// The binned surface-area heuristic [Wald 2007]. A wide node starts as one part; the part with the largest area times
// items is split in two along the best plane of all three axes until there are enough parts.
#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "hierarchy_splitter.h"
#include "principal_axes.h"
#include "surface_area_bins.h"

namespace prescene::collision {
namespace {

using Eigen::Array4f;
using Eigen::Array4i;
using surface_area::Binning;
using surface_area::Bins;
using surface_area::Box;
using surface_area::improve;
using surface_area::kMostBins;
using surface_area::Part;
using surface_area::Plane;
using surface_area::Record;

// From here on a range is binned and partitioned by several threads, in blocks of a fixed size.
constexpr std::uint32_t kParallelItems = 1U << 15U;
constexpr std::uint32_t kBlock = 1U << 13U;

class SurfaceAreaSplitter : public Splitter {
 public:
  SurfaceAreaSplitter(std::span<const Item> items, const HierarchyOptions& options, core::ThreadPool& pool)
      : pool_(pool),
        branching_(static_cast<std::uint32_t>(options.branching)),
        leaf_items_(static_cast<std::uint32_t>(options.leaf_items)),
        records_(items.size()),
        scratch_(items.size() >= kParallelItems ? items.size() : 0) {
    const float largest = pool.reduce_blocks(
        items.size(), kBlock, 0.0F,
        [&](std::size_t begin, std::size_t end) {
          float value = 0.0F;
          for (std::size_t i = begin; i < end; ++i) {
            for (std::size_t k = 0; k < 3; ++k)
              value = std::max({value, std::abs(items[i].low[k]), std::abs(items[i].high[k])});
          }
          return value;
        },
        [](float a, float b) { return std::max(a, b); });
    // Products of lengths then neither overflow nor vanish.
    const int exponent = largest > 0.0F ? std::ilogb(largest) : 0;
    scale_ = std::ldexp(1.0F, std::clamp(-exponent, -126, 126));
    const float scale = scale_;
    pool.for_blocks(items.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Item& item = items[i];
        const float number = std::bit_cast<float>(static_cast<std::uint32_t>(i) | kNumberBit);
        records_[i].low = {item.low[0] * scale, item.low[1] * scale, item.low[2] * scale, number};
        records_[i].high = {item.high[0] * scale, item.high[1] * scale, item.high[2] * scale, 0.0F};
      }
    });
  }

  std::uint32_t item(std::size_t i) const override {
    return std::bit_cast<std::uint32_t>(records_[i].low[3]) & ~kNumberBit;
  }

  Cuts split(std::uint32_t begin, std::uint32_t end) override {
    if (leaf_items_ == 1 && end - begin <= branching_) return equal_cuts(begin, end, end - begin);
    std::array<Part, kMostChildren> parts;
    parts[0] = {begin, end, 0.0F, centres(begin, end)};
    std::uint32_t count = 1;
    while (count < branching_) {
      const std::uint32_t i = most_costly(std::span(parts).first(count));
      if (parts[i].size() <= leaf_items_) break;
      const auto [left, right] = halve(parts[i]);
      std::copy_backward(parts.begin() + i + 1, parts.begin() + count, parts.begin() + count + 1);
      parts[i] = left;
      parts[i + 1] = right;
      ++count;
    }
    Cuts cuts;
    cuts.parts = count;
    for (std::uint32_t i = 0; i < count; ++i) cuts.at[i] = parts[i].begin;
    cuts.at[count] = end;
    return cuts;
  }

 protected:
  core::ThreadPool& pool() const { return pool_; }
  /// Replaces the box of the item at place i.
  void set_box(std::size_t i, const Vector3f& low, const Vector3f& high) {
    records_[i].low.head<3>() = low.array() * scale_;
    records_[i].high.head<3>() = high.array() * scale_;
  }

 private:
  static constexpr std::uint32_t kNumberBit = 1U << 30U;  // Keeps small numbers from being subnormal floats.

  // The one to be split next; one that fits a leaf only if all do.
  std::uint32_t most_costly(std::span<const Part> parts) const {
    std::uint32_t best = 0;
    for (std::uint32_t i = 1; i < parts.size(); ++i) {
      const bool best_splits = parts[best].size() > leaf_items_;
      const bool splits = parts[i].size() > leaf_items_;
      if (splits != best_splits ? splits : parts[i].cost > parts[best].cost) best = i;
    }
    return best;
  }

  Box centres(std::uint32_t begin, std::uint32_t end) {
    const auto of_block = [&](std::size_t from, std::size_t to) {
      Box box;
      for (std::size_t i = from; i < to; ++i) box.add(records_[i].centre(), records_[i].centre());
      return box;
    };
    if (end - begin < kParallelItems) return of_block(begin, end);
    return pool_.reduce_blocks(
        end - begin, kBlock, Box(),
        [&](std::size_t from, std::size_t to) { return of_block(begin + from, begin + to); },
        [](Box a, const Box& b) {
          a.add(b);
          return a;
        });
  }

  std::pair<Part, Part> halve(const Part& part) {
    // Few items need few bins: there are no more places where a plane makes a difference.
    const int bin_count = part.size() >= 256 ? kMostBins : part.size() >= 32 ? 16 : 8;
    const Binning binning(part.centres, bin_count);
    Plane best;
    if (part.size() > 2) {
      const Bins bins = fill(part, binning);
      for (int axis = 0; axis < 3; ++axis) {
        if (binning.scale[axis] > 0.0F) improve(best, bins, bin_count, axis);
      }
    }
    if (best.axis < 0) return halves(part);
    return part.size() < kParallelItems ? partition(part, binning, best) : partition_in_blocks(part, binning, best);
  }

  // Two items, or all centres equal.
  std::pair<Part, Part> halves(const Part& part) {
    const std::uint32_t middle = part.begin + part.size() / 2;
    return {{part.begin, middle, part.cost / 2, centres(part.begin, middle)},
            {middle, part.end, part.cost / 2, centres(middle, part.end)}};
  }

  Bins fill(const Part& part, const Binning& binning) {
    const auto of_block = [&](std::size_t from, std::size_t to) {
      Bins bins;
      for (std::size_t i = from; i < to; ++i) bins.add(records_[i], binning);
      return bins;
    };
    if (part.size() < kParallelItems) return of_block(part.begin, part.end);
    return pool_.reduce_blocks(
        part.size(), kBlock, Bins(),
        [&](std::size_t from, std::size_t to) { return of_block(part.begin + from, part.begin + to); },
        [&](Bins a, const Bins& b) {
          a.add(b, binning.bins);
          return a;
        });
  }

  std::pair<Part, Part> partition(const Part& part, const Binning& binning, const Plane& plane) {
    std::uint32_t left = part.begin;
    std::uint32_t right = part.end;
    Box left_centres;
    Box right_centres;
    while (true) {
      while (left < right) {
        const Array4f centre = records_[left].centre();
        if (binning.of(centre, plane.axis) >= plane.bin) break;
        left_centres.add(centre, centre);
        ++left;
      }
      while (left < right) {
        const Array4f centre = records_[right - 1].centre();
        if (binning.of(centre, plane.axis) < plane.bin) break;
        right_centres.add(centre, centre);
        --right;
      }
      if (left == right) break;
      std::swap(records_[left], records_[right - 1]);
    }
    return {{part.begin, left, plane.left_cost, left_centres}, {left, part.end, plane.right_cost, right_centres}};
  }

  std::pair<Part, Part> partition_in_blocks(const Part& part, const Binning& binning, const Plane& plane) {
    const auto on_left = [&](std::size_t i) { return binning.of(records_[i].centre(), plane.axis) < plane.bin; };
    const std::size_t blocks = (part.size() + kBlock - 1) / kBlock;
    std::vector<std::uint32_t> lefts(blocks + 1, 0);
    pool_.for_blocks(part.size(), kBlock, [&](std::size_t from, std::size_t to) {
      std::uint32_t count = 0;
      for (std::size_t i = from; i < to; ++i) count += on_left(part.begin + i) ? 1 : 0;
      lefts[from / kBlock + 1] = count;
    });
    std::partial_sum(lefts.begin(), lefts.end(), lefts.begin());
    const std::uint32_t middle = part.begin + lefts.back();
    pool_.for_blocks(part.size(), kBlock, [&](std::size_t from, std::size_t to) {
      std::size_t left = part.begin + lefts[from / kBlock];
      std::size_t right = middle + from - lefts[from / kBlock];
      for (std::size_t i = part.begin + from; i < part.begin + to; ++i)
        scratch_[on_left(i) ? left++ : right++] = records_[i];
    });
    pool_.for_blocks(part.size(), kBlock, [&](std::size_t from, std::size_t to) {
      std::copy(scratch_.begin() + part.begin + from, scratch_.begin() + part.begin + to,
                records_.begin() + part.begin + from);
    });
    return {{part.begin, middle, plane.left_cost, centres(part.begin, middle)},
            {middle, part.end, plane.right_cost, centres(middle, part.end)}};
  }

  core::ThreadPool& pool_;
  std::uint32_t branching_;
  std::uint32_t leaf_items_;
  std::vector<Record> records_;
  std::vector<Record> scratch_;
  float scale_ = 1.0F;
};

/// A box in two frames: the mesh's and a turned one.
struct TwoBoxes {
  Box straight;
  Box turned;

  void add(const TwoBoxes& other) {
    straight.add(other.straight);
    turned.add(other.turned);
  }
};

class TurnedSurfaceAreaSplitter final : public SurfaceAreaSplitter {
 public:
  TurnedSurfaceAreaSplitter(const Mesh& mesh, const std::vector<Item>& items, const HierarchyOptions& options,
                            core::ThreadPool& threads)
      : SurfaceAreaSplitter(items, options, threads), mesh_(mesh) {}

  Cuts split(std::uint32_t begin, std::uint32_t end) override {
    Eigen::Matrix3f R;
    if (moments(begin, end).principal_axes(&R)) {
      const TwoBoxes boxes = turn(begin, end, R);
      if (!(boxes.turned.half_area() < boxes.straight.half_area())) turn(begin, end, Eigen::Matrix3f::Identity());
    } else {
      turn(begin, end, Eigen::Matrix3f::Identity());
    }
    return SurfaceAreaSplitter::split(begin, end);
  }

 private:
  PointMoments moments(std::uint32_t begin, std::uint32_t end) {
    const PointMoments none(mesh_.corners(item(begin))[0]);
    const auto of_block = [&](std::size_t from, std::size_t to) {
      PointMoments sums = none;
      for (std::size_t i = from; i < to; ++i) {
        for (const Vector3f& p : mesh_.corners(item(i))) sums.add(p);
      }
      return sums;
    };
    if (end - begin < kParallelItems) return of_block(begin, end);
    return pool().reduce_blocks(
        end - begin, kBlock, none, [&](std::size_t from, std::size_t to) { return of_block(begin + from, begin + to); },
        [](PointMoments a, const PointMoments& b) {
          a.add(b);
          return a;
        });
  }

  // Gives the items their boxes in the frame whose axes are the rows of R; returns the boxes of all.
  TwoBoxes turn(std::uint32_t begin, std::uint32_t end, const Eigen::Matrix3f& R) {
    const auto of_block = [&](std::size_t from, std::size_t to) {
      TwoBoxes all;
      for (std::size_t i = from; i < to; ++i) {
        const std::array<Vector3f, 3> corners = mesh_.corners(item(i));
        Box straight;
        for (const Vector3f& p : corners) {
          const Array4f padded(p.x(), p.y(), p.z(), 0.0F);
          straight.add(padded, padded);
        }
        const Vector3f a = R * corners[0];
        const Vector3f b = R * corners[1];
        const Vector3f c = R * corners[2];
        const Vector3f low = a.cwiseMin(b).cwiseMin(c);
        const Vector3f high = a.cwiseMax(b).cwiseMax(c);
        set_box(i, low, high);
        all.straight.add(straight);
        all.turned.add(Array4f(low.x(), low.y(), low.z(), 0.0F), Array4f(high.x(), high.y(), high.z(), 0.0F));
      }
      return all;
    };
    if (end - begin < kParallelItems) return of_block(begin, end);
    return pool().reduce_blocks(
        end - begin, kBlock, TwoBoxes(),
        [&](std::size_t from, std::size_t to) { return of_block(begin + from, begin + to); },
        [](TwoBoxes a, const TwoBoxes& b) {
          a.add(b);
          return a;
        });
  }

  const Mesh& mesh_;
};

}  // namespace

std::unique_ptr<Splitter> turned_surface_area_splitter(const Mesh& mesh, const HierarchyOptions& options,
                                                       core::ThreadPool& pool) {
  return std::make_unique<TurnedSurfaceAreaSplitter>(mesh, triangle_items(mesh), options, pool);
}

std::unique_ptr<Splitter> surface_area_splitter(std::span<const Item> items, const HierarchyOptions& options,
                                                core::ThreadPool& pool) {
  return std::make_unique<SurfaceAreaSplitter>(items, options, pool);
}

}  // namespace prescene::collision
