// SPDX-License-Identifier: Apache-2.0
#include "tests/belief/random_values.h"

#include <algorithm>
#include <tuple>

#include "prescene/geometry/angles.h"
#include "prescene/geometry/sampling.h"

namespace prescene::tests {

using namespace belief;  // NOLINT(google-build-using-namespace): this file is about nothing else
using core::RandomStream;

int random_below(RandomStream& stream, int bound) {
  return static_cast<int>(stream.uniform_below(static_cast<std::uint64_t>(bound)));
}

Vector3d random_vector(RandomStream& stream, double reach) {
  const double x = stream.uniform(-reach, reach), y = stream.uniform(-reach, reach);
  return {x, y, stream.uniform(-reach, reach)};
}

Pose random_pose(RandomStream& stream) {
  const geometry::Quaterniond rotation = geometry::uniform_rotation(stream);
  return {rotation, random_vector(stream)};
}

Eigen::MatrixXd random_covariance(RandomStream& stream, int size, int rank) {
  Eigen::MatrixXd root(size, rank);
  for (Eigen::Index i = 0; i < root.size(); ++i) root.data()[i] = stream.uniform(-0.1, 0.1);
  return root * root.transpose();
}

ScalarDistribution random_scalar(RandomStream& stream) {
  const double a = stream.uniform(-1.0, 1.0), width = stream.uniform(0.01, 0.5);
  switch (random_below(stream, 5)) {
    case 0:
      return FixedScalar{a};
    case 1:
      return NormalScalar{a, width};
    case 2:
      return NormalScalar{a, width, a - stream.uniform(-0.5, 2.0) * width, a + 2.5 * width};
    case 3:
      return UniformScalar{a, a + width};
    default:
      return SampledScalar{{a, a + width, a - width, a}};
  }
}

Vector3Distribution random_vector_distribution(RandomStream& stream) {
  ScalarDistribution x = random_scalar(stream), y = random_scalar(stream);
  return {std::move(x), std::move(y), random_scalar(stream)};
}

PoseDistribution random_pose_distribution(RandomStream& stream) {
  switch (random_below(stream, 4)) {
    case 0:
      return FixedPose{random_pose(stream)};
    case 1: {
      const Pose mean = random_pose(stream);
      return NormalPose{mean, random_covariance(stream, 6, random_below(stream, 7))};
    }
    case 2: {
      Vector3Distribution position = random_vector_distribution(stream);
      // Something varies, else it would be a fixed pose; where any rotation may be, there is no other.
      if (dimensions(position) == 0) position.x = UniformScalar{0.0, 1.0};
      if (random_below(stream, 2) == 1) return BoxPose{std::move(position), geometry::Quaterniond::Identity(), true};
      return BoxPose{std::move(position), geometry::uniform_rotation(stream), false};
    }
    default: {
      SampledPose sampled;
      for (int i = random_below(stream, 4); i >= 0; --i) sampled.samples.push_back(random_pose(stream));
      return sampled;
    }
  }
}

Action random_action(RandomStream& stream) {
  Action action;
  action.time = stream.uniform(0.0, 2.0);
  const double duration = stream.uniform(0.1, 2.0);
  switch (random_below(stream, 11)) {
    case 0: {
      Release release{"block", random_vector(stream), duration, {}};
      release.disturbance.linear = random_vector_distribution(stream);
      action.what = release;
      break;
    }
    case 1:
      action.what = Place{"block", random_pose_distribution(stream), duration};
      break;
    case 2: {
      const Vector3d from = random_vector(stream), to = random_vector(stream);
      action.what = Push{from, to, duration, 0.013, random_scalar(stream)};
      break;
    }
    case 3:
      action.what = Pour{"block", geometry::uniform_direction(stream),
                         geometry::kDegree * stream.uniform(-170.0, 170.0), duration};
      break;
    case 4: {
      Grasp grasp{"block", "hand"};
      if (random_below(stream, 2) == 1) grasp.grip = Grip{random_scalar(stream), {}, stream.uniform(0.01, 0.1)};
      if (grasp.grip && random_below(stream, 2) == 1) grasp.grip->friction = random_scalar(stream);
      action.what = grasp;
      break;
    }
    case 5: {
      Bump bump{"block", random_vector_distribution(stream)};
      if (random_below(stream, 2) == 1) bump.point_O = random_vector(stream);
      action.what = bump;
      break;
    }
    case 6:
      action.what = Tilt{"block", geometry::uniform_direction(stream),
                         geometry::kDegree * stream.uniform(-170.0, 170.0), random_vector(stream), duration};
      break;
    case 7: {
      Pull pull{"block", random_vector(stream), duration, random_scalar(stream)};
      if (random_below(stream, 2) == 1) pull.point_O = random_vector(stream);
      action.what = pull;
      break;
    }
    case 8: {
      const bool hinge = random_below(stream, 2) == 1;
      MoveJoint move{"slide", hinge ? JointType::kHinge : JointType::kSlider,
                     hinge ? geometry::kDegree * stream.uniform(-170.0, 170.0) : stream.uniform(0.0, 1.0), duration,
                     random_scalar(stream)};
      if (random_below(stream, 2) == 1) move.handle_C = random_vector(stream);
      action.what = move;
      break;
    }
    case 9: {
      Insert insert{"block", geometry::uniform_direction(stream), stream.uniform(0.01, 0.3), duration};
      insert.force = random_scalar(stream);
      insert.torque = random_scalar(stream);
      action.what = insert;
      break;
    }
    default:
      action.what = Transport{"block", random_pose_distribution(stream), duration};
  }
  return action;
}

Predicate random_predicate(RandomStream& stream) {
  switch (random_below(stream, 9)) {
    case 0: {
      const Pose X_WV = random_pose(stream);
      return InsideVolume{X_WV, random_vector(stream).cwiseAbs() + Vector3d::Constant(0.5),
                          random_below(stream, 2) == 1};
    }
    case 1:
      return RestingOn{random_below(stream, 2) == 1 ? "table" : "ball"};
    case 2: {
      const Vector3d axis = geometry::uniform_direction(stream);
      return UprightWithin{axis, geometry::kDegree * stream.uniform(5.0, 145.0)};
    }
    case 3: {
      const double sign = random_below(stream, 2) == 1 ? 1.0 : -1.0;
      return FaceUp{sign * Vector3d::Unit(random_below(stream, 3))};
    }
    case 4:
      return BelowHeight{stream.uniform(-1.0, 1.0)};
    case 5:
      return MovedMoreThan{stream.uniform(0.0, 2.0)};
    case 6:
      return TurnedMoreThan{geometry::kDegree * stream.uniform(0.0, 170.0)};
    case 7:
      return Touched{random_below(stream, 2) == 1 ? "table" : "hand"};
    default:
      return StillMoving{};
  }
}

Outcome random_outcome(RandomStream& stream, const std::string& name) {
  Outcome outcome{name, "block", {}};
  for (int i = random_below(stream, 2); i >= 0; --i) {
    Condition condition{random_predicate(stream), When::kAtEnd, false};
    // Touched is about any time.
    const bool touched = std::holds_alternative<Touched>(condition.predicate);
    condition.when = static_cast<When>(random_below(stream, touched ? 2 : 3));
    condition.negated = random_below(stream, 2) == 1;
    outcome.all_of.push_back(condition);
  }
  if (random_below(stream, 2) == 0) return outcome;
  for (int i = random_below(stream, 2); i >= 0; --i)
    outcome.any_of.push_back({random_predicate(stream), When::kAtEnd, random_below(stream, 2) == 1});
  return outcome;
}

Query random_query(RandomStream& stream) {
  Query query;
  query.id = "query \"" + std::to_string(random_below(stream, 1000)) + "\"\n";
  Effort effort{stream.uniform(0.001, 0.1), stream.uniform(0.5, 0.999), 1 + random_below(stream, 9999), {}, {}};
  if (random_below(stream, 2) == 1) effort.max_seconds = stream.uniform(0.1, 10.0);
  if (random_below(stream, 2) == 1) effort.exact_instances = 1 + random_below(stream, 1000);
  switch (random_below(stream, 6)) {
    case 0: {
      WhereQuery where;
      if (random_below(stream, 2) == 1) where.object = "block";
      query.what = where;
      break;
    }
    case 1: {
      PredictQuery predict;
      for (int i = random_below(stream, 3); i > 0; --i) predict.actions.push_back(random_action(stream));
      for (int i = random_below(stream, 3); i > 0; --i)
        predict.outcomes.push_back(random_outcome(stream, "o" + std::to_string(i)));
      if (random_below(stream, 2) == 1)
        predict.exclusive_outcomes.push_back({"group", {random_outcome(stream, "a"), random_outcome(stream, "b")}});
      if (random_below(stream, 2) == 1) predict.duration = stream.uniform(0.1, 9.0);
      predict.effort = effort;
      query.what = predict;
      break;
    }
    case 2: {
      const double move = stream.uniform(0.001, 0.1);
      query.what = StabilityQuery{"block", move, geometry::kDegree * stream.uniform(1.0, 60.0),
                                  stream.uniform(0.1, 9.0), effort};
      break;
    }
    case 3: {
      AchieveQuery achieve;
      if (random_below(stream, 2) == 1)
        achieve.wanted = random_outcome(stream, "wanted");
      else
        achieve.outcome = "o";
      achieve.action = random_below(stream, 2) == 1 ? "place" : "push";
      if (random_below(stream, 2) == 1) achieve.object = "block";
      if (random_below(stream, 2) == 1) achieve.support = "table";
      if (achieve.action == "place")
        achieve.free = {{"x", -stream.uniform(), stream.uniform()}, {"yaw", {}, {}}};
      else
        achieve.free = {{"offset", -stream.uniform(), stream.uniform()}, {"direction", {}, {}}};
      if (random_below(stream, 2) == 1) achieve.fixed = {{"height", stream.uniform()}};
      achieve.errors.position = random_vector(stream, 1.0).cwiseAbs();
      const double about_z = stream.uniform(), about_y = stream.uniform(), about_x = stream.uniform();
      achieve.errors.rotation = geometry::kDegree * Vector3d(about_x, about_y, about_z);
      achieve.errors.delay = UniformScalar{0.0, stream.uniform()};
      if (random_below(stream, 2) == 1) achieve.errors.disturbance.emplace();
      achieve.probability = stream.uniform(0.5, 0.99);
      achieve.survey = random_below(stream, 2) == 1;
      if (random_below(stream, 2) == 1) achieve.duration = stream.uniform(0.1, 9.0);
      achieve.effort = effort;
      query.what = achieve;
      break;
    }
    case 4: {
      NextViewQuery next;
      next.object = "block";
      next.about = static_cast<ViewAbout>(random_below(stream, 3));
      for (int i = random_below(stream, 3); i >= 0; --i) {
        CandidateView& view = next.views.emplace_back();
        if (i > 0) view.name = "view " + std::to_string(i);
        view.X_WC = random_pose(stream);
        if (random_below(stream, 2) == 1) view.intrinsics = {64, 48, 50.0, stream.uniform(40.0, 60.0), 31.0, 20.0};
      }
      next.draws = 16 + random_below(stream, 100);
      next.confidence = stream.uniform(0.5, 0.999);
      query.what = next;
      break;
    }
    default: {
      ViewQuery view;
      for (int i = random_below(stream, 3); i > 0; --i) view.actions.push_back(random_action(stream));
      view.time = stream.uniform(0.0, 3.0);
      if (random_below(stream, 2) == 1) view.X_WC = random_pose(stream);
      if (random_below(stream, 2) == 1) view.intrinsics = {64, 48, 50.0, stream.uniform(40.0, 60.0), 31.0, 20.0};
      view.draws = 16 + random_below(stream, 100);
      view.detail = {random_below(stream, 2) == 1, random_below(stream, 2) == 1, random_below(stream, 2) == 1};
      view.compact = random_below(stream, 2) == 1;
      query.what = view;
    }
  }
  return query;
}

MotionSample random_sample(RandomStream& stream, core::TimeNs stamp_ns) {
  MotionSample sample{stamp_ns, random_pose(stream), {}, {random_pose(stream)}};
  for (double& value : sample.deviation) value = stream.uniform();
  return sample;
}

MotionRecord random_motion(RandomStream& stream) {
  MotionRecord motion;
  motion.X_still = random_pose(stream);
  motion.still_frames = random_below(stream, 100);
  motion.moved_frames = random_below(stream, 3);
  motion.place_judged = random_below(stream, 2) == 1;
  motion.held = random_below(stream, 2) == 1;
  motion.episodes_unexplained = random_below(stream, 3);
  for (int i = random_below(stream, 3); i > 0; --i) motion.recent.push_back(random_sample(stream, 10 - i));
  if (random_below(stream, 2) == 0) return motion;
  MotionEpisode& episode = motion.episode.emplace();
  episode.kind = static_cast<EpisodeKind>(random_below(stream, 3));
  for (int i = random_below(stream, 3); i >= 0; --i) episode.samples.push_back(random_sample(stream, 10 - i));
  episode.V_start = {random_vector(stream), random_vector(stream)};
  episode.others = {random_pose(stream)};
  episode.closed = random_below(stream, 2) == 1;
  episode.probed = random_below(stream, 2) == 1;
  for (int i = random_below(stream, 3); i > 0; --i) episode.run_errors.push_back(-stream.uniform());
  return motion;
}

/// Of a model with one uncertain parameter.
PhysicalBelief random_physics(RandomStream& stream) {
  PhysicalBelief physics;
  if (random_below(stream, 2) == 0) return physics;
  std::vector<PhysicalDraw> draws(static_cast<std::size_t>(1 + random_below(stream, 4)));
  for (PhysicalDraw& draw : draws) draw = {{stream.uniform()}, -std::log(static_cast<double>(draws.size()))};
  physics.draws = std::make_shared<const std::vector<PhysicalDraw>>(std::move(draws));
  physics.cell = stream.uniform();
  physics.lessons = 1 + random_below(stream, 9);
  physics.learned_ns = static_cast<core::TimeNs>(stream.next_u64() >> 2);
  return physics;
}

ObjectBelief random_object_belief(RandomStream& stream, const std::string& name) {
  ObjectBelief object;
  object.name = name;
  object.model = random_below(stream, 2);
  object.existence = stream.uniform();
  object.state = static_cast<TrackState>(random_below(stream, 4));
  object.evidence_per_pixel = stream.uniform(-1.0, 1.0);
  object.visible_share = stream.uniform();
  object.frames_unseen = random_below(stream, 100);
  object.frames_refuted = random_below(stream, 100);
  if (random_below(stream, 2) == 1) {
    std::vector<ColorShare> shares;
    for (int bin = random_below(stream, 900); bin < kColorCells; bin += 1 + random_below(stream, 900))
      shares.push_back({bin, stream.uniform(), stream.uniform()});
    object.colors = {1 + random_below(stream, 100), std::make_shared<const std::vector<ColorShare>>(std::move(shares))};
  }
  object.last_seen_ns = static_cast<core::TimeNs>(stream.next_u64() >> 2);
  object.island = random_below(stream, 5);
  object.physics = random_physics(stream);
  object.motion = random_motion(stream);
  if (random_below(stream, 2) == 1)
    object.grip = {random_pose(stream), 1 + random_below(stream, 9), random_below(stream, 3)};
  const Pose middle = random_pose(stream);
  for (int i = random_below(stream, 6); i >= 0; --i) {
    Particle particle;
    particle.log_weight = stream.uniform(-5.0, 0.0);
    geometry::Vector6d d;
    for (int k = 0; k < 6; ++k) d[k] = stream.uniform(-0.3, 0.3);
    particle.X_WO = geometry::box_plus(middle, d);
    particle.V_WO = {random_vector(stream), random_vector(stream)};
    particle.covariance = random_covariance(stream, 12, random_below(stream, 13));
    particle.mode = static_cast<MotionMode>(random_below(stream, 3));
    object.particles.push_back(particle);
  }
  normalize(object.particles);
  return object;
}

Belief random_belief(RandomStream& stream, std::shared_ptr<const Scene> scene) {
  Belief belief;
  belief.step = stream.next_u64() >> 1;
  belief.seed = stream.next_u64();
  belief.stamp_ns = static_cast<core::TimeNs>(stream.next_u64() >> 2);
  belief.scene = std::move(scene);
  for (int i = random_below(stream, 4); i > 0; --i)
    belief.objects.push_back(random_object_belief(stream, "object_" + std::to_string(i)));
  for (int i = random_below(stream, 3); i > 0; --i) belief.robot.push_back(random_pose(stream));
  belief.X_WC = random_pose(stream);
  if (random_below(stream, 2) == 1) belief.lowest_seen = stream.uniform(-1.0, 1.0);
  for (int i = random_below(stream, 3); i > 0; --i)
    belief.pushes.push_back({stream.uniform(-1.0, 0.0),
                             Push{random_vector(stream), random_vector(stream), stream.uniform(0.1, 2.0), 0.02, {}}});
  return belief;
}

Scene small_scene() {
  const auto model = [](const std::string& name, const geometry::Primitive& primitive) {
    ObjectModel shape;
    shape.name = name;
    shape.collision.emplace_back(PrimitiveShape{primitive, {}});
    shape.contact.friction = UniformScalar{0.2, 0.8};
    return *with_derived_properties(shape);
  };
  Scene scene;
  scene.name = "small";
  scene.models = {model("block", geometry::BoxShape{{0.1, 0.2, 0.3}}), model("ball", geometry::Sphere{0.05})};
  Support table;
  table.name = "table";
  table.collision.emplace_back(PrimitiveShape{geometry::BoxShape{{2.0, 2.0, 0.1}}, {}});
  Support bin = table;
  bin.name = "bin";
  bin.X_WS.translation = {1.0, 0.0, 0.0};
  bin.hollow = Hollow{Pose::from_translation({0.0, 0.0, 0.2}), {0.3, 0.3, 0.4}};
  scene.supports = {table, bin};
  KinematicBody hand;
  hand.name = "hand";
  hand.collision.emplace_back(PrimitiveShape{geometry::Sphere{0.02}, {}});
  hand.timeline = {{0.0, Pose{}}};
  scene.robot = {hand};
  SceneObject block, ball;
  block.name = "block";
  block.held_by = "hand";
  ball.name = "ball";
  ball.model = 1;
  scene.objects = {block, ball};
  return scene;
}

Trajectory random_trajectory(RandomStream& stream) {
  Trajectory trajectory;
  const int count = 2 + random_below(stream, 6);
  for (int i = 0; i < count; ++i) {
    WorldState state;
    state.time = 0.25 * i;
    for (int k = 0; k < 2; ++k) {
      ObjectState object;
      object.X_WO = random_pose(stream);
      const double speed = random_below(stream, 2) == 1 ? 1.0 : 0.005;
      object.V_WO = {random_vector(stream, speed), random_vector(stream, speed)};
      object.mode = random_below(stream, 4) == 0 ? MotionMode::kHeld : MotionMode::kMoving;
      state.objects.push_back(object);
    }
    trajectory.states.push_back(state);
  }
  const double end = trajectory.final().time;
  for (int i = random_below(stream, 5); i > 0; --i) {
    ContactInterval contact;
    contact.first = random_below(stream, 2);
    contact.second = contact.first + 1 + random_below(stream, 4 - contact.first);
    contact.begin = stream.uniform(0.0, end);
    contact.end = random_below(stream, 2) == 1 ? end : stream.uniform(contact.begin, end);
    contact.normal_z = stream.uniform(-1.0, 1.0);
    trajectory.contacts.push_back(contact);
  }
  std::sort(trajectory.contacts.begin(), trajectory.contacts.end(), [](const auto& a, const auto& b) {
    return std::tie(a.begin, a.first, a.second) < std::tie(b.begin, b.first, b.second);
  });
  trajectory.simulated_seconds = end;
  return trajectory;
}

}  // namespace prescene::tests
