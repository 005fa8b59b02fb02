// SPDX-License-Identifier: Apache-2.0
// Plays a scene as a robot with an RGB-D camera would have recorded it: simulated, rendered, with the sensor model's
// noise.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "prescene/belief/trajectory.h"
#include "prescene/filter/proposals/render_scene.h"
#include "prescene/geometry/lens.h"
#include "prescene/rendering/renderer.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "prescene/service/backends.h"
#include "prescene/service/recording/played_scene.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {

/// A frame as it was recorded, and what it shows. Good for the duration of a call.
struct SimulatedFrame {
  int camera = 0;                         ///< camera_at() of the scene.
  const belief::Scene& scene;             ///< With the objects that are there, in the order of the whole scene.
  const filter::BeliefView& view;         ///< The true state, as it was rendered.
  const rendering::RenderedView& images;  ///< Of `view`, without noise.
  const geometry::DepthImage& depth;      ///< What the camera returned.
  const geometry::ColorImage& color;
};
using SimulatedFrameSink = std::function<core::Status(const SimulatedFrame&)>;

struct SimulatedRecordingOptions {
  double rate = 15.0;                                 ///< Frames a second, of each camera.
  double tf_rate = 60.0;                              ///< Poses of the robot's bodies a second.
  core::TimeNs start_ns = 1'000'000'000'000'000'000;  ///< Stamp of the first frame.
  double latency = 0.004;                             ///< s between the stamp of a message and its arrival.
  InputTopics topics;  ///< Those of the images: where the scene does not list its cameras.
  std::string world_frame = "world";
  rendering::SimulatedCameraOptions camera;
  rendering::SensorModelOptions sensor;  ///< The scene's depth_noise takes precedence.
  /// The camera's lens, which bends the images and is published in the camera info: of plumb_bob's or equidistant's
  /// form.
  geometry::LensDistortion lens;
  /// What happens to objects without being announced. Which outcomes occurred is not recorded then.
  std::vector<UnannouncedChange> changes;
  /// Else the poses of robot bodies and the actions are left out: hands that nobody knows of, which act unannounced.
  bool reports_robot = true;
  /// Called with each frame after it was recorded; what it returns ends the recording where it is not ok. Not through a
  /// lens: what is rendered is not bent.
  SimulatedFrameSink on_frame;
};

/// What the camera frame is called in simulated recordings: as the scene says, else "<camera's name>_optical_frame".
std::string camera_frame_of(const belief::Scene& scene, int camera = 0);

/// One instance of the scene, drawn from its distributions with `seed`, from its start to its duration (it goes on
/// after everything has come to rest, so that the camera sees the end). Messages: latched camera pose, robot poses,
/// camera info, depth (16UC1, millimetres) and colour (rgb8), the scene's actions as controls at their times, the truth
/// of each frame, and in the end what happened (happened.h) and which of the scene's outcomes occurred. Several cameras
/// take turns: they are not triggered together. Fails with kInvalidInput when the scene has no camera, or one of
/// several has no pose, a change is none (play_scene), or frames are asked for (on_frame) through a lens; kCancelled
/// with what is done kept.
core::Status simulate_recording(const belief::Scene& scene, const SimulatedRecordingOptions& options,
                                std::uint64_t seed, Backends& backends, const core::Cancellation& cancellation,
                                const core::ProgressSink& progress, RecordingWriter& recording);

/// The truth of one simulated frame, of whichever camera, on kTruthTopic.
struct TruthRecord {
  core::TimeNs stamp_ns = 0;
  struct Object {
    std::string name;
    geometry::Pose X_WO;
    double visible_share = 0.0;  ///< Of the pixels that it would cover alone, in the view that shows most of it.
    bool present = true;         ///< Else it was taken away, or not put in yet; the pose says nothing then.
  };
  std::vector<Object> objects;
};
nlohmann::ordered_json to_json(const TruthRecord& record);
core::Result<TruthRecord> truth_from_json(const std::string& text);

}  // namespace prescene::service
