// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/weigh_print.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "prescene/filter/proposals/render_scene.h"

namespace prescene::filter {
namespace {

using belief::ObjectBelief;
using belief::Particle;
using geometry::SymmetryGroup;

constexpr double kShapeTolerance = 0.003;  // m; what depth can't tell apart
constexpr int kTurns = 72;                 // compared about a continuous axis
constexpr int kMostPrintRivals = 4;        // whose turns are refined
constexpr double kHeadTurn = 0.035;        // rad; particles nearer than this, ...
constexpr double kHeadShift = 0.004;       // m; ... and than this, are compared with the print at one pose
constexpr double kStep = 0.06;             // rad of a turn, between the poses through which a parabola is put
constexpr int kMostSteps = 3;              // of a climb in one frame
constexpr double kTurnError = 0.02;        // rad, of a measured turn: errors that all frames share
constexpr double kKnownTurn = 0.01;        // rad; a turn that is known so well is measured no more
constexpr double kOtherTurn = 0.12;        // rad; a rival nearer than this is no other
constexpr double kMeasuredTurn = 0.25;     // rad; the turn of particles within this of the heaviest one ...
constexpr double kMeasuredShift = 0.02;    // m; ... and within this is measured with its
constexpr double kPrinted = 1.0;           // nats from which on something is seen of the print
constexpr double kStays = 0.5;             // no particle leaves a pose that is more probable than this
constexpr double kLeastShare = 0.02;       // rivals that are less probable get no particle

/// A motion of the body that keeps its shape.
Pose about_point(const geometry::Quaterniond& rotation, const Vector3d& p_BoC) {
  return {rotation, p_BoC - rotation * p_BoC};
}

Pose turned(const SymmetryGroup& symmetry, double angle) {
  return about_point(geometry::exp_rotation(angle * *symmetry.axis), symmetry.p_BoC);
}

/// How well poses agree with the print, in nats, with one common share of independent cells.
class PrintScore {
 public:
  PrintScore(const PrintedModel& printed, const FilterFrame& frame, const belief::Observation& observation,
             const Pose& X_WO, int cells)
      : X_CW_(frame.X_CW),
        view_(printed.print, observation.frame.camera, *observation.frame.depth, *observation.frame.color,
              frame.X_CW * X_WO, cells),
        independent_(view_.independent_share(frame.X_CW * X_WO)) {}

  PrintMatch match(const Pose& X_WO) const { return view_.match(X_CW_ * X_WO); }
  double log_ratio(const Pose& X_WO) const { return match(X_WO).log_ratio(independent_); }
  double independent() const { return independent_; }

