// SPDX-License-Identifier: Apache-2.0
// Random values of the belief for laws, all drawn from a stream: distributions, actions, outcomes, queries, beliefs,
// and trajectories of a small scene.
#pragma once

#include "prescene/belief/belief.h"
#include "prescene/belief/query.h"
#include "prescene/belief/trajectory.h"
#include "prescene/core/random.h"

namespace prescene::tests {

int random_below(core::RandomStream& stream, int bound);
geometry::Vector3d random_vector(core::RandomStream& stream, double reach = 1.0);
geometry::Pose random_pose(core::RandomStream& stream);
/// Positive semidefinite, of just this rank (up to `size`), the largest deviation about 0.1.
Eigen::MatrixXd random_covariance(core::RandomStream& stream, int size, int rank);
belief::ScalarDistribution random_scalar(core::RandomStream& stream);
belief::Vector3Distribution random_vector_distribution(core::RandomStream& stream);
belief::PoseDistribution random_pose_distribution(core::RandomStream& stream);
belief::Action random_action(core::RandomStream& stream);
belief::Predicate random_predicate(core::RandomStream& stream);
/// About the object "block" of small_scene().
belief::Outcome random_outcome(core::RandomStream& stream, const std::string& name);
belief::Query random_query(core::RandomStream& stream);
belief::ObjectBelief random_object_belief(core::RandomStream& stream, const std::string& name);
belief::Belief random_belief(core::RandomStream& stream, std::shared_ptr<const belief::Scene> scene);

/// Objects "block" (a box) and "ball", supports "table" and "bin" (with a hollow), a robot body "hand".
belief::Scene small_scene();
/// Something like a motion of that scene: several states, contacts that last for a while.
belief::Trajectory random_trajectory(core::RandomStream& stream);

}  // namespace prescene::tests
