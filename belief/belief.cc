// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/belief.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/core/check.h"
#include "prescene/core/hash.h"
#include "prescene/core/random.h"

namespace prescene::belief {
namespace {

// The index of the particle at quantile u of the weights.
std::size_t chosen(const ObjectBelief& object, double u) {
  double sum = 0.0;
  for (std::size_t i = 0; i < object.particles.size(); ++i) {
    sum += std::exp(object.particles[i].log_weight);
    if (u < sum) return i;
  }
  return object.particles.size() - 1;
}

ObjectState state_of(const Particle& particle, const PhysicalParameters& physical,
                     const Eigen::Matrix<double, 12, 1>& d) {
  ObjectState state{particle.X_WO, particle.V_WO, particle.mode, physical};
  if (!d.isZero(0.0)) state.X_WO = geometry::box_plus(particle.X_WO, d.head<6>());
  state.V_WO.angular += d.segment<3>(6);
  state.V_WO.linear += d.segment<3>(9);
  return state;
}

void hash_vector(core::Hasher& hasher, const double* values, Eigen::Index count) {
  for (Eigen::Index i = 0; i < count; ++i) hasher.value(values[i]);
}

void hash_pose(core::Hasher& hasher, const Pose& pose) {
  hash_vector(hasher, pose.rotation.coeffs().data(), 4);
  hash_vector(hasher, pose.translation.data(), 3);
}

void hash_particle(core::Hasher& hasher, const Particle& particle) {
  hasher.value(particle.log_weight);
  hash_pose(hasher, particle.X_WO);
  hash_vector(hasher, particle.V_WO.angular.data(), 3);
  hash_vector(hasher, particle.V_WO.linear.data(), 3);
  hash_vector(hasher, particle.covariance.data(), particle.covariance.size());
  hasher.value(particle.mode);
}

// Nothing where nothing was learned.
void hash_physics(core::Hasher& hasher, const PhysicalBelief& physics) {
  if (!physics.draws) return;
  hasher.value(physics.lessons).value(physics.learned_ns).value(physics.cell);
  for (const PhysicalDraw& draw : *physics.draws) {
    hasher.value(draw.log_weight);
    for (const double u : draw.uniforms) hasher.value(u);
  }
}

void hash_twist(core::Hasher& hasher, const Twist& twist) {
  hash_vector(hasher, twist.angular.data(), 3);
  hash_vector(hasher, twist.linear.data(), 3);
}

void hash_motion(core::Hasher& hasher, const MotionRecord& motion) {
  hasher.value(motion.still_frames)
      .value(motion.moved_frames)
      .value(motion.place_judged)
      .value(motion.held)
      .value(motion.episodes_unexplained);
  hash_pose(hasher, motion.X_still);
  const auto hash_samples = [&](const std::vector<MotionSample>& samples) {
    for (const MotionSample& sample : samples) {
      hasher.value(sample.stamp_ns);
      hash_pose(hasher, sample.X_WO);
      hash_vector(hasher, sample.deviation.data(), sample.deviation.size());
      for (const Pose& pose : sample.robot) hash_pose(hasher, pose);
    }
  };
  hash_samples(motion.recent);
  if (!motion.episode) return;
  const MotionEpisode& episode = *motion.episode;
  hasher.value(episode.kind).value(episode.closed).value(episode.probed);
  hash_twist(hasher, episode.V_start);
  for (const Pose& pose : episode.others) hash_pose(hasher, pose);
  for (const double value : episode.run_errors) hasher.value(value);
  hash_samples(episode.samples);
}

// Nothing where nothing was learned.
void hash_colors(core::Hasher& hasher, const LearnedColors& colors) {
  if (!colors.shares) return;
  hasher.value(colors.frames).value(colors.shares->size());
  for (const ColorShare& share : *colors.shares) hasher.value(share.bin).value(share.object).value(share.rest);
}

}  // namespace

bool operator==(const LearnedColors& a, const LearnedColors& b) {
  if (a.frames != b.frames) return false;
  return a.shares == b.shares || (a.shares && b.shares && *a.shares == *b.shares);
}

std::string to_string(TrackState state) {
  switch (state) {
    case TrackState::kTracked:
      return "tracked";
    case TrackState::kDoubtful:
      return "doubtful";
    case TrackState::kUnseen:
      return "unseen";
    case TrackState::kLost:
      return "lost";
  }
  PRESCENE_CHECK_MSG(false, "a TrackState outside of its enumeration");
}

std::string to_string(MotionMode mode) {
  switch (mode) {
    case MotionMode::kResting:
      return "resting";
    case MotionMode::kHeld:
      return "held";
    case MotionMode::kMoving:
      return "moving";
  }
  PRESCENE_CHECK_MSG(false, "a MotionMode outside of its enumeration");
}

bool operator==(const Belief& a, const Belief& b) {
  const bool same_scene = a.scene == b.scene || (a.scene && b.scene && *a.scene == *b.scene);
  return same_scene && a.step == b.step && a.seed == b.seed && a.stamp_ns == b.stamp_ns && a.objects == b.objects &&
         a.robot == b.robot && a.X_WC == b.X_WC && a.lowest_seen == b.lowest_seen && a.pushes == b.pushes &&
         a.cameras == b.cameras;
}

std::optional<int> find_object(const Belief& belief, const std::string& name) {
  for (std::size_t i = 0; i < belief.objects.size(); ++i)
    if (belief.objects[i].name == name) return static_cast<int>(i);
  return std::nullopt;
}

double effective_sample_size(const std::vector<Particle>& particles) {
  double sum = 0.0, squares = 0.0;
  for (const Particle& particle : particles) {
    const double weight = std::exp(particle.log_weight);
    sum += weight;
    squares += weight * weight;
  }
  return squares > 0.0 ? sum * sum / squares : 0.0;
}

const Particle& heaviest(const std::vector<Particle>& particles) {
  PRESCENE_CHECK(!particles.empty());
  return *std::max_element(particles.begin(), particles.end(),
                           [](const Particle& a, const Particle& b) { return a.log_weight < b.log_weight; });
}

bool normalize(std::vector<Particle>& particles) {
  if (particles.empty()) return false;
  double largest = -std::numeric_limits<double>::infinity();
  for (Particle& particle : particles) {
    if (std::isnan(particle.log_weight)) particle.log_weight = -std::numeric_limits<double>::infinity();
    largest = std::max(largest, particle.log_weight);
  }
  if (!std::isfinite(largest)) {
    for (Particle& particle : particles) particle.log_weight = -std::log(static_cast<double>(particles.size()));
    return false;
  }
  double sum = 0.0;
  for (const Particle& particle : particles) sum += std::exp(particle.log_weight - largest);
  const double log_sum = largest + std::log(sum);
  for (Particle& particle : particles) particle.log_weight -= log_sum;
  return true;
}

const ObjectModel& model_of(const Belief& belief, const ObjectBelief& object) {
  PRESCENE_CHECK(belief.scene != nullptr && object.model >= 0 && object.model < std::ssize(belief.scene->models));
  return belief.scene->models[static_cast<std::size_t>(object.model)];
}

namespace {

/// Those of the scene whose objects the belief has, as drop_loose_joints() leaves them.
std::vector<Joint> whole_joints(const Belief& belief) {
  if (!belief.scene || belief.scene->joints.empty()) return {};
  Scene scene;
  scene.supports = belief.scene->supports;
  scene.joints = belief.scene->joints;
  for (const ObjectBelief& object : belief.objects) scene.objects.emplace_back().name = object.name;
  drop_loose_joints(scene);
  return scene.joints;
}

}  // namespace

WorldState most_likely_state(const Belief& belief) {
  WorldState state;
  for (const Joint& joint : whole_joints(belief))
    state.joints.push_back({joint.type, mean(joint.friction), mean(joint.damping)});
  for (const ObjectBelief& object : belief.objects) {
    const PhysicalParameters physical = PhysicalSampler(model_of(belief, object), object.physics).mean();
    state.objects.push_back(state_of(heaviest(object.particles), physical, Eigen::Matrix<double, 12, 1>::Zero()));
  }
  return state;
}

BeliefSampler::BeliefSampler(const Belief& belief) {
  for (const ObjectBelief& object : belief.objects) {
    PRESCENE_CHECK(!object.particles.empty());
    Prepared prepared{&object, PhysicalSampler(model_of(belief, object), object.physics), {}};
    for (const Particle& particle : object.particles) {
      prepared.roots.push_back(covariance_square_root(particle.covariance));
      prepared.rank = std::max(prepared.rank, prepared.roots.back().cols());
    }
    dimensions_ +=
        (object.particles.size() > 1 ? 1 : 0) + prepared.physics.dimensions() + static_cast<int>(prepared.rank);
    largest_rank_ = std::max(largest_rank_, prepared.rank);
    objects_.push_back(std::move(prepared));
  }
  joints_ = whole_joints(belief);
  for (const Joint& joint : joints_)
    dimensions_ += belief::dimensions(joint.friction) + belief::dimensions(joint.damping);
}

WorldState BeliefSampler::draw(std::span<const double> uniforms) const {
  PRESCENE_CHECK(std::ssize(uniforms) == dimensions_);
  std::size_t next = 0;
  std::vector<std::size_t> particles;
  for (const Prepared& object : objects_)
    particles.push_back(object.roots.size() > 1 ? chosen(*object.belief, uniforms[next++]) : 0);
  std::vector<PhysicalParameters> physical;
  for (const Prepared& object : objects_) {
    const auto count = static_cast<std::size_t>(object.physics.dimensions());
    physical.push_back(object.physics.draw(uniforms.subspan(next, count)));
    next += count;
  }
  std::vector<Eigen::Matrix<double, 12, 1>> errors(objects_.size(), Eigen::Matrix<double, 12, 1>::Zero());
  for (Eigen::Index column = 0; column < largest_rank_; ++column) {
    for (std::size_t i = 0; i < objects_.size(); ++i) {
      if (column >= objects_[i].rank) continue;
      const double z = core::inverse_normal_cdf(uniforms[next++]);
      const Eigen::MatrixXd& root = objects_[i].roots[particles[i]];
      if (column < root.cols()) errors[i] += z * root.col(column);
    }
  }
  WorldState state;
  for (std::size_t i = 0; i < objects_.size(); ++i)
    state.objects.push_back(state_of(objects_[i].belief->particles[particles[i]], physical[i], errors[i]));
  const auto drawn = [&](const ScalarDistribution& distribution) {
    const auto count = static_cast<std::size_t>(belief::dimensions(distribution));
    const double value = belief::draw(distribution, uniforms.subspan(next, count));
    next += count;
    return value;
  };
  for (const Joint& joint : joints_) {
    JointParameters& to = state.joints.emplace_back();
    to.type = joint.type;
    to.friction = drawn(joint.friction);
    to.damping = drawn(joint.damping);
  }
  return state;
}

std::uint64_t content_hash(const Belief& belief) {
  core::Hasher hasher;
  hasher.value(belief.step).value(belief.seed).value(belief.stamp_ns).value(belief.objects.size());
  for (const ObjectBelief& object : belief.objects) {
    hasher.text(object.name).value(object.model).value(object.existence).value(object.state);
    hasher.value(object.evidence_per_pixel).value(object.visible_share).value(object.frames_unseen);
    hasher.value(object.frames_refuted);
    hasher.value(object.last_seen_ns).value(object.island).value(object.particles.size());
    for (const Particle& particle : object.particles) hash_particle(hasher, particle);
    hash_colors(hasher, object.colors);
    hash_physics(hasher, object.physics);
    hash_motion(hasher, object.motion);
    hasher.value(object.grip.frames).value(object.grip.apart_frames);
    hash_pose(hasher, object.grip.X_GO);
    for (const CameraView& view : object.views) {
      hasher.value(view.sees).value(view.evidence_per_pixel).value(view.evidence_scale).value(view.visible_share);
      hasher.value(view.visible_pixels);
      hash_colors(hasher, view.colors);
    }
  }
  hasher.value(belief.robot.size());
  for (const Pose& pose : belief.robot) hash_pose(hasher, pose);
  hash_pose(hasher, belief.X_WC);
  if (belief.lowest_seen) hasher.value(*belief.lowest_seen);
  for (const Action& push : belief.pushes) hasher.text(json_text(to_json(push)));
  for (const CameraRecord& camera : belief.cameras) {
    hasher.value(camera.frames).value(camera.stamp_ns).value(camera.period_ns);
    hash_pose(hasher, camera.X_WC);
  }
  return hasher.digest();
}

}  // namespace prescene::belief
