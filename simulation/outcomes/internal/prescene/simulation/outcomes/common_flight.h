// SPDX-License-Identifier: Apache-2.0
// The time in which a start distribution is one object: as long as nothing can touch anything, the moments of its
// flight describe it completely. What then may touch opens it into instances.
//
//   PRESCENE_TRY(const FlightBodies bodies, FlightBodies::make(scene, shapes));
//   PRESCENE_TRY(const CommonFlight flight,
//                common_flight(scene, bodies, starts, request, make_simulator, stream, pool));
//   ... flight.apart_until, flight.openings[0].probability
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "prescene/belief/prediction.h"
#include "prescene/belief/scene.h"
#include "prescene/collision/spheres/relative_uncertainty.h"
#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/core/random.h"
#include "prescene/simulation/outcomes/start_distribution.h"
#include "prescene/simulation/shape_store.h"
#include "prescene/simulation/simulator.h"

namespace prescene::collision {
class SphereTree;
class StaticShape;
}  // namespace prescene::collision

namespace prescene::simulation {

/// A scene's bodies as uncertain queries want them: objects are spheres, everything else is what it is.
class FlightBodies {
 public:
  /// `length_scale` is Simulator::length_scale() of the simulator that runs the scene's instances: the spheres follow
  /// the surface as closely for things of any size. Fails as the shape store does.
  static core::Result<FlightBodies> make(const belief::Scene& scene, ShapeStore& shapes, double length_scale = 1.0);

  struct Object {
    /// Closed parts, in O; they may overlap.
    std::vector<std::shared_ptr<const collision::SphereTree>> parts;
    /// One sphere about the origin that holds all parts when its centre is at `middle`, in O: however the object turns.
    std::shared_ptr<const collision::SphereTree> ball;
    Vector3d middle = Vector3d::Zero();
    /// Spheres that touch the surface from inside are grown by up to this so that together they cover it, m: things are
    /// called apart that are farther from each other.
    double margin = 0.0;
  };
  const Object& object(std::size_t index) const { return objects_[index]; }
  struct Placed {
    std::shared_ptr<const collision::StaticShape> shape;
    geometry::Pose X_BS;  ///< Of the shape in its body.
  };
  const std::vector<Placed>& support(std::size_t index) const { return supports_[index]; }
  const std::vector<Placed>& robot_body(std::size_t index) const { return robot_[index]; }

 private:
  std::vector<Object> objects_;
  std::vector<std::vector<Placed>> supports_, robot_;
};

/// Two bodies, numbered as in belief::ContactInterval, the first an object.
struct FlightOpening {
  int first = 0, second = 0;
  /// That they touch at a time of the look in which the flight ends, and two standard errors of it. Of bodies grown by
  /// FlightBodies::Object::margin.
  double probability = 0.0, probability_error = 0.0;
};

struct CommonFlight {
  /// s from the start. Nothing touches before, with 0.997 for each pair and look, as far as the distribution is as wide
  /// as a Gaussian of its moments.
  double apart_until = 0.0;
  /// Where the components are in the look in which the flight ends: by component, by object.
  std::vector<std::vector<collision::UncertainPose>> moments;
  /// Why it ends there.
  belief::FlightEnd end = belief::FlightEnd::kRunEnds;
  /// What may touch next, likeliest first; empty unless it ended with kMayTouch.
  std::vector<FlightOpening> openings;
};

/// The values are for things of household size.
struct CommonFlightOptions {
  int draws = 128;               ///< Flights a component that the moments are of, >= 32.
  double interval = 1.0 / 60.0;  ///< Between two looks, s, > 0. A look is at all times since the one before.
  double longest = 10.0;         ///< s, > 0: flights that last longer are not followed.
  double far_away = 1e3;         ///< m: nothing leaves the world of flights within `longest`.

  /// For the scenes of a simulator with this Simulator::length_scale().
  static CommonFlightOptions of(double length_scale);
};

/// Each object flies by itself in `make_simulator`'s empty world, with the request's actions, and the moments of its
/// poses (those of both ends of a look together) are asked whether they touch: uncertain_overlap() of
/// prescene/collision/spheres. The robot's bodies are asked where they are at both ends of a look and in its middle:
/// what moves by more than its own size within half a look could miss something. What is held does not touch what holds
/// it, nor after its release until they have parted. Hands that hold or grasp something go where each draw has them, as
/// Gaussians of these poses. The distribution opens at the first look in which a pair of some component is not surely
/// apart, or a push begins. Errors of different objects, and of hands, count as independent.
/// Fails as the factory does, and with kCancelled.
core::Result<CommonFlight> common_flight(const belief::Scene& scene, const FlightBodies& bodies,
                                         const StartDistribution& starts, const RunRequest& request,
                                         const SimulatorFactory& make_simulator, const core::RandomStream& stream,
                                         core::ThreadPool& pool, const CommonFlightOptions& options = {},
                                         const core::Cancellation* cancellation = nullptr);

}  // namespace prescene::simulation
