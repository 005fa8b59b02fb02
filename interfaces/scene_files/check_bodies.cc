// SPDX-License-Identifier: Apache-2.0
// Centres of mass and inertias that don't go with the shape they belong to: mostly a slip of units.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "prescene/core/text.h"
#include "prescene/geometry/dense_solvers.h"
#include "read_scene_parts.h"

namespace prescene::interfaces {
namespace {

using belief::ObjectModel;
using geometry::Box;
using geometry::Matrix3d;
using geometry::Vector3d;

std::string list_text(const Vector3d& values) {
  return "[" + core::rounded_text(values.x()) + ", " + core::rounded_text(values.y()) + ", " +
         core::rounded_text(values.z()) + "]";
}

double farthest_corner(const Box& bounds, const Vector3d& from) {
  return (from - bounds.min()).cwiseAbs().cwiseMax((from - bounds.max()).cwiseAbs()).norm();
}

void check_center(const LocatedValue& at, const Box& bounds, const Vector3d& center, Problems& problems) {
  const double size = bounds.diagonal().norm(), outside = bounds.exteriorDistance(center);
  if (outside <= 0.01 * size) return;
  std::string remedy;
  for (const auto& [unit, factor] : {std::pair("millimetres", 1e-3), std::pair("centimetres", 1e-2)})
    if (bounds.exteriorDistance(factor * center) <= 0.0)
      remedy.append(remedy.empty() ? "" : "; ").append(unit) += "? then write " + list_text(factor * center);
  if (remedy.empty()) remedy = "check it: metres, in the model's frame";
  const std::string reason = "the centre of mass lies " + core::rounded_text(outside) + " m outside of the shape, " +
                             core::rounded_text(size) + " m in size";
  // As far outside as the shape is large; nearer, the shape may stand for a part of the body.
  outside > size ? problems.add(at.place, at.path, reason, remedy) : problems.warn(at.place, at.path, reason, remedy);
}

// The unit in which this inertia would be about that of the shape, as the map has it.
std::string inertia_guess(const Matrix3d& given, const Matrix3d& uniform, double given_over_unit, bool is_unit) {
  struct Guess {
    const char* name;
    double factor;
    bool unit;
  };
  static constexpr std::array kGuesses{Guess{"mm^2", 1e-6, true}, Guess{"cm^2", 1e-4, true},
                                       Guess{"kg mm^2", 1e-6, false}, Guess{"g cm^2", 1e-7, false},
                                       Guess{"kg cm^2", 1e-4, false}};
  for (const Guess& guess : kGuesses) {
    const double ratio = guess.factor * given.trace() / uniform.trace();
    if (guess.unit != is_unit || ratio < 0.2 || ratio > 5.0) continue;
    return std::string(guess.name) + "? then write " +
           list_text(guess.factor * given_over_unit * Vector3d(given.diagonal()));
  }
  return std::string("check its unit (") + (is_unit ? "m^2" : "kg m^2") + ") and the sizes (m)";
}

}  // namespace

void check_mass_distribution(const MassPlaces& at, const ObjectModel& model, Problems& problems) {
  if (model.collision.empty() || (!at.center && !at.inertia)) return;
  const Box bounds = geometry::bounding_box(belief::collision_mesh(model));
  if (bounds.isEmpty()) return;
  const Vector3d center = belief::mean(model.center_of_mass);
  const std::size_t before = problems.errors().size();
  if (at.center) check_center(*at.center, bounds, center, problems);
  if (!at.inertia || problems.errors().size() > before) return;

  const double mass = belief::mean(model.mass), size = bounds.diagonal().norm();
  const Vector3d moments = geometry::symmetric_eigen_3(model.unit_inertia).values;
  const double least = moments[0], largest = moments[2];
  // No mass is farther from its centre than the farthest corner; of all bodies of this mass and no longer than the
  // shape, a needle of the densest metal turns most easily.
  const double farthest = farthest_corner(bounds, center);
  const double needle = mass / (2.0 * std::numbers::pi * kDensity.high * size);
  // Twice the radius of gyration and half of it: the shape may stand for a part of the body.
  const bool too_large = largest > 4.0 * farthest * farthest, too_small = least < 0.25 * needle;
  Matrix3d uniform = Matrix3d::Zero();
  if (const auto derived = belief::with_derived_properties(model)) uniform = derived->unit_inertia;
  const double scale = at.is_unit ? 1.0 : mass;
  if (too_large || too_small) {
    const std::string remedy = uniform.isZero() ? "check its unit and the sizes (m)"
                                                : inertia_guess(model.unit_inertia, uniform, scale, at.is_unit);
    problems.add(at.inertia->place, at.inertia->path,
                 "a radius of gyration of " + core::rounded_text(std::sqrt(too_large ? largest : least)) +
                     (too_large ? " m is more than the shape can have, " + core::rounded_text(size) + " m in size"
                                : " m is less than any body of this mass and size can have"),
                 remedy);
    return;
  }
  if (uniform.isZero()) return;
  // About each axis of the shape's own: a fifth of the radius of gyration, or five times.
  const Vector3d ratio = model.unit_inertia.diagonal().cwiseQuotient(uniform.diagonal());
  if (largest <= farthest * farthest && ratio.minCoeff() >= 1.0 / 25.0 && ratio.maxCoeff() <= 25.0) return;
  problems.warn(at.inertia->place, at.inertia->path,
                "it is far from that of the shape at uniform density, " + list_text(scale * uniform.diagonal()),
                inertia_guess(model.unit_inertia, uniform, scale, at.is_unit));
}

}  // namespace prescene::interfaces
