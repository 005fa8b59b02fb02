// SPDX-License-Identifier: Apache-2.0
// The part of weight() that is about resting particles: those that are about alike are compared with a frame once, and
// average over frames.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "particle_update.h"
#include "prescene/filter/operators/still_update.h"

namespace prescene::filter {

/// What a frame says about all poses near one at which a resting object was compared with it: a Gaussian likelihood.
/// The pixels of the coarse image that poses happen to cover differ more than the poses; this does not.
struct FrameLikelihood {
  Pose X_WO;
  PoseEquations frame;          ///< The frame's alone: of what moves, it is all.
  PoseEquations resting;        ///< The same with what follows from resting there.
  double log_peak = 0.0;        ///< nats, at the maximum of `resting` ...
  double log_frame_peak = 0.0;  ///< ... and of `frame`.
  ParticleWeight report = {};   ///< Where the resting object is after it.

  bool covers(const Pose& other_X_WO) const;
  /// nats, of what follows for a prediction of what rests, or of what moves.
  double log_evidence(const StillUpdate& update) const { return log_peak + update.log_evidence; }
  double log_frame_evidence(const StillUpdate& update) const { return log_frame_peak + update.log_evidence; }
  /// For a prediction about `X_WO_before`.
  StillUpdate update(const Pose& X_WO_before, const Matrix6d& covariance) const;
  StillUpdate update_by_frame(const Pose& X_WO_before, const Matrix6d& covariance) const;
};

/// A particle for which the frame has nothing new: by what is known of the frame already. False, and nothing is done,
/// where it is to look for a mode of its own.
bool update_quietly(const FrameLikelihood& near, belief::Particle& particle);

/// Resting particles that are about alike, of which the first stands for all: what the frame says is found out at its
/// pose (or taken from `near`, to weigh them), and each takes what follows for its own mean and covariance. Nothing,
/// and nothing is done, where that is not enough: at a pose that is hidden, or that the frame wants elsewhere than a
/// still object can be.
std::optional<FrameLikelihood> update_still(const ParticleUpdate& frame, double dt,
                                            std::span<const std::size_t> members, const WeightOptions& options,
                                            const FrameLikelihood* near, std::vector<belief::Particle>& particles,
                                            std::vector<ParticleWeight>& reports);

/// Resting particles in groups of those about alike, heaviest first; all others, one by one.
struct StillGroups {
  std::vector<std::vector<std::size_t>> still;
  std::vector<std::size_t> others;
};

/// `terms_of`: as in WeightContext; those of a group are the same.
StillGroups still_groups_of(const std::vector<belief::Particle>& particles,
                            std::span<const rendering::FrameTerms* const> terms_of);

}  // namespace prescene::filter
