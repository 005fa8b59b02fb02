// SPDX-License-Identifier: Apache-2.0
#include "read_values.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "prescene/core/random.h"
#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

using belief::FixedScalar;
using belief::NormalScalar;
using belief::SampledScalar;
using belief::ScalarDistribution;
using belief::UniformScalar;
using geometry::Matrix6d;
using geometry::Pose;
using geometry::Quaterniond;
using geometry::Vector3d;
using geometry::Vector6d;

constexpr std::size_t kMostSamples = 100'000;

constexpr const char* kScalarForms =
    "give a number, {normal: [mean, deviation]}, {uniform: [low, high]} or {samples: [...]}";

// A deviation has the unit of its quantity, is not negative, and not beyond what the quantity itself may be.
NumberRange deviation_range(const NumberRange& range) {
  return {0.0, std::max(std::abs(range.low), std::abs(range.high)),
          "give a standard deviation of at least 0, no larger than the value itself may be", range.unit};
}

constexpr double kLeastMass = 1e-4;  // of a cut normal distribution: 3.7 deviations from the mean

double mass_between(const NormalScalar& normal) {
  if (normal.standard_deviation <= 0.0) return normal.mean >= normal.low && normal.mean <= normal.high ? 1.0 : 0.0;
  return core::normal_cdf((normal.high - normal.mean) / normal.standard_deviation) -
         core::normal_cdf((normal.low - normal.mean) / normal.standard_deviation);
}

std::string limits_text(const NormalScalar& normal) {
  const auto text = [](double limit, const char* none) {
    return std::abs(limit) < 1e300 ? core::rounded_text(limit) : none;
  };
  return "its min (" + text(normal.low, "none") + ") and its max (" + text(normal.high, "none") + ")";
}

ScalarDistribution read_normal(const LocatedValue& value, Binder& binder, const NumberRange& range, bool cut_low,
                               bool cut_high) {
  Problems& problems = binder.problems();
  NormalScalar normal;
  if (cut_low) normal.low = range.low;
  if (cut_high) normal.high = range.high;
  binder.read("min", normal.low, range);
  binder.read("max", normal.high, range);
  if (normal.low > normal.high) {
    problems.add(value.place, value.path, "min is above max", "give a min below the max");
    return FixedScalar{};  // whoever asks for a mean before the problems are reported needs one that exists
  }
  if (value.kind != LocatedValue::Kind::kList || value.items.size() != 2) {
    report_type(value, problems, "give [mean, standard deviation]");
    return normal;
  }
  normal.mean = read_number(value.items[0], problems, range).value_or(0.0);
  normal.standard_deviation = read_number(value.items[1], problems, deviation_range(range)).value_or(0.0);
  if (mass_between(normal) < kLeastMass)
    problems.add(value.place, value.path,
                 "hardly anything of a normal distribution of mean " + core::rounded_text(normal.mean) +
                     " and deviation " + core::rounded_text(normal.standard_deviation) + " lies between " +
                     limits_text(normal),
                 "give a min below the mean and a max above it, or another mean");
  return normal;
}

ScalarDistribution read_uniform(const LocatedValue& value, Problems& problems, const NumberRange& range) {
  const std::optional<std::vector<double>> ends = read_numbers(value, problems, 2, range);
  if (!ends) return FixedScalar{};
  if ((*ends)[0] > (*ends)[1]) {
    problems.add(value.place, value.path, "the interval runs backwards", "give [lowest, highest]");
    return FixedScalar{};
  }
  return UniformScalar{(*ends)[0], (*ends)[1]};
}

// A non-empty list that is not too long, or a report.
bool is_sample_list(const LocatedValue& value, Problems& problems) {
  if (value.kind != LocatedValue::Kind::kList || value.items.empty()) {
    report_type(value, problems, "give a list of at least one sample");
    return false;
  }
  if (value.items.size() > kMostSamples) {
    problems.add(value.place, value.path, std::to_string(value.items.size()) + " samples are too many",
                 "give at most " + std::to_string(kMostSamples));
    return false;
  }
  return true;
}

ScalarDistribution read_samples(const LocatedValue& value, Problems& problems, const NumberRange& range) {
  if (!is_sample_list(value, problems)) return FixedScalar{};
  SampledScalar sampled;
  for (const LocatedValue& item : value.items)
    sampled.samples.push_back(read_number(item, problems, range).value_or(0.0));
  return sampled;
}

