// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/certifier.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "certified_motion.h"
#include "prescene/belief/body_names.h"
#include "prescene/simulation/outcomes/spill_levels.h"

namespace prescene::simulation {
namespace {

enum class Truth { kNo, kYes, kPerhaps };

Truth negated(Truth truth) {
  if (truth == Truth::kPerhaps) return truth;
  return truth == Truth::kYes ? Truth::kNo : Truth::kYes;
}

Truth when(bool yes, bool no) { return yes ? Truth::kYes : no ? Truth::kNo : Truth::kPerhaps; }

// rad: kept from where another answer begins.
constexpr double kAngleRoom = 0.01;
// Share of its radius that a rounded corner lies inside of the sharp one.
constexpr double kCornerLoss = 0.7320508;

/// Ways out of a volume and into it for the centre of mass of one object.
struct Passage {
  std::shared_ptr<const SpillLevels> leave, enter;
};

/// Farthest that a box (its centre and half edges, in W) lies from a volume's centre along the volume's axes, and the
/// nearest.
struct Span {
  Vector3d nearest, farthest;
};
Span span_of(const belief::InsideVolume& volume, const Vector3d& low, const Vector3d& high) {
  const geometry::Matrix3d R_VW = volume.X_WV.rotation.toRotationMatrix().transpose();
  const Vector3d center = R_VW * (0.5 * (low + high) - volume.X_WV.translation);
  const Vector3d half = R_VW.cwiseAbs() * (0.5 * (high - low));
  return {(center.cwiseAbs() - half).cwiseMax(0.0), center.cwiseAbs() + half};
}
/// Whether the origin may be outside (inside) of the volume with the centre of mass, `offset` m from it, in a box.
bool may_be_outside(const belief::InsideVolume& volume, double offset, const Vector3d& low, const Vector3d& high) {
  return (span_of(volume, low, high).farthest.array() + offset > 0.5 * volume.size.array()).any();
}
bool may_be_inside(const belief::InsideVolume& volume, double offset, const Vector3d& low, const Vector3d& high) {
  return (span_of(volume, low, high).nearest.array() - offset <= 0.5 * volume.size.array()).all();
}

geometry::Box box_of(const belief::InsideVolume& volume) {
  const Vector3d half = volume.X_WV.rotation.toRotationMatrix().cwiseAbs() * (0.5 * volume.size);
  return {volume.X_WV.translation - half, volume.X_WV.translation + half};
}

/// What is known of one object's end.
class Judge {
 public:
  Judge(const belief::Scene& scene, const MotionCertifier& certifier, const std::vector<SureMotion>& motions,
        std::size_t object, const Passage* passage, double seconds_left)
      : scene_(scene),
        certifier_(certifier),
        motions_(motions),
        object_(object),
        motion_(motions[object]),
        known_(certifier.objects()[object]),
        passage_(passage),
        seconds_left_(seconds_left),
        offset_(known_.center_of_mass.norm() + known_.center_play) {}

  Truth operator()(const belief::InsideVolume& volume) const {
    const geometry::Box box = box_of(volume);
    if (box.min().z() > highest_end() + offset_) return Truth::kNo;
    if (passage_ && motion_.highest < passage_->leave->level(motion_.center)) return Truth::kYes;
    if (passage_ && motion_.highest < passage_->enter->level(motion_.center)) return Truth::kNo;
    if (!motion_.lowest) return Truth::kPerhaps;
    const double sideways = motion_.reach + (motion_.trap ? motion_.trap->arm : 0.0);
    const Vector3d low(motion_.center.x() - sideways, motion_.center.y() - sideways, *motion_.lowest);
    const Vector3d high(motion_.center.x() + sideways, motion_.center.y() + sideways, motion_.highest);
    return when(!may_be_outside(volume, offset_, low, high), !may_be_inside(volume, offset_, low, high));
  }
  Truth operator()(const belief::BelowHeight& below) const {
    return when(highest_end() + offset_<below.height, motion_.lowest&& * motion_.lowest - offset_> below.height);
  }
  Truth operator()(const belief::UprightWithin& upright) const {
    if (!motion_.trap) {
      if (!motion_.lowest) return Truth::kPerhaps;
      const double needed =
          least_upright_height(known_.bearing, known_.center_of_mass, upright.axis_O, upright.max_angle + kAngleRoom) -
          known_.center_play - kCornerLoss * known_.edge_radius;
      return when(false, motion_.highest - motion_.plane < needed);
    }
    const Vector3d up_O = -motion_.trap->face_normal_O;
    const double angle = std::atan2(upright.axis_O.cross(up_O).norm(), upright.axis_O.dot(up_O));
    const double tilt = motion_.trap->tilt(motion_.highest - motion_.plane) + kAngleRoom;
    return when(angle + tilt<upright.max_angle, angle - tilt> upright.max_angle);
  }
  Truth operator()(const belief::FaceUp& face) const {
    if (!motion_.trap) return Truth::kPerhaps;
    Eigen::Index axis = 0;
    face.axis_O.cwiseAbs().maxCoeff(&axis);
    const Vector3d asked = (face.axis_O[axis] < 0.0 ? -1.0 : 1.0) * Vector3d::Unit(axis);
    const Vector3d up_O = -motion_.trap->face_normal_O;
    const double tilt = motion_.trap->tilt(motion_.highest - motion_.plane) + kAngleRoom;
    bool surely = true, never = false;
    for (Eigen::Index k = 0; k < 3; ++k) {
      for (const double sign : {-1.0, 1.0}) {
        const Vector3d other = sign * Vector3d::Unit(k);
        if (other.dot(asked) > 0.5) continue;
        // Angle by which the asked axis is nearer to up than the other, between unit vectors a right angle apart or
        // more.
        const double ahead = std::asin(std::clamp((asked - other).normalized().dot(up_O), -1.0, 1.0));
        surely = surely && ahead > tilt;
        never = never || -ahead > tilt;
      }
    }
    return when(surely, never);
  }
  Truth operator()(const belief::RestingOn& resting) const {
    const std::optional<int> body = belief::body_index(scene_, resting.support);
    if (!body || seconds_left_ < certifier_.rooms().settle_time + motion_.slide_time) return Truth::kPerhaps;
    const auto count = static_cast<int>(motions_.size());
    // Lying there it may still lean on what it can reach.
    if (motion_.landing && *body >= count)
      return certifier_.support_above(*body - count, *motion_.landing + 2.0 * known_.outer_radius) ? Truth::kNo
                                                                                                   : Truth::kPerhaps;
    if (!motion_.trap || !certifier_.alone_on_base(motions_, object_)) return Truth::kPerhaps;
    return *body == motion_.base ? Truth::kYes : Truth::kNo;
  }
  template <class Other>
  Truth operator()(const Other&) const {
    return Truth::kPerhaps;
  }

