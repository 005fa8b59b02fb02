// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/common_flight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include "prescene/belief/robot_motion.h"
#include "prescene/collision/spheres/uncertain_shape_queries.h"
#include "prescene/collision/spheres/uncertain_sphere_queries.h"
#include "prescene/core/check.h"
#include "prescene/simulation/rules/action_draws.h"
#include "prescene/simulation/similarity.h"

namespace prescene::simulation {
namespace {

using collision::OverlapState;
using collision::RelativeUncertainty;
using collision::UncertainOverlap;
using collision::UncertainPose;
using geometry::Pose;
using geometry::Vector6d;

/// The scene with one of its objects, nothing near enough to touch, and what is done with that object.
belief::Scene alone(const belief::Scene& scene, std::size_t object, double far_away) {
  belief::Scene empty = scene;
  empty.supports.clear();
  for (belief::KinematicBody& body : empty.robot)
    body.collision = {
        belief::PrimitiveShape{geometry::Sphere{1e-6 * far_away}, Pose::from_translation({0.0, 0.0, far_away})}};
  empty.objects = {scene.objects[object]};
  empty.outcomes.clear();
  empty.exclusive_outcomes.clear();
  empty.actions.clear();
  return empty;
}

std::vector<belief::Action> actions_of(const std::vector<belief::Action>& actions, const std::string& object) {
  std::vector<belief::Action> own;
  for (const belief::Action& action : actions)
    if (belief::object_of(action) == object) own.push_back(action);
  return own;
}

/// What drives objects otherwise than hands that hold them rigidly: their poses have no common flight from then on.
bool drives(const belief::Action& action) {
  const auto* grasp = std::get_if<belief::Grasp>(&action.what);
  return (grasp != nullptr && grasp->grip) || std::holds_alternative<belief::Bump>(action.what) ||
         std::holds_alternative<belief::Pull>(action.what) || std::holds_alternative<belief::MoveJoint>(action.what) ||
         std::holds_alternative<belief::Insert>(action.what);
}

/// When something comes from nowhere, or is driven.
double first_push(const std::vector<belief::Action>& actions) {
  double first = std::numeric_limits<double>::infinity();
  for (const belief::Action& action : actions)
    if (std::holds_alternative<belief::Push>(action.what) || drives(action)) first = std::min(first, action.time);
  return first;
}

/// Poses of one object of one component: by draw, by time.
using Flights = std::vector<std::vector<Pose>>;

/// Gaussian of `count` poses.
template <class PoseOf>
UncertainPose gaussian_of(std::size_t count, const PoseOf& pose) {
  const double weight = 1.0 / static_cast<double>(count);
  UncertainPose found;
  found.X_WB = pose(0);
  for (int iteration = 0; iteration < 4; ++iteration) {  // rotations have no mean in closed form
    Vector6d mean = Vector6d::Zero();
    for (std::size_t i = 0; i < count; ++i) mean += weight * geometry::box_minus(pose(i), found.X_WB);
    found.X_WB = geometry::box_plus(found.X_WB, mean);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Vector6d error = geometry::box_minus(pose(i), found.X_WB);
    found.covariance += weight * error * error.transpose();
  }
  return found;
}

/// Gaussian of the poses at both ends of a look, or with `middle` of that point's place alone.
UncertainPose moments_of(const Flights& flights, std::size_t look, const Vector3d* middle = nullptr) {
  return gaussian_of(2 * flights.size(), [&](std::size_t i) {
    const std::vector<Pose>& poses = flights[i / 2];
    const Pose& found = poses[std::min(look + i % 2, poses.size() - 1)];
    return middle ? Pose::from_translation(found * *middle) : found;
  });
}

/// Where a body of the robot is within a look.
struct RobotPlaces {
  std::vector<Pose> known;  ///< One after the other, ...
  std::vector<Pose> drawn;  ///< ... or any of these, as a Gaussian, where draws have it in different places.

  /// Of a shape of the body.
  std::vector<UncertainPose> of_shape(const Pose& X_BS) const {
    std::vector<UncertainPose> places;
    for (const Pose& X_WB : known) places.push_back(UncertainPose{X_WB * X_BS});
    if (!drawn.empty()) places.push_back(gaussian_of(drawn.size(), [&](std::size_t i) { return drawn[i] * X_BS; }));
    return places;
  }
};

/// An object of a component at a look.
class PlacedObject {
 public:
  PlacedObject(const Flights& flights, std::size_t look, const Vector3d& middle_O)
      : flights_(&flights), look_(look), middle_(moments_of(flights, look, &middle_O)) {}
  /// Of its ball.
  const UncertainPose& middle() const { return middle_; }
  const UncertainPose& pose() {
    if (!pose_) pose_ = moments_of(*flights_, look_);
    return *pose_;
  }