bool is_fixed(const belief::Vector3Distribution& vector) { return belief::dimensions(vector) == 0; }

// [x, y, z], or one number for all three.
Vector3d read_deviations(const LocatedValue& value, Problems& problems, const NumberRange& range) {
  if (value.kind == LocatedValue::Kind::kScalar)
    return Vector3d::Constant(read_number(value, problems, deviation_range(range)).value_or(0.0));
  return read_vector(value, problems, deviation_range(range));
}

Matrix6d read_covariance(const LocatedValue& value, Problems& problems) {
  Matrix6d covariance = Matrix6d::Zero();
  if (value.kind != LocatedValue::Kind::kList || value.items.size() != 6) {
    report_type(value, problems, "give 6 rows of 6 numbers, order rotation x y z (rad), position x y z (m)");
    return covariance;
  }
  for (std::size_t i = 0; i < 6; ++i) {
    const auto row = read_numbers(value.items[i], problems, 6, {-1e6, 1e6, "give a covariance in rad^2, rad m, m^2"});
    if (!row) return Matrix6d::Zero();
    for (std::size_t j = 0; j < 6; ++j) covariance(static_cast<int>(i), static_cast<int>(j)) = (*row)[j];
  }
  const double scale = covariance.cwiseAbs().maxCoeff();
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > 1e-9 * scale) {
    problems.add(value.place, value.path, "the covariance is not symmetric",
                 "give the same value on both sides of the diagonal");
  } else if (geometry::symmetric_eigenvalues_6(covariance).minCoeff() < -1e-9 * scale) {
    problems.add(value.place, value.path, "the covariance has a negative eigenvalue, which no distribution has",
                 "make the correlations smaller");
  }
  return covariance;
}

belief::PoseDistribution read_normal_pose(const LocatedValue& value, Problems& problems, const Pose& mean) {
  Binder binder(value, problems);
  belief::NormalPose normal{mean, Matrix6d::Zero()};
  const LocatedValue* position = binder.find("position");
  const LocatedValue* rotation = binder.find("rotation_deg");
  if (const LocatedValue* covariance = binder.find("covariance")) {
    if (position || rotation)
      problems.add(covariance->place, covariance->path, "a covariance and deviations exclude each other",
                   "remove one of them");
    normal.covariance = read_covariance(*covariance, problems);
    return normal;
  }
  if (!position && !rotation)
    problems.add(value.place, value.path, "no deviation is given",
                 "give 'position' (m), 'rotation_deg' or 'covariance'");
  Vector6d deviations = Vector6d::Zero();
  if (rotation)
    deviations.head<3>() =
        geometry::kDegree * read_deviations(*rotation, problems, {-180.0, 180.0, "give degrees", "deg"});
  if (position) deviations.tail<3>() = read_deviations(*position, problems, kPosition);
  normal.covariance = deviations.cwiseAbs2().asDiagonal();
  return normal;
}

belief::PoseDistribution read_sampled_pose(const LocatedValue& value, Problems& problems) {
  belief::SampledPose sampled;
  if (!is_sample_list(value, problems)) return belief::FixedPose{};
  for (const LocatedValue& item : value.items) sampled.samples.push_back(read_pose(item, problems));
  return sampled;
}

}  // namespace

ScalarDistribution read_scalar(const LocatedValue& value, Problems& problems, const NumberRange& range, bool cut_low,
                               bool cut_high) {
  if (value.kind != LocatedValue::Kind::kMap) {
    NumberRange number = range;
    if (value.kind != LocatedValue::Kind::kScalar) number.remedy = kScalarForms;
    return FixedScalar{read_number(value, problems, number).value_or(0.0)};
  }
  Binder binder(value, problems);
  std::string which;
  const LocatedValue* form = binder.one_of({"normal", "uniform", "samples"}, kScalarForms, false, &which);
  if (!form) return FixedScalar{};
  if (which == "normal") return read_normal(*form, binder, range, cut_low, cut_high);
  return which == "uniform" ? read_uniform(*form, problems, range) : read_samples(*form, problems, range);
}