 private:
  /// Of the centre of mass at the end.
  double highest_end() const {
    return motion_.landing ? std::min(motion_.highest, *motion_.landing + known_.outer_radius) : motion_.highest;
  }

  const belief::Scene& scene_;
  const MotionCertifier& certifier_;
  const std::vector<SureMotion>& motions_;
  std::size_t object_;
  const SureMotion& motion_;
  const CertifiedObject& known_;
  const Passage* passage_;
  double seconds_left_;
  double offset_;
};

bool understood(const belief::Condition& condition) {
  if (condition.when != belief::When::kAtEnd) return false;
  if (const auto* volume = std::get_if<belief::InsideVolume>(&condition.predicate)) return !volume->whole;
  return std::holds_alternative<belief::BelowHeight>(condition.predicate) ||
         std::holds_alternative<belief::UprightWithin>(condition.predicate) ||
         std::holds_alternative<belief::FaceUp>(condition.predicate) ||
         std::holds_alternative<belief::RestingOn>(condition.predicate);
}

bool understood(const Variable& variable) {
  return !variable.outcomes.empty() && variable.classes.size() == variable.outcomes.size() + 1 &&
         std::all_of(variable.outcomes.begin(), variable.outcomes.end(), [](const belief::Outcome& outcome) {
           const std::vector<belief::Condition> conditions = belief::all_conditions(outcome);
           return std::all_of(conditions.begin(), conditions.end(),
                              [](const belief::Condition& condition) { return understood(condition); });
         });
}

/// When the last action is over (s from the run's start); nothing when actions do more than let go.
std::optional<double> end_of(const std::vector<belief::Action>& actions) {
  double end = 0.0;
  for (const belief::Action& action : actions) {
    const auto* release = std::get_if<belief::Release>(&action.what);
    if (!release) return std::nullopt;
    end = std::max(end, action.time + release->retreat_duration);
  }
  return end;
}

class EnergyCertifier final : public Certifier {
 public:
  struct Question {
    belief::Condition condition;
    std::optional<Passage> passage;
  };
  struct Answer {
    std::size_t object = 0;
    std::vector<Question> all_of, any_of;
  };

  EnergyCertifier(std::shared_ptr<const belief::Scene> scene, std::unique_ptr<const MotionCertifier> certifier)
      : scene_(std::move(scene)), certifier_(std::move(certifier)) {}

  std::optional<std::vector<int>> classes(const belief::WorldState& state, double seconds_left) const override {
    if (duration - seconds_left < quiet_after || state.time < robot_still_after) return std::nullopt;
    std::vector<SureMotion> motions;
    if (!certifier_->assess(state, seconds_left, motions)) return std::nullopt;
    std::vector<int> found;
    for (const std::vector<Answer>& answers : variables) {
      int which = 0;
      for (const Answer& answer : answers) {
        const Truth truth = judge(answer, motions, seconds_left);
        if (truth == Truth::kPerhaps) return std::nullopt;
        if (truth == Truth::kYes) break;
        ++which;
      }
      found.push_back(which);
    }
    return found;
  }