 private:
  const Flights* flights_;
  std::size_t look_;
  UncertainPose middle_;
  std::optional<UncertainPose> pose_;
};

/// Asks pairs of bodies whose poses are Gaussian whether they touch.
class Touching {
 public:
  Touching(const belief::Scene& scene, const FlightBodies& bodies) : scene_(scene), bodies_(bodies) {}

  struct Answer {
    bool apart = true;
    double probability = 0.0, error = 0.0;
  };
  /// Of an object with any body, numbered as in belief::ContactInterval, where the objects and the robot's bodies are.
  /// The ball first: however uncertain the object's rotation is, it does not count there.
  Answer ask(std::size_t object, std::size_t other, std::vector<PlacedObject>& placed,
             const std::vector<RobotPlaces>& robot) {
    const std::size_t objects = scene_.objects.size(), supports = scene_.supports.size();
    PlacedObject& own = placed[object];
    const FlightBodies::Object& body = bodies_.object(object);
    Answer answer;
    if (other < objects) {
      const FlightBodies::Object& met = bodies_.object(other);
      const auto balls = between(own.middle(), placed[other].middle());
      if (collision::overlap_state(*body.ball, *met.ball, balls, scratch_) == OverlapState::kNone) return answer;
      for (const auto& a : body.parts)
        for (const auto& b : met.parts)
          note(collision::uncertain_overlap(*a, *b, between(own.pose(), placed[other].pose()), scratch_), &answer);
      return answer;
    }
    const bool fixed = other < objects + supports;
    const std::size_t index = fixed ? other - objects : other - objects - supports;
    const RobotPlaces places = fixed ? RobotPlaces{{scene_.supports[index].X_WS}, {}} : robot[index];
    for (const FlightBodies::Placed& shape : fixed ? bodies_.support(index) : bodies_.robot_body(index)) {
      for (const UncertainPose& there : places.of_shape(shape.X_BS)) {
        if (collision::uncertain_overlap(*body.ball, *shape.shape, between(own.middle(), there), scratch_).state ==
            OverlapState::kNone)
          continue;
        for (const auto& part : body.parts)
          note(collision::uncertain_overlap(*part, *shape.shape, between(own.pose(), there), scratch_), &answer);
      }
    }
    return answer;
  }

 private:
  static RelativeUncertainty between(const UncertainPose& a, const UncertainPose& b) {
    auto made = RelativeUncertainty::make(a, b);
    PRESCENE_CHECK_MSG(made.ok(), core::to_string(made.status()).c_str());
    return *std::move(made);
  }
  /// Parts move together: the likeliest stands for all.
  static void note(const UncertainOverlap& overlap, Answer* answer) {
    if (overlap.state == OverlapState::kNone) return;
    answer->apart = false;
    if (overlap.probability < answer->probability) return;
    answer->probability = overlap.probability;
    answer->error = overlap.probability_error;
  }

  const belief::Scene& scene_;
  const FlightBodies& bodies_;
  collision::UncertainScratch scratch_;
};

/// Flies each object of each component by itself.
class Flyer {
 public:
  Flyer(const belief::Scene& scene, const StartDistribution& starts, const std::vector<belief::Action>& actions,
        const core::RandomStream& stream, const CommonFlightOptions& options)
      : options_(options), stream_(stream), samplers_(samplers_of(starts, stream)) {
    for (const belief::SceneObject& object : scene.objects) actions_.push_back(actions_of(actions, object.name));
  }
  core::Status make_simulators(const belief::Scene& scene, const SimulatorFactory& make,
                               const core::Cancellation* cancellation) {
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      if (cancellation && cancellation->requested()) return core::cancelled("the flight was not followed to its end");
      PRESCENE_TRY(auto simulator, make(alone(scene, i, options_.far_away), 1.0));
      simulators_.push_back(std::move(simulator));
    }
    return core::ok_status();
  }
  /// Up to `seconds` from the start; by component, by object. False when cancelled.
  bool fly(double seconds, core::ThreadPool& pool, const core::Cancellation* cancellation,
           std::vector<std::vector<Flights>>& flights) {
    const auto draws = static_cast<std::size_t>(options_.draws);
    RunRequest request;
    request.stop.duration = seconds;
    request.stop.stop_at_rest = false;
    request.stop.world_radius = options_.far_away;
    request.sample_interval = options_.interval;
    flights.assign(samplers_.size(), std::vector<Flights>(simulators_.size(), Flights(draws)));
    std::vector<belief::WorldState> states(draws);
    std::vector<belief::Trajectory> runs(draws);
    for (std::size_t k = 0; k < samplers_.size(); ++k)
      for (std::size_t i = 0; i < simulators_.size(); ++i) {
        for (std::size_t n = 0; n < draws; ++n) {
          states[n] = samplers_[k].draw(static_cast<std::uint32_t>(n));
          states[n].objects = {belief::ObjectState(states[n].objects[i])};
        }
        start_time_ = states[0].time;
        request.actions = actions_[i];
        simulators_[i]->run(states, request, stream_, 0, pool, runs, cancellation);
        if (cancellation && cancellation->requested()) return false;
        for (std::size_t n = 0; n < draws; ++n)
          for (const belief::WorldState& state : runs[n].states) flights[k][i][n].push_back(state.objects[0].X_WO);
      }
    return true;
  }
  double start_time() const { return start_time_; }