 private:
  Pose X_CW_;
  PrintView view_;
  double independent_;
};

bool is_near(const Pose& a, const Pose& b, double shift, double turn) {
  const Vector6d d = geometry::box_minus(a, b);
  return d.head<3>().norm() < turn && d.tail<3>().norm() < shift;
}

/// The turn about the shape's axis at which the print agrees best, near a pose.
struct MeasuredTurn {
  double angle = 0.0;     ///< From the pose, rad.
  double variance = 0.0;  ///< rad^2
};

std::optional<MeasuredTurn> measured_turn(const PrintScore& score, const SymmetryGroup& symmetry, const Pose& X_WO) {
  const auto at = [&](int step) { return score.log_ratio(X_WO * turned(symmetry, step * kStep)); };
  int middle = 0;
  double here = at(0), less = at(-1), more = at(1);
  for (int k = 0; k < kMostSteps && std::max(less, more) > here; ++k) {
    if (more > less) {
      ++middle;
      less = here, here = more, more = at(middle + 1);
    } else {
      --middle;
      more = here, here = less, less = at(middle - 1);
    }
  }
  const double bend = 2.0 * here - less - more;
  if (here < kPrinted || std::max(less, more) > here || !(bend > 0.0)) return std::nullopt;
  MeasuredTurn turn;
  turn.angle = kStep * (middle + 0.5 * (more - less) / bend);
  turn.variance = kStep * kStep / bend + kTurnError * kTurnError;
  return turn;
}

/// The particle with a turn of the body about a point measured, relative to its mean.
void measure(const SymmetryGroup& symmetry, double angle, double variance, Particle& particle) {
  Eigen::Matrix<double, 12, 1> along = Eigen::Matrix<double, 12, 1>::Zero();
  along.head<3>() = *symmetry.axis;
  const Eigen::Matrix<double, 12, 1> spread = particle.covariance * along;
  const double prior = along.dot(spread);
  if (!(prior > kKnownTurn * kKnownTurn)) return;
  const Eigen::Matrix<double, 12, 1> gain = spread / (prior + variance);
  // The axis stays where it is: the turn's own part is made about it, the rest as the covariance says.
  const double turn = gain.dot(along) * angle;
  const Vector6d rest = gain.head<6>() * angle - turn * along.head<6>();
  const Vector3d shift_of_turn = particle.X_WO.rotation * symmetry.axis->cross(symmetry.p_BoC) * -turn;
  Vector6d d = rest;
  d.tail<3>() -= shift_of_turn;
  particle.X_WO = geometry::normalized(geometry::box_plus(particle.X_WO * turned(symmetry, turn), d));
  particle.V_WO.angular += gain.segment<3>(6) * angle;
  particle.V_WO.linear += gain.tail<3>() * angle;
  const belief::Matrix12d covariance = particle.covariance - gain * spread.transpose();
  particle.covariance = 0.5 * (covariance + covariance.transpose());
}

/// The body turned within its own shape: its frame's axes turn, where its surface is stays.
void move_within_shape(const Pose& X_OS, Particle& particle) {
  // An error e of the body's rotation is S^T e in its new axes, and moves its new origin.
  belief::Matrix12d to_new = belief::Matrix12d::Identity();
  to_new.topLeftCorner<3, 3>() = X_OS.rotation.conjugate().toRotationMatrix();
  to_new.block<3, 3>(3, 0) = -(particle.X_WO.rotation.toRotationMatrix() * geometry::cross_matrix(X_OS.translation));
  particle.covariance = to_new * belief::Matrix12d(particle.covariance) * to_new.transpose();
  particle.V_WO = geometry::shifted(particle.V_WO, particle.X_WO.rotation * X_OS.translation);
  particle.X_WO = geometry::normalized(particle.X_WO * X_OS);
}

std::vector<Pose> rival_motions(const SymmetryGroup& symmetry) {
  std::vector<Pose> motions;
  if (symmetry.ball) return motions;
  std::vector<geometry::Quaterniond> rotations = {geometry::Quaterniond::Identity()};
  rotations.insert(rotations.end(), symmetry.rotations.begin(), symmetry.rotations.end());
  const int turns = symmetry.axis ? kTurns : 1;
  for (std::size_t i = 0; i < rotations.size(); ++i)
    for (int k = 0; k < turns; ++k) {
      if (i == 0 && k == 0) continue;
      const Pose about = about_point(rotations[i], symmetry.p_BoC);
      motions.push_back(symmetry.axis ? about * turned(symmetry, 2.0 * std::numbers::pi * k / kTurns) : about);
    }
  return motions;
}

struct PrintRival {
  Pose X_OS;  ///< From the present pose.
  double log_ratio = 0.0;
  double share = 0.0;
};

/// The most probable rivals, with their turns refined; the first is the present pose.
std::vector<PrintRival> compared_rivals(const PrintedModel& printed, const PrintScore& score, const Pose& X_WO,
                                        double rival_prior) {
  const SymmetryGroup& symmetry = printed.shape_symmetry;
  std::vector<PrintRival> rivals;
  for (const Pose& motion : rival_motions(symmetry)) rivals.push_back({motion, score.log_ratio(X_WO * motion)});
  std::stable_sort(rivals.begin(), rivals.end(),
                   [](const PrintRival& a, const PrintRival& b) { return a.log_ratio > b.log_ratio; });
  std::vector<PrintRival> best = {{Pose::identity(), score.log_ratio(X_WO)}};
  for (const PrintRival& rival : rivals) {
    if (best.size() > static_cast<std::size_t>(kMostPrintRivals)) break;
    PrintRival refined = rival;
    refined.log_ratio = score.log_ratio(X_WO * rival.X_OS);
    if (symmetry.axis)
      if (const auto turn = measured_turn(score, symmetry, X_WO * rival.X_OS)) {
        refined.X_OS = rival.X_OS * turned(symmetry, turn->angle);
        refined.log_ratio = score.log_ratio(X_WO * refined.X_OS);
      }
    const bool is_other = std::none_of(best.begin(), best.end(), [&](const PrintRival& other) {
      return geometry::log_rotation(other.X_OS.rotation.conjugate() * refined.X_OS.rotation).norm() < kOtherTurn;
    });
    if (is_other) best.push_back(refined);
  }
  double total = 0.0;
  const double largest = std::max_element(best.begin(), best.end(), [](const PrintRival& a, const PrintRival& b) {
                           return a.log_ratio < b.log_ratio;
                         })->log_ratio;
  for (std::size_t i = 0; i < best.size(); ++i) {
    const double prior = i == 0 ? 1.0 - rival_prior : rival_prior / static_cast<double>(best.size() - 1);
    best[i].share = prior * std::exp(best[i].log_ratio - largest);
    total += best[i].share;
  }
  for (PrintRival& rival : best) rival.share /= total;
  return best;
}

/// Moves particles near the heaviest one to the rivals, in proportion to their shares; together they keep their weight.
bool spread_over(const std::vector<PrintRival>& rivals, const std::vector<std::size_t>& members, ObjectBelief& object) {
  std::vector<std::size_t> order = members;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return object.particles[a].log_weight > object.particles[b].log_weight;
  });
  // The heaviest particle goes to the most probable rival, and so on around.
  std::vector<std::size_t> by_share;
  for (std::size_t k = 0; k < rivals.size(); ++k)
    if (rivals[k].share >= kLeastShare) by_share.push_back(k);
  std::stable_sort(by_share.begin(), by_share.end(),
                   [&](std::size_t a, std::size_t b) { return rivals[a].share > rivals[b].share; });
  if (by_share.size() > order.size()) by_share.resize(order.size());
  if (by_share.empty() || (by_share.size() == 1 && by_share.front() == 0)) return false;
  double total = 0.0, kept = 0.0;
  for (const std::size_t i : order) total += std::exp(object.particles[i].log_weight);
  for (const std::size_t k : by_share) kept += rivals[k].share;
  std::vector<std::vector<std::size_t>> groups(by_share.size());
  for (std::size_t n = 0; n < order.size(); ++n) {
    // To the one that lacks most of its share.
    std::size_t to = 0;
    double most = -1.0;
    for (std::size_t g = 0; g < by_share.size(); ++g) {
      const double lacks = groups[g].empty()
                               ? 2.0 - 1e-3 * static_cast<double>(g)
                               : rivals[by_share[g]].share / kept -
                                     static_cast<double>(groups[g].size()) / static_cast<double>(order.size());
      if (lacks > most) most = lacks, to = g;
    }
    groups[to].push_back(order[n]);
  }
  for (std::size_t g = 0; g < groups.size(); ++g) {
    double weight = 0.0;
    for (const std::size_t i : groups[g]) weight += std::exp(object.particles[i].log_weight);
    const double wanted = total * rivals[by_share[g]].share / kept;
    for (const std::size_t i : groups[g]) {
      Particle& particle = object.particles[i];
      particle.log_weight += std::log(std::max(wanted, 1e-12)) - std::log(std::max(weight, 1e-300));
      if (by_share[g] != 0) move_within_shape(rivals[by_share[g]].X_OS, particle);
    }
  }
  belief::normalize(object.particles);
  return by_share.front() != 0;
}

}  // namespace