belief::Vector3Distribution read_vector_distribution(const LocatedValue& value, Problems& problems,
                                                     const NumberRange& range) {
  if (value.kind == LocatedValue::Kind::kMap) {
    Binder binder(value, problems);
    const LocatedValue* uniform = binder.require("uniform", "give [x, y, z] or {uniform: {from: [..], to: [..]}}");
    if (!uniform) return {};
    Binder box(*uniform, problems);
    const LocatedValue* from_at = box.require("from", "give the lower corner [x, y, z]");
    const LocatedValue* to_at = box.require("to", "give the upper corner [x, y, z]");
    if (!from_at || !to_at) return {};
    const Vector3d from = read_vector(*from_at, problems, range), to = read_vector(*to_at, problems, range);
    if ((from.array() > to.array()).any())
      problems.add(uniform->place, uniform->path, "the box runs backwards", "give the lower corner as 'from'");
    return {UniformScalar{from.x(), to.x()}, UniformScalar{from.y(), to.y()}, UniformScalar{from.z(), to.z()}};
  }
  if (value.kind != LocatedValue::Kind::kList || value.items.size() != 3) {
    report_type(value, problems, "give [x, y, z]");
    return {};
  }
  return {read_scalar(value.items[0], problems, range), read_scalar(value.items[1], problems, range),
          read_scalar(value.items[2], problems, range)};
}

Vector3d read_vector(const LocatedValue& value, Problems& problems, const NumberRange& range) {
  const std::optional<std::vector<double>> numbers = read_numbers(value, problems, 3, range);
  return numbers ? Vector3d((*numbers)[0], (*numbers)[1], (*numbers)[2]) : Vector3d(Vector3d::Zero());
}

Vector3d read_axis(const LocatedValue& value, Problems& problems) {
  constexpr double kMost = std::numeric_limits<double>::max();
  if (value.kind == LocatedValue::Kind::kScalar) {
    static const std::vector<std::string> kAxes{"x", "-x", "y", "-y", "z", "-z", "+x", "+y", "+z"};
    const std::size_t index = read_word(value, problems, kAxes).value_or(4);
    if (index >= 6) return Vector3d::Unit(static_cast<int>(index) - 6);
    return (index % 2 == 0 ? 1.0 : -1.0) * Vector3d::Unit(static_cast<int>(index) / 2);
  }
  Vector3d axis = read_vector(value, problems, {-kMost, kMost, "give a direction as x, -x, y, ... or [x, y, z]"});
  if (std::abs(axis.norm() - 1.0) < 1e-12) return axis;  // keeps its bits
  // Lengths whose squares are too small or too large for a number are lengths, too.
  const double greatest = axis.cwiseAbs().maxCoeff();
  if (!(greatest > 0.0)) {
    problems.add(value.place, value.path, "the axis has no direction",
                 "give x, -x, y, ... or [x, y, z] of some length");
    return Vector3d::UnitZ();
  }
  return (axis / greatest).normalized();
}

namespace {

constexpr const char* kRotationForms =
    "give {quaternion_wxyz: [w, x, y, z]}, {quaternion_xyzw: [x, y, z, w]} as in ROS, {euler_deg: [roll, pitch, yaw]} "
    "or {axis_angle_deg: [x, y, z, angle]}";

/// Of length 1 within what rounding by hand does; made a unit quaternion.
Quaterniond read_quaternion(const LocatedValue& value, Problems& problems, bool real_part_first) {
  const char* remedy =
      real_part_first ? "give a unit quaternion [w, x, y, z]" : "give a unit quaternion [x, y, z, w], as in ROS";
  const auto q = read_numbers(value, problems, 4, {-2.0, 2.0, remedy});
  if (!q) return Quaterniond::Identity();
  const Quaterniond rotation = real_part_first ? Quaterniond((*q)[0], (*q)[1], (*q)[2], (*q)[3])
                                               : Quaterniond((*q)[3], (*q)[0], (*q)[1], (*q)[2]);
  // Hand-written digits are rounded to about three places; more is a mistake (order, sign, a missing number).
  const double error = std::abs(rotation.norm() - 1.0);
  if (error > 0.01) {
    problems.add(value.place, value.path, "the quaternion has length " + core::rounded_text(rotation.norm()), remedy);
    return Quaterniond::Identity();
  }
  return error < 1e-9 ? rotation : rotation.normalized();  // what we wrote ourselves keeps its bits
}

}  // namespace

