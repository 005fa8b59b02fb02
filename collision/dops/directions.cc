// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/dops/directions.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/core/random.h"

namespace prescene::collision {
namespace {

double dot(const DopAxis& a, const DopAxis& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

DopAxis cross(const DopAxis& a, const DopAxis& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

DopAxis difference(const DopAxis& a, const DopAxis& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

DopAxis normalized(const DopAxis& a) {
  const double length = std::sqrt(dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}

const std::vector<DopAxis> kCoordinateAxes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const std::vector<DopAxis> kEdges = {{1, 1, 0}, {1, -1, 0}, {1, 0, 1}, {1, 0, -1}, {0, 1, 1}, {0, 1, -1}};
const std::vector<DopAxis> kCorners = {{1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {1, -1, -1}};

void append(std::vector<DopAxis>& axes, const std::vector<DopAxis>& more) {
  for (const DopAxis& axis : more) axes.push_back(normalized(axis));
}

// The next one always the furthest from those before, as lines.
void sort_far_first(std::vector<DopAxis>& axes) {
  const auto nearness = [&](std::size_t i, std::size_t count) {
    double most = 0.0;
    for (std::size_t k = 0; k < count; ++k) most = std::max(most, std::abs(dot(axes[i], axes[k])));
    return most;
  };
  for (std::size_t next = 3; next < axes.size(); ++next) {
    std::size_t best = next;
    for (std::size_t i = next + 1; i < axes.size(); ++i) {
      if (nearness(i, next) < nearness(best, next) - 1e-9) best = i;
    }
    std::swap(axes[next], axes[best]);
  }
}

// The axes beyond the coordinate axes repel each other and those, as charges at both ends of each. Only correctly
// rounded operations, so the same everywhere.
std::vector<DopAxis> spread_axes(std::size_t count) {
  std::vector<DopAxis> axes = kCoordinateAxes;
  core::RandomStream random(count, core::Purpose::kParameters);
  while (axes.size() < count)
    axes.push_back(normalized({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)}));
  for (int round = 0; round < 500; ++round) {
    const double step = 0.02 / (1.0 + 0.02 * round);
    for (std::size_t i = 3; i < count; ++i) {
      DopAxis force = {0, 0, 0};
      for (std::size_t k = 0; k < count; ++k) {
        if (k == i) continue;
        for (const double sign : {1.0, -1.0}) {
          const DopAxis other = {sign * axes[k][0], sign * axes[k][1], sign * axes[k][2]};
          const DopAxis away = difference(axes[i], other);
          const double squared = dot(away, away);
          const double strength = 1.0 / (squared * std::sqrt(squared));
          for (std::size_t c = 0; c < 3; ++c) force[c] += strength * away[c];
        }
      }
      axes[i] = normalized({axes[i][0] + step * force[0], axes[i][1] + step * force[1], axes[i][2] + step * force[2]});
    }
  }
  return axes;
}

std::vector<DopAxis> axes_of(int k) {
  std::vector<DopAxis> axes = kCoordinateAxes;
  if (k == 14 || k == 26) append(axes, kCorners);
  if (k == 18 || k == 26) append(axes, kEdges);
  if (k == 24 || k == 32 || k == 46) axes = spread_axes(static_cast<std::size_t>(k) / 2);
  sort_far_first(axes);
  return axes;
}

}  // namespace

template <int k>
const DopDirections& DopDirections::made_once() {
  static const DopDirections kMade(axes_of(k));
  return kMade;
}

const DopDirections& DopDirections::of(int k) {
  switch (k) {
    case 6:
      return made_once<6>();
    case 14:
      return made_once<14>();
    case 18:
      return made_once<18>();
    case 24:
      return made_once<24>();
    case 26:
      return made_once<26>();
    case 32:
      return made_once<32>();
    default:
      PRESCENE_CHECK(k == 46);
      return made_once<46>();
  }
}

DopDirections::DopDirections(std::vector<DopAxis> axes) : axes_(std::move(axes)) {
  find_facets();
  link_facets();
  for (std::size_t octant = 0; octant < 8; ++octant) {
    for (std::size_t longest = 0; longest < 3; ++longest) {
      DopAxis middle = {1, 1, 1};
      middle[longest] = 2;
      for (std::size_t c = 0; c < 3; ++c) middle[c] *= (octant >> c & 1U) != 0 ? -1.0 : 1.0;
      starts_[3 * octant + longest] = static_cast<std::uint8_t>(walk(0, middle));
    }
  }
}

DopAxis DopDirections::direction(std::size_t i) const {
  if (i < axes_.size()) return axes_[i];
  const DopAxis& axis = axes_[i - axes_.size()];
  return {-axis[0], -axis[1], -axis[2]};
}

// The facets of the convex hull of all directions, by trying all triples: once, for at most 46 points.
void DopDirections::find_facets() {
  const std::size_t count = 2 * axes_.size();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = i + 1; k < count; ++k) {
      for (std::size_t l = k + 1; l < count; ++l) {
        DopAxis a = direction(i);
        DopAxis b = direction(k);
        DopAxis c = direction(l);
        std::array<std::size_t, 3> corners = {i, k, l};
        DopAxis normal = cross(difference(b, a), difference(c, a));
        if (dot(normal, a) < 0.0) {
          std::swap(b, c);
          std::swap(corners[1], corners[2]);
          normal = {-normal[0], -normal[1], -normal[2]};
        }
        const double height = dot(normal, a);
        if (height < 1e-9) continue;  // Through the middle.
        bool outermost = true;
        for (std::size_t p = 0; p < count && outermost; ++p) {
          if (p != i && p != k && p != l) outermost = dot(normal, direction(p)) < height;
        }
        if (!outermost) continue;
        Facet facet{};
        for (std::size_t n = 0; n < 3; ++n) facet.corners[n] = static_cast<std::uint8_t>(corners[n]);
        const double volume = dot(a, cross(b, c));
        const std::array<DopAxis, 3> rows = {cross(b, c), cross(c, a), cross(a, b)};
        for (std::size_t n = 0; n < 3; ++n)
          facet.inverse[n] = {rows[n][0] / volume, rows[n][1] / volume, rows[n][2] / volume};
        facets_.push_back(facet);
      }
    }
  }
  PRESCENE_CHECK(facets_.size() == 2 * count - 4);  // Euler: triangles only, and closed.
}

void DopDirections::link_facets() {
  const auto has = [](const Facet& facet, std::uint8_t corner) {
    return std::find(facet.corners.begin(), facet.corners.end(), corner) != facet.corners.end();
  };
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    for (std::size_t n = 0; n < 3; ++n) {
      for (std::size_t other = 0; other < facets_.size(); ++other) {
        if (other != f && has(facets_[other], facets_[f].corners[(n + 1) % 3]) &&
            has(facets_[other], facets_[f].corners[(n + 2) % 3]))
          facets_[f].neighbours[n] = static_cast<std::uint8_t>(other);
      }
    }
  }
}

// Across the edge beyond which the direction lies, until it lies beyond none. On the hull of points of a sphere, a
// Delaunay triangulation, such a walk ends; rounding on an edge ends it after as many steps as there are facets.
std::size_t DopDirections::walk(std::size_t facet, const DopAxis& direction) const {
  for (std::size_t step = 0; step < facets_.size(); ++step) {
    const Facet& at = facets_[facet];
    std::size_t lowest = 0;
    double least = dot(at.inverse[0], direction);
    for (std::size_t n = 1; n < 3; ++n) {
      const double weight = dot(at.inverse[n], direction);
      if (weight < least) {
        least = weight;
        lowest = n;
      }
    }
    if (least >= 0.0) break;
    facet = at.neighbours[lowest];
  }
  return facet;
}

DopCone DopDirections::cone(const DopAxis& target) const {
  std::size_t octant = 0;
  std::size_t longest = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    if (target[c] < 0.0) octant |= std::size_t{1} << c;
    if (std::abs(target[c]) > std::abs(target[longest])) longest = c;
  }
  const Facet& facet = facets_[walk(starts_[3 * octant + longest], target)];
  DopCone cone{.directions = facet.corners, .weights = {}};
  for (std::size_t n = 0; n < 3; ++n) cone.weights[n] = std::max(0.0, dot(facet.inverse[n], target));
  return cone;
}

}  // namespace prescene::collision
