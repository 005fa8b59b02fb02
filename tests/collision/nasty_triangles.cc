// SPDX-License-Identifier: Apache-2.0
#include "nasty_triangles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

Vector3d cube_point(core::RandomStream& random) {
  return {random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)};
}

Triangle plain_triangle(core::RandomStream& random, double scale = 1.0, const Vector3d& centre = Vector3d::Zero()) {
  Triangle t;
  for (Vector3f& p : t) p = (centre + scale * cube_point(random)).cast<float>();
  return t;
}

NastyPair plain_pair(core::RandomStream& random) { return {plain_triangle(random), plain_triangle(random)}; }

double power_of_ten(core::RandomStream& random, double low, double high) {
  return std::pow(10.0, random.uniform(low, high));
}

Vector3f inner_point(const Triangle& t, core::RandomStream& random) {
  const double u = random.uniform();
  const double v = random.uniform(0.0, 1.0 - u);
  const Vector3d a = t[0].cast<double>();
  return (a + u * (t[1].cast<double>() - a) + v * (t[2].cast<double>() - a)).cast<float>();
}

NastyPair grid_pair(core::RandomStream& random) {
  NastyPair pair;
  for (Triangle* t : {&pair.a, &pair.b}) {
    for (Vector3f& p : *t) {
      for (int i = 0; i < 3; ++i) p[i] = static_cast<float>(random.uniform_below(3));
    }
  }
  return pair;
}

// Moves all of b so that one of its points, rounded, comes to lie on a point of a.
void bring(NastyPair& pair, const Vector3f& from, const Vector3f& to) {
  const Vector3f shift = to - from;
  for (Vector3f& p : pair.b) p += shift;
}

NastyPair touching_pair(core::RandomStream& random) {
  NastyPair pair = plain_pair(random);
  bring(pair, pair.b[0], inner_point(pair.a, random));
  if (random.uniform_below(2) == 0) {  // The rest of b on one side: it touches or just does not.
    const Vector3f normal = (pair.a[1] - pair.a[0]).cross(pair.a[2] - pair.a[0]);
    for (std::size_t i = 1; i < 3; ++i) {
      const Vector3f arm = pair.b[i] - pair.b[0];
      if (arm.dot(normal) < 0.0F) pair.b[i] = pair.b[0] - arm;
    }
  }
  return pair;
}

NastyPair edge_pair(core::RandomStream& random) {
  NastyPair pair = plain_pair(random);
  const auto s = static_cast<float>(random.uniform());
  const auto t = static_cast<float>(random.uniform());
  bring(pair, pair.b[0] + s * (pair.b[1] - pair.b[0]), pair.a[0] + t * (pair.a[1] - pair.a[0]));
  return pair;
}

NastyPair almost_touching_pair(core::RandomStream& random) {
  NastyPair pair = random.uniform_below(2) == 0 ? touching_pair(random) : edge_pair(random);
  const double size = power_of_ten(random, -9.0, -4.0);  // A statement for each draw fixes their order.
  const Vector3d shift = size * cube_point(random);
  for (Vector3f& p : pair.b) p += shift.cast<float>();
  return pair;
}

void make_needle(Triangle& t, core::RandomStream& random) {
  const Vector3d a = t[0].cast<double>();
  const Vector3d b = t[1].cast<double>();
  const double width = power_of_ten(random, -8.0, -3.0);
  const double along = random.uniform();
  t[2] = (a + along * (b - a) + width * cube_point(random)).cast<float>();
}

NastyPair needle_pair(core::RandomStream& random) {
  NastyPair pair = random.uniform_below(2) == 0 ? touching_pair(random) : plain_pair(random);
  make_needle(pair.a, random);
  if (random.uniform_below(2) == 0) make_needle(pair.b, random);
  return pair;
}

NastyPair neighbours(std::size_t shared, core::RandomStream& random) {
  NastyPair pair = plain_pair(random);
  const std::size_t turn = random.uniform_below(3);
  for (std::size_t i = 0; i < shared; ++i) pair.b[(i + turn) % 3] = pair.a[i];
  // Often bent over almost flat, or just off.
  if (random.uniform_below(2) == 0) pair.b[(shared + turn) % 3] = inner_point(pair.a, random);
  if (random.uniform_below(4) == 0) pair.b[turn].x() += 1e-7F;
  return pair;
}

NastyPair coplanar_pair(core::RandomStream& random) {
  NastyPair pair = random.uniform_below(2) == 0 ? grid_pair(random) : plain_pair(random);
  if (random.uniform_below(2) == 0) {
    const auto axis = static_cast<int>(random.uniform_below(3));
    const auto height = static_cast<float>(random.uniform());
    for (Triangle* t : {&pair.a, &pair.b}) {
      for (Vector3f& p : *t) p[axis] = height;
    }
    return pair;
  }
  const Vector3f slope(0.25F, -0.75F, 0.0F);  // Exactly coplanar for the grid, rounded otherwise.
  for (Triangle* t : {&pair.a, &pair.b}) {
    for (Vector3f& p : *t) p.z() = slope.dot(Vector3f(p.x(), p.y(), 0.0F));
  }
  return pair;
}