Quaterniond read_rotation(const LocatedValue& value, Problems& problems) {
  if (value.kind == LocatedValue::Kind::kList) {
    problems.add(value.place, value.path, "a list does not say which number is the real part", kRotationForms);
    return Quaterniond::Identity();
  }
  Binder binder(value, problems);
  std::string which;
  const LocatedValue* form = binder.one_of({"quaternion_wxyz", "quaternion_xyzw", "euler_deg", "axis_angle_deg"},
                                           kRotationForms, false, &which);
  if (!form) return Quaterniond::Identity();
  if (which == "euler_deg") return geometry::rotation_from_euler_deg(read_vector(*form, problems, kAngleDeg));
  if (which != "axis_angle_deg") return read_quaternion(*form, problems, which == "quaternion_wxyz");
  const auto numbers = read_numbers(*form, problems, 4, {-36000.0, 36000.0, "give [x, y, z, angle in degrees]"});
  if (!numbers) return Quaterniond::Identity();
  const Vector3d axis((*numbers)[0], (*numbers)[1], (*numbers)[2]);
  if (axis.norm() < 1e-9) {
    problems.add(form->place, form->path, "the axis has no direction", "give an axis of some length");
    return Quaterniond::Identity();
  }
  return Quaterniond(Eigen::AngleAxisd(geometry::kDegree * (*numbers)[3], axis.normalized()));
}

Pose read_pose_keys(Binder& binder) {
  Pose pose;
  if (const LocatedValue* position = binder.find("position"))
    pose.translation = read_vector(*position, binder.problems(), kPosition);
  if (const LocatedValue* rotation = binder.find("rotation"))
    pose.rotation = read_rotation(*rotation, binder.problems());
  return pose;
}

Pose read_pose(const LocatedValue& value, Problems& problems) {
  Binder binder(value, problems);
  return read_pose_keys(binder);
}

belief::PoseDistribution read_pose_distribution(const LocatedValue& value, Problems& problems) {
  Binder binder(value, problems);
  const LocatedValue* samples = binder.find("samples");
  const LocatedValue* position_at = binder.find("position");
  const LocatedValue* rotation_at = binder.find("rotation");
  const LocatedValue* normal = binder.find("normal");
  if (samples) {
    for (const LocatedValue* other : {position_at, rotation_at, normal})
      if (other) problems.add(other->place, other->path, "samples exclude everything else", "put it into the samples");
    return read_sampled_pose(*samples, problems);
  }
  belief::BoxPose box;
  box.position = position_at ? read_vector_distribution(*position_at, problems, kPosition)
                             : belief::Vector3Distribution::fixed(Vector3d::Zero());
  if (rotation_at && rotation_at->kind == LocatedValue::Kind::kScalar) {
    box.any_rotation = read_word(*rotation_at, problems, {"any"}).has_value();
  } else if (rotation_at) {
    box.rotation = read_rotation(*rotation_at, problems);
  }
  const Pose mean{box.rotation, belief::mean(box.position)};
  if (normal) {
    if (!is_fixed(box.position) || box.any_rotation)
      problems.add(normal->place, normal->path, "it needs a position and a rotation in numbers as its mean",
                   "write the position in numbers, or drop 'normal' and give each coordinate its distribution");
    return read_normal_pose(*normal, problems, mean);
  }
  if (is_fixed(box.position) && !box.any_rotation) return belief::FixedPose{mean};
  return box;
}

belief::Color read_color(const LocatedValue& value, Problems& problems) {
  constexpr const char* kForms = "give [red, green, blue] between 0 and 1, or '#rrggbb' in quotes";
  if (value.kind == LocatedValue::Kind::kScalar) {
    const bool is_hex = value.text.size() == 7 && value.text[0] == '#' &&
                        value.text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos;
    if (!is_hex) {
      report_type(value, problems, kForms);
      return {};
    }
    const auto part = [&](std::size_t at) { return std::stoi(value.text.substr(at, 2), nullptr, 16) / 255.0; };
    return {part(1), part(3), part(5)};
  }
  const Vector3d color = read_vector(value, problems, {0.0, 1.0, kForms});
  return {color.x(), color.y(), color.z()};
}

}  // namespace prescene::interfaces