const PrintedModel* PrintCache::get(const belief::ObjectModel& model, MeshCache& meshes) {
  if (!model.look || !model.visual || model.surface != belief::SurfaceKind::kOpaque) return nullptr;
  for (const auto& entry : entries_)
    if (entry->visual == model.visual && entry->look == model.look && entry->color == model.color &&
        entry->symmetry == model.symmetry)
      return entry->model.get();
  auto entry = std::make_unique<Entry>(Entry{model.visual, model.look, model.color, model.symmetry, nullptr});
  auto printed = std::make_unique<PrintedModel>();
  printed->print = SurfacePrint(*meshes.get(model, MeshDetail::kDisplay), material_of(model.surface, model.color));
  if (printed->print.says_anything()) {
    printed->shape_symmetry =
        model.symmetry.trivial() ? geometry::suggest_symmetry(*model.visual, kShapeTolerance) : model.symmetry;
    entry->model = std::move(printed);
  }
  entries_.push_back(std::move(entry));
  return entries_.back()->model.get();
}

RivalLook rival_look(const WeighPrintOptions& options, const ObjectBelief& object, std::uint64_t frame, bool found) {
  if (found) return RivalLook::kFound;
  if (object.state != belief::TrackState::kTracked) return RivalLook::kNone;
  const auto every = static_cast<std::uint64_t>(std::max(1, options.rivals_every));
  return frame % every == 1 % every ? RivalLook::kTracked : RivalLook::kNone;  // in the first frame, too
}

