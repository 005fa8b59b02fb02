// SPDX-License-Identifier: Apache-2.0
// What is believed of an object's physical parameters: the priors of its model, reweighted by what its motion showed.
//
//   const PhysicalSampler sampler(model, object.physics);
//   PhysicalParameters drawn = sampler.draw(uniforms);    // uniforms.size() == sampler.dimensions()
//
// Friction, restitution, mass, centre of mass and friction of impacts live apart from the particles, which are about
// poses: resampling poses forgets nothing of the parameters. Before anything was learned the belief is the priors
// themselves, whatever number of frames was seen. Evidence puts weights on the points of a Sobol net in the unit cube
// of the priors' uniform numbers (posterior = prior times likelihood).
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/object_model.h"
#include "prescene/belief/world_state.h"
#include "prescene/core/clock.h"

namespace prescene::belief {

/// How many uniform numbers the uncertain parameters of a model take; 0 = all are known.
int physical_dimensions(const ObjectModel& model);
/// The parameters at a point of the unit cube, in the order friction, restitution, mass, centre of mass, friction of
/// impacts; uniforms.size() == physical_dimensions(model) (checked).
PhysicalParameters physical_at(const ObjectModel& model, std::span<const double> uniforms);
/// Every parameter at its prior's mean.
PhysicalParameters mean_physical(const ObjectModel& model);

/// A weighted point of the unit cube.
struct PhysicalDraw {
  std::vector<double> uniforms;  ///< Each in (0, 1).
  double log_weight = 0.0;       ///< Normalised: the weights of a set sum to one.
  friend bool operator==(const PhysicalDraw&, const PhysicalDraw&) = default;
};

/// Shared by copies, never changed.
struct PhysicalBelief {
  /// Null = nothing was learned: the priors.
  std::shared_ptr<const std::vector<PhysicalDraw>> draws;
  /// Width of the cell about each draw, in every coordinate, over which its weight is spread. The first 2^k points of a
  /// Sobol net have one point in each interval of width 2^-k of each coordinate, so that equal weights spread over
  /// cells of that width are exactly the priors' marginals.
  double cell = 0.0;
  int lessons = 0;              ///< Pieces of evidence that changed the weights.
  core::TimeNs learned_ns = 0;  ///< When the last of them ended.
};
/// Draws compare by content.
bool operator==(const PhysicalBelief& a, const PhysicalBelief& b);

/// Draws parameters from a belief. The model must outlive it.
class PhysicalSampler {
 public:
  PhysicalSampler(const ObjectModel& model, const PhysicalBelief& physics);
  int dimensions() const;
  /// uniforms.size() == dimensions(): those of the parameters, after one for the choice of a draw where anything was
  /// learned.
  PhysicalParameters draw(std::span<const double> uniforms) const;
  /// The mean of the parameters under the belief.
  PhysicalParameters mean() const;

 private:
  const ObjectModel* model_;
  PhysicalBelief physics_;
  std::vector<double> cumulative_;  // of the draws' weights
};

/// Power of two: the points that priors are replaced by once there is evidence.
inline constexpr int kPhysicalDraws = 128;
/// The draws of a belief; of one that has learned nothing, the net of the priors, all of one weight. Empty where the
/// model leaves nothing open. `seed` scrambles the net.
std::vector<PhysicalDraw> draws_of(const ObjectModel& model, const PhysicalBelief& physics, std::uint64_t seed);

/// The belief after evidence: `log_likelihoods` of draws_of(model, physics, seed), one each (-inf = impossible; not
/// all, checked). If the weights come to lie on few draws, these are resampled and jittered about their mean such that
/// mean and covariance stay [Liu & West 2001].
PhysicalBelief after_evidence(const ObjectModel& model, const PhysicalBelief& physics, std::uint64_t seed,
                              std::span<const double> log_likelihoods, core::TimeNs stamp_ns);

/// One parameter as it is believed to be; mass in kg, centre of mass in m in O, the others without unit.
struct ParameterEstimate {
  std::string name;  ///< "friction", "restitution", "mass", "center_of_mass_x", ..., "impact_friction".
  double mean = 0.0;
  double standard_deviation = 0.0;
  double low = 0.0;   ///< 5 % of the belief lie below, ...
  double high = 0.0;  ///< ... 5 % above.
  friend bool operator==(const ParameterEstimate&, const ParameterEstimate&) = default;
};
/// Of the uncertain parameters of the model.
std::vector<ParameterEstimate> parameter_estimates(const ObjectModel& model, const PhysicalBelief& physics);

}  // namespace prescene::belief