NastyPair mixed_pair(core::RandomStream& random) {
  NastyPair pair = plain_pair(random);
  const double scale = power_of_ten(random, -30.0, 0.0);
  const bool at_origin = random.uniform_below(2) == 0;
  const Vector3d centre = at_origin ? Vector3d::Zero() : Vector3d(inner_point(pair.a, random).cast<double>());
  if (at_origin) pair.a[0] = -pair.a[1];  // An edge through the origin, where the tiny one is.
  pair.b = plain_triangle(random, scale, centre);
  return pair;
}

NastyPair degenerate_pair(core::RandomStream& random) {
  NastyPair pair = random.uniform_below(2) == 0 ? touching_pair(random) : grid_pair(random);
  const auto flatten = [&random](Triangle& t) {
    switch (random.uniform_below(4)) {
      case 0:
        t[1] = t[0];
        break;
      case 1:
        t[1] = t[2] = t[0];
        break;
      case 2:
        t[2] = 0.5F * (t[0] + t[1]);
        break;
      default:
        t[0] = t[1] + 2.0F * (t[2] - t[1]);
        break;
    }
  };
  if (random.uniform_below(3) != 0) flatten(pair.a);
  if (random.uniform_below(3) != 0) flatten(pair.b);
  return pair;
}

void scale_pair(NastyPair& pair, const Vector3f& factors) {
  for (Triangle* t : {&pair.a, &pair.b}) {
    for (Vector3f& p : *t) p = p.cwiseProduct(factors);
  }
}

NastyPair denormal_pair(core::RandomStream& random) {
  NastyPair pair = random.uniform_below(2) == 0 ? grid_pair(random) : plain_pair(random);
  scale_pair(pair, Vector3f::Constant(static_cast<float>(power_of_ten(random, -44.0, -38.0))));
  return pair;
}

NastyPair far_pair(core::RandomStream& random) {
  const double distance = power_of_ten(random, 0.0, 8.0);
  const Vector3d centre = distance * cube_point(random);
  const double size = power_of_ten(random, -3.0, 0.0);
  return {plain_triangle(random, size, centre), plain_triangle(random, size, centre)};
}

NastyPair huge_pair(core::RandomStream& random) {
  NastyPair pair{plain_triangle(random, 1e9), plain_triangle(random, 1e9)};
  if (random.uniform_below(2) == 0) {
    const double size = power_of_ten(random, -9.0, 9.0);
    const Vector3f centre = inner_point(pair.a, random);
    pair.b = plain_triangle(random, size, centre.cast<double>());
  }
  return pair;
}

NastyPair scaled_grid_pair(core::RandomStream& random) {
  NastyPair pair = grid_pair(random);
  Vector3f factors;
  for (int i = 0; i < 3; ++i) factors[i] = std::ldexp(1.0F, static_cast<int>(random.uniform_below(150)) - 122);
  scale_pair(pair, factors);
  return pair;
}

NastyPair make(Nastiness nastiness, core::RandomStream& random) {
  switch (nastiness) {
    case Nastiness::kPlain:
      return plain_pair(random);
    case Nastiness::kGrid:
      return grid_pair(random);
    case Nastiness::kTouching:
      return touching_pair(random);
    case Nastiness::kAlmost:
      return almost_touching_pair(random);
    case Nastiness::kEdges:
      return edge_pair(random);
    case Nastiness::kNeedle:
      return needle_pair(random);
    case Nastiness::kSharedCorner:
      return neighbours(1, random);
    case Nastiness::kSharedEdge:
      return neighbours(2, random);
    case Nastiness::kCoplanar:
      return coplanar_pair(random);
    case Nastiness::kMixedScale:
      return mixed_pair(random);
    case Nastiness::kDegenerate:
      return degenerate_pair(random);
    case Nastiness::kDenormal:
      return denormal_pair(random);
    case Nastiness::kFar:
      return far_pair(random);
    case Nastiness::kHuge:
      return huge_pair(random);
    case Nastiness::kGridScaled:
      return scaled_grid_pair(random);
  }
  return {};
}

}  // namespace

std::string_view to_string(Nastiness nastiness) {
  constexpr std::array<std::string_view, kAllNastiness.size()> kNames = {
      "plain",    "grid",        "touching",   "almost",   "edges", "needle", "shared corner", "shared edge",
      "coplanar", "mixed scale", "degenerate", "denormal", "far",   "huge",   "scaled grid"};
  return kNames[static_cast<std::size_t>(nastiness)];
}

NastyPair nasty_pair(Nastiness nastiness, core::RandomStream& random) {
  NastyPair pair = make(nastiness, random);
  for (Triangle* t : {&pair.a, &pair.b}) {
    random.shuffle(std::span<Vector3f>(*t));
    for (Vector3f& p : *t) p = p.cwiseMin(kLargestCoordinate).cwiseMax(-kLargestCoordinate);
  }
  if (random.uniform_below(2) == 0) std::swap(pair.a, pair.b);
  return pair;
}

}  // namespace prescene::collision