std::vector<Pose> rival_poses(const SymmetryGroup& symmetry, const Pose& X_WO) {
  std::vector<Pose> poses;
  for (const Pose& motion : rival_motions(symmetry)) poses.push_back(X_WO * motion);
  return poses;
}

PrintReport weigh_print(const PrintedModel& printed, const FilterFrame& frame, const belief::Observation& observation,
                        const WeighPrintOptions& options, RivalLook look, ObjectBelief& object) {
  PrintReport report;
  const bool seen = object.state == belief::TrackState::kTracked || object.state == belief::TrackState::kDoubtful;
  if (!options.use || !seen || !observation.frame.color || !observation.frame.depth) return report;
  const Pose X_WO = belief::heaviest(object.particles).X_WO;
  const PrintScore score(printed, frame, observation, X_WO, options.cells);

  // Each of the poses that differ, once.
  std::vector<Pose> heads;
  std::vector<double> log_ratios;
  std::vector<std::size_t> head_of(object.particles.size(), 0);
  std::vector<std::size_t> order(object.particles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return object.particles[a].log_weight > object.particles[b].log_weight;
  });
  for (const std::size_t i : order) {
    const Pose& pose = object.particles[i].X_WO;
    std::size_t head = 0;
    while (head < heads.size() && !is_near(pose, heads[head], kHeadShift, kHeadTurn)) ++head;
    if (head == heads.size()) {
      heads.push_back(pose);
      log_ratios.push_back(score.log_ratio(pose));
    }
    head_of[i] = head;
  }
  for (std::size_t i = 0; i < object.particles.size(); ++i)
    object.particles[i].log_weight += options.frame_share * log_ratios[head_of[i]];
  belief::normalize(object.particles);

  const SymmetryGroup& symmetry = printed.shape_symmetry;
  const Pose X_WO_best = belief::heaviest(object.particles).X_WO;
  if (look != RivalLook::kNone && !symmetry.trivial()) {
    const double prior = look == RivalLook::kFound ? static_cast<double>(kMostPrintRivals) / (kMostPrintRivals + 1)
                                                   : options.rival_prior;
    const std::vector<PrintRival> rivals = compared_rivals(printed, score, X_WO_best, prior);
    const bool any_printed =
        std::any_of(rivals.begin(), rivals.end(), [](const PrintRival& rival) { return rival.log_ratio >= kPrinted; });
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < object.particles.size(); ++i)
      if (is_near(object.particles[i].X_WO, X_WO_best, kMeasuredShift, kMeasuredTurn)) members.push_back(i);
    // Where a thing is printed otherwise, a wrong pose may agree a little by chance, and in every frame anew: a frame
    // is to decide by itself.
    if (any_printed && rivals.front().share < kStays) report.turned = spread_over(rivals, members, object);
    // That it was turned is no motion that anything is learned from.
    if (report.turned) object.motion = {}, object.grip = {};
  }
  const Pose X_WO_now = belief::heaviest(object.particles).X_WO;
  if (symmetry.axis) {
    if (const auto turn = measured_turn(score, symmetry, X_WO_now))
      for (Particle& particle : object.particles) {
        const Vector6d from = geometry::box_minus(particle.X_WO, X_WO_now);
        if (from.head<3>().norm() > kMeasuredTurn || from.tail<3>().norm() > kMeasuredShift) continue;
        measure(symmetry, turn->angle - symmetry.axis->dot(from.head<3>()), turn->variance, particle);
      }
  }
  const PrintMatch match = score.match(belief::heaviest(object.particles).X_WO);
  report.log_ratio = match.log_ratio(score.independent());
  return report;
}

}  // namespace prescene::filter