 private:
  CommonFlightOptions options_;
  core::RandomStream stream_;
  std::vector<StartSampler> samplers_;
  std::vector<std::vector<belief::Action>> actions_;  // by object
  std::vector<std::unique_ptr<Simulator>> simulators_;
  double start_time_ = 0.0;
};

/// Follows the robot's bodies; those that hold or grasp something as each draw has it.
class RobotFollower {
 public:
  RobotFollower(const belief::Scene& scene, const StartDistribution& starts, const std::vector<belief::Action>& actions,
                const core::RandomStream& stream, int draws)
      : scene_(scene), actions_(actions), leads_(scene.robot.size(), false) {
    const auto note = [&](const std::string& hand) {
      if (const std::optional<int> body = belief::find_robot_body(scene, hand))
        leads_[static_cast<std::size_t>(*body)] = true;
    };
    for (const belief::SceneObject& object : scene.objects)
      if (object.held_by) note(*object.held_by);
    for (const belief::Action& action : actions)
      if (const auto* grasp = std::get_if<belief::Grasp>(&action.what)) note(grasp->hand);
    if (actions.empty()) leads_.assign(leads_.size(), false);
    if (std::find(leads_.begin(), leads_.end(), true) == leads_.end()) return;
    for (const StartSampler& sampler : samplers_of(starts, stream)) {
      starts_.emplace_back();
      for (int n = 0; n < draws; ++n) starts_.back().push_back(sampler.draw(static_cast<std::uint32_t>(n)));
    }
    for (int n = 0; n < draws; ++n) drawn_.push_back(drawn_actions(stream.at(0, static_cast<std::uint32_t>(n))));
  }

  /// Between two times (s since the scene's start); by component, by body.
  std::vector<std::vector<RobotPlaces>> within(double begin, double end, std::size_t components) const {
    std::vector<std::vector<RobotPlaces>> places(components, std::vector<RobotPlaces>(scene_.robot.size()));
    for (std::size_t k = 0; k < components; ++k)
      for (std::size_t i = 0; i < scene_.robot.size(); ++i)
        places[k][i] = k == 0 || leads_[i] ? places_of(static_cast<int>(i), begin, end, k) : places[0][i];
    return places;
  }

 private:
  RobotPlaces places_of(int body, double begin, double end, std::size_t component) const {
    RobotPlaces places;
    for (const double time : {0.5 * (begin + end), begin, end}) {
      const std::vector<Pose> now = at(body, time, component);
      const bool is_one = std::all_of(now.begin(), now.end(), [&](const Pose& X_WB) { return X_WB == now.front(); });
      if (is_one && (places.known.empty() || !(now.front() == places.known.front())))
        places.known.push_back(now.front());
      if (!is_one) places.drawn.insert(places.drawn.end(), now.begin(), now.end());
    }
    return places;
  }
  /// As the flights of the objects draw theirs.
  std::vector<belief::Action> drawn_actions(const core::RandomStream& stream) const {
    std::vector<belief::Action> fixed = actions_;
    for (const belief::SceneObject& object : scene_.objects) {
      const std::vector<DrawnAction> drawn = draw_actions(actions_of(actions_, object.name), stream);
      auto next = drawn.begin();
      for (belief::Action& action : fixed)
        if (belief::object_of(action) == object.name) fix_draws(*next++, action);
    }
    return fixed;
  }
  std::vector<Pose> at(int body, double time, std::size_t component) const {
    if (!leads_[static_cast<std::size_t>(body)]) return {belief::robot_pose_at(scene_, actions_, body, time)};
    std::vector<Pose> poses;
    for (std::size_t n = 0; n < drawn_.size(); ++n)
      poses.push_back(
          belief::robot_pose_at(scene_, drawn_[n], belief::MotionStart{&starts_[component][n], {}}, body, time));
    return poses;
  }

