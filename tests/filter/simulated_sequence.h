// SPDX-License-Identifier: Apache-2.0
// Simulated RGB-D sequences with known truth: objects on or above a table, seen by the sensor model's camera, with
// occluders that nobody knows of.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/filter/proposals/render_scene.h"
#include "prescene/rendering/renderer.h"
#include "prescene/rendering/sensor/simulated_camera.h"

namespace prescene::filter_tests {

using namespace prescene::filter;  // NOLINT(google-build-using-namespace): these tests are about nothing else
using belief::Pose;
using geometry::Matrix6d;
using geometry::Vector3d;
using geometry::Vector6d;

/// Where something is at a time (s).
using Motion = std::function<Pose(double)>;

/// A thing that is in the picture but not in the scene.
struct Occluder {
  geometry::TriangleMesh mesh;
  Motion X_WM;
};

struct SimulatedSequence {
  std::shared_ptr<const belief::Scene> scene;
  geometry::PinholeCamera camera;
  Pose X_WC;
  std::vector<Motion> objects;  ///< In the scene's order.
  std::vector<Occluder> occluders;
  std::uint64_t seed = 1;
  double frame_rate = 30.0;

  double time_of(int frame) const { return frame / frame_rate; }
  belief::Observation observe(int frame, rendering::Renderer& renderer) const;
  /// Share of the object's pixels that nothing else hides in a frame; 0 when it is out of view.
  double visible_share(int object, int frame, rendering::Renderer& renderer) const;
};

/// A table of 1 m x 1 m whose top is z = 0, and a camera that looks down at it from 0.9 m at 40 degrees.
belief::Support table();
geometry::PinholeCamera test_camera();
Pose test_camera_pose();

belief::ObjectModel box_model(const std::string& name, const Vector3d& size);
belief::ObjectModel can_model(const std::string& name, double radius, double height);
belief::ObjectModel carton_model(const std::string& name);
belief::ObjectModel mesh_model(const std::string& name, geometry::TriangleMesh mesh);

/// A scene of the table and these models, one object each with the model's name, starting near `X_WO` (as far as
/// `shift` m and `turn` rad, standard deviations, say).
std::shared_ptr<const belief::Scene> table_scene(std::vector<belief::ObjectModel> models, const std::vector<Pose>& X_WO,
                                                 double shift, double turn);
/// The same with nothing known but that it is on the table, any way up.
std::shared_ptr<const belief::Scene> open_scene(std::vector<belief::ObjectModel> models);

/// Always there.
Motion fixed(const Pose& X_W);
/// Smooth wandering about a place: sums of sines with the given root mean square speed (m/s) and rate (rad/s).
Motion wandering(const Pose& X_W, double speed, double rate, std::uint64_t seed);
/// A thin plate, facing the camera, that moves in between camera and `target` at time `begin`, stays, and leaves at
/// `end`: `clearance` nearer to the camera than the target.
Occluder plate(const Pose& X_WC, const Motion& target, double clearance, double width, double height, double begin,
               double end);
/// An ellipsoid that comes in the same way.
Occluder blob(const Pose& X_WC, const Motion& target, double clearance, const Vector3d& radii, double begin,
              double end);

}  // namespace prescene::filter_tests