  std::vector<std::vector<Answer>> variables;
  double duration = 0.0;
  double quiet_after = 0.0;
  double robot_still_after = -std::numeric_limits<double>::infinity();

 private:
  Truth judge(const Answer& answer, const std::vector<SureMotion>& motions, double seconds_left) const {
    const auto truth_of = [&](const Question& question) {
      const Judge judge_of(*scene_, *certifier_, motions, answer.object,
                           question.passage ? &*question.passage : nullptr, seconds_left);
      const Truth one = std::visit(judge_of, question.condition.predicate);
      return question.condition.negated ? negated(one) : one;
    };
    Truth all = Truth::kYes;
    for (const Question& question : answer.all_of) {
      const Truth one = truth_of(question);
      if (one == Truth::kNo) return one;
      if (one == Truth::kPerhaps) all = one;
    }
    if (answer.any_of.empty()) return all;
    Truth any = Truth::kNo;
    for (const Question& question : answer.any_of) {
      const Truth one = truth_of(question);
      if (one == Truth::kYes) return all;
      if (one == Truth::kPerhaps) any = one;
    }
    return any;
  }

  std::shared_ptr<const belief::Scene> scene_;
  std::unique_ptr<const MotionCertifier> certifier_;
};

/// Surfaces are those of sharp things; contacts round their edges by up to `edge_radius`.
Passage passage_of(const belief::InsideVolume& volume, const CertifiedObject& object,
                   const std::vector<geometry::TriangleMesh>& surfaces, double edge_radius, const Rooms& rooms) {
  const double ball_radius = object.inner_radius - kCornerLoss * edge_radius;
  const double offset = object.center_of_mass.norm() + object.center_play;
  const Vector3d air = Vector3d::Constant(std::max(rooms.air, 2.0 * object.inner_radius));
  const geometry::Box box = box_of(volume);
  const geometry::Box domain(box.min() - air, box.max() + air);
  const auto outside = [&](const Vector3d& low, const Vector3d& high) {
    return may_be_outside(volume, offset, low, high);
  };
  const auto inside = [&](const Vector3d& low, const Vector3d& high) {
    return may_be_inside(volume, offset, low, high);
  };
  const auto leave =
      std::make_shared<const SpillLevels>(surfaces, domain, SpillBall{ball_radius, rooms.ball}, outside, true);
  return {leave, std::make_shared<const SpillLevels>(*leave, inside, false)};
}

}  // namespace

std::unique_ptr<const Certifier> make_certifier(const std::shared_ptr<const belief::Scene>& scene,
                                                std::span<const Variable> variables, const RunRequest& request,
                                                const CertifierOptions& options) {
  const std::optional<double> quiet_from = end_of(request.actions);
  if (variables.empty() || !quiet_from || !request.stop.stop_at_rest ||
      !std::all_of(variables.begin(), variables.end(), [](const Variable& variable) { return understood(variable); }))
    return nullptr;
  std::unique_ptr<const MotionCertifier> motions = MotionCertifier::make(*scene, options, request.stop.world_radius);
  if (!motions) return nullptr;
  const std::vector<CertifiedObject>& objects = motions->objects();
  std::vector<geometry::TriangleMesh> surfaces;
  for (const belief::Support& support : scene->supports)
    surfaces.push_back(geometry::transformed(belief::collision_mesh(support.collision), support.X_WS));

  std::vector<std::vector<EnergyCertifier::Answer>> asked;
  for (const Variable& variable : variables) {
    std::vector<EnergyCertifier::Answer>& answers = asked.emplace_back();
    for (const belief::Outcome& outcome : variable.outcomes) {
      const std::optional<int> object = belief::find_object(*scene, outcome.object);
      if (!object) return nullptr;
      EnergyCertifier::Answer& answer = answers.emplace_back();
      answer.object = static_cast<std::size_t>(*object);
      const std::vector<belief::Condition> conditions = belief::all_conditions(outcome);
      for (std::size_t i = 0; i < conditions.size(); ++i) {
        const belief::Condition& condition = conditions[i];
        if (options.cancellation && options.cancellation->requested()) return nullptr;
        EnergyCertifier::Question& question =
            (i < outcome.all_of.size() ? answer.all_of : answer.any_of).emplace_back();
        question.condition = condition;
        const auto* volume = std::get_if<belief::InsideVolume>(&condition.predicate);
        if (volume && objects[answer.object].inner_radius > kCornerLoss * motions->support_edge_radius())
          question.passage =
              passage_of(*volume, objects[answer.object], surfaces, motions->support_edge_radius(), motions->rooms());
      }
    }
  }
  auto certifier = std::make_unique<EnergyCertifier>(scene, std::move(motions));
  certifier->variables = std::move(asked);
  certifier->duration = request.stop.duration;
  certifier->quiet_after = *quiet_from;
  for (const belief::KinematicBody& body : scene->robot)
    if (!body.timeline.empty())
      certifier->robot_still_after = std::max(certifier->robot_still_after, body.timeline.back().time);
  return certifier;
}

}  // namespace prescene::simulation