  const belief::Scene& scene_;
  const std::vector<belief::Action>& actions_;
  std::vector<bool> leads_;                              // by body: where it is may depend on what it holds
  std::vector<std::vector<belief::WorldState>> starts_;  // by component, by draw
  std::vector<std::vector<belief::Action>> drawn_;       // by draw
};

/// Pairs (object, body) that count once they have parted: what is held and what holds it.
std::vector<std::vector<bool>> held_pairs(const belief::Scene& scene, std::size_t bodies) {
  std::vector<std::vector<bool>> parting(scene.objects.size(), std::vector<bool>(bodies, false));
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    if (!scene.objects[i].held_by) continue;
    if (const std::optional<int> hand = belief::find_robot_body(scene, *scene.objects[i].held_by))
      parting[i][scene.objects.size() + scene.supports.size() + static_cast<std::size_t>(*hand)] = true;
  }
  return parting;
}

}  // namespace

CommonFlightOptions CommonFlightOptions::of(double length_scale) {
  CommonFlightOptions options;
  const double time_scale = Similarity{length_scale}.time();
  options.interval *= time_scale;
  options.longest *= time_scale;
  options.far_away *= length_scale;
  return options;
}

core::Result<CommonFlight> common_flight(const belief::Scene& scene, const FlightBodies& bodies,
                                         const StartDistribution& starts, const RunRequest& request,
                                         const SimulatorFactory& make_simulator, const core::RandomStream& stream,
                                         core::ThreadPool& pool, const CommonFlightOptions& options,
                                         const core::Cancellation* cancellation) {
  PRESCENE_CHECK(options.draws >= 32 && options.interval > 0.0 && options.longest > 0.0);
  const std::size_t objects = scene.objects.size(), components = starts.components.size();
  const std::size_t body_count = objects + scene.supports.size() + scene.robot.size();
  const double push = first_push(request.actions);
  const double longest = std::min({request.stop.duration, options.longest, push});
  const auto looks = static_cast<std::size_t>(std::max(0.0, std::floor(longest / options.interval)));
  double total = 0.0;
  for (const StartComponent& component : starts.components) total += component.weight;

  Flyer flyer(scene, starts, request.actions, stream, options);
  PRESCENE_RETURN_IF_ERROR(flyer.make_simulators(scene, make_simulator, cancellation));
  const RobotFollower follower(scene, starts, request.actions, stream, options.draws);
  Touching touching(scene, bodies);
  std::vector<std::vector<bool>> parting = held_pairs(scene, body_count);
  std::vector<std::vector<Flights>> flights;
  std::size_t flown = 0;  // looks
  CommonFlight found;
  found.apart_until = static_cast<double>(looks) * options.interval;
  found.end = longest == request.stop.duration ? belief::FlightEnd::kRunEnds
              : longest == push                ? belief::FlightEnd::kPush
                                               : belief::FlightEnd::kNotFollowed;
  for (std::size_t look = 0; look < looks && found.openings.empty(); ++look) {
    if (look >= flown) {
      flown = std::min(looks, std::max<std::size_t>(4 * flown, 16));
      const double seconds = static_cast<double>(flown) * options.interval;
      if (!flyer.fly(seconds, pool, cancellation, flights))
        return core::cancelled("the flight was not followed to its end");
    }
    const double begin = flyer.start_time() + static_cast<double>(look) * options.interval;
    const std::vector<std::vector<RobotPlaces>> robot = follower.within(begin, begin + options.interval, components);
    std::vector<std::vector<PlacedObject>> placed(components);
    for (std::size_t k = 0; k < components; ++k)
      for (std::size_t i = 0; i < objects; ++i) placed[k].emplace_back(flights[k][i], look, bodies.object(i).middle);

    for (std::size_t i = 0; i < objects; ++i)
      for (std::size_t other = i + 1; other < body_count; ++other) {
        if (cancellation && cancellation->requested()) return core::cancelled("the flight was not followed to its end");
        FlightOpening opening{static_cast<int>(i), static_cast<int>(other)};
        bool apart = true;
        for (std::size_t k = 0; k < components; ++k) {
          const Touching::Answer answer = touching.ask(i, other, placed[k], robot[k]);
          const double share = starts.components[k].weight / total;
          apart = apart && answer.apart;
          opening.probability += share * answer.probability;
          opening.probability_error += share * answer.error;
        }
        if (apart) parting[i][other] = false;
        if (!apart && !parting[i][other]) found.openings.push_back(opening);
      }
    if (found.openings.empty() && look + 1 < looks) continue;
    if (!found.openings.empty()) {
      found.apart_until = static_cast<double>(look) * options.interval;
      found.end = belief::FlightEnd::kMayTouch;
    }
    for (std::size_t k = 0; k < components; ++k) {
      found.moments.emplace_back();
      for (PlacedObject& object : placed[k]) found.moments[k].push_back(object.pose());
    }
  }
  std::stable_sort(found.openings.begin(), found.openings.end(),
                   [](const FlightOpening& a, const FlightOpening& b) { return a.probability > b.probability; });
  return found;
}

}  // namespace prescene::simulation
