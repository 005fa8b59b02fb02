// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>
#include <optional>

#include "prescene/interfaces/images/frame_folder.h"
#include "prescene/interfaces/images/lens_warp.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/calibration/depth_noise.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/recording/replay_input.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/tracking/tracker_settings.h"

namespace prescene::service {
namespace {

core::Status going_on(const core::Cancellation& cancellation) {
  return cancellation.requested() ? core::cancelled("stopped on request") : core::ok_status();
}

core::Status add_folder(const std::filesystem::path& path, double metres_per_unit, const core::ProgressSink& progress,
                        const core::Cancellation& cancellation, DepthNoiseEstimator& estimator) {
  interfaces::FrameFolderOptions options;
  options.metres_per_unit = metres_per_unit;
  PRESCENE_TRY(const interfaces::FrameFolder folder, interfaces::FrameFolder::open(path, options));
  const std::size_t count = folder.frames().size();
  for (std::size_t i = 0; i < count && !estimator.full(); ++i) {
    PRESCENE_RETURN_IF_ERROR(going_on(cancellation));
    PRESCENE_TRY(const interfaces::RgbdImages images, folder.load(i));
    PRESCENE_RETURN_IF_ERROR(estimator.add(images.depth, folder.camera()));
    if (progress) progress({static_cast<double>(i + 1) / static_cast<double>(count), {}, ""});
  }
  return core::ok_status();
}

/// Those of the camera of this name, where the recording's scene lists its cameras.
core::Status take_camera(const std::filesystem::path& path, const std::string& name, TrackerSettings& settings) {
  ReplayInputOptions options;
  options.path = path;
  const auto input = ReplayInput::open(options, {});
  std::vector<CameraInput> cameras;
  if (input && names_topics(*input->scene())) cameras = camera_inputs(settings, *input->scene());
  std::string names;
  for (CameraInput& camera : cameras) {
    if (camera.name == name || (cameras.size() == 1 && name.empty())) {
      settings.topics = std::move(camera.topics);
      settings.assembler = std::move(camera.assembler);
      return core::ok_status();
    }
    names += (names.empty() ? "" : ", ") + camera.name;
  }
  if (!names.empty())
    return core::invalid_input("the cameras of the recording's scene are " + names +
                               ": name one of them with --of-camera");
  if (!name.empty())
    return core::invalid_input("--of-camera " + name + ": the recording's scene lists no cameras: leave it out");
  return core::ok_status();
}

core::Status add_recording(const std::filesystem::path& path, const std::string& name,
                           const core::ProgressSink& progress, const core::Cancellation& cancellation,
                           DepthNoiseEstimator& estimator) {
  PRESCENE_TRY(const auto reader, RecordingReader::open(path));
  TrackerSettings settings;
  if (!reader->info().settings.empty()) {
    PRESCENE_TRY(settings, with_recorded({}, parse_or_discard(reader->info().settings)));
  }
  PRESCENE_RETURN_IF_ERROR(take_camera(path, name, settings));
  const double total = static_cast<double>(reader->message_count().value_or(0));
  double done = 0.0;
  int images = 0;
  std::optional<geometry::PinholeCamera> camera;
  geometry::LensDistortion lens;
  std::optional<interfaces::LensWarp> warp;
  while (!estimator.full()) {
    PRESCENE_RETURN_IF_ERROR(going_on(cancellation));
    PRESCENE_TRY(const auto entry, reader->next());
    if (!entry) break;
    if (progress && total > 0.0) progress({std::min(1.0, ++done / total), {}, ""});
    if (entry->is_json) continue;
    if (entry->message.topic == settings.topics.camera_info) {
      PRESCENE_TRY(const auto info, interfaces::decode_cdr<interfaces::RosCameraInfo>(entry->message.cdr));
      interfaces::CameraRules rules;
      rules.rectified = is_rectified(settings);
      PRESCENE_TRY(const geometry::PinholeCamera new_camera, interfaces::to_camera(info, rules));
      PRESCENE_TRY(const geometry::LensDistortion new_lens, interfaces::to_lens(info, rules));
      if (camera != new_camera || lens != new_lens) warp.reset();
      camera = new_camera;
      lens = new_lens;
    } else if (entry->message.topic == settings.topics.depth) {
      ++images;
      if (!camera) continue;
      interfaces::ImageRules rules;
      rules.mono16_is_depth = settings.assembler.mono16_is_depth;
      PRESCENE_TRY(DepthMessage message, decode_depth(entry->message, rules));
      geometry::DepthImage depth = std::move(message.depth);
      if (!lens.is_none()) {
        if (!warp) warp = interfaces::LensWarp::undistorting(*camera, lens);
        PRESCENE_TRY(depth, warp->depth(depth));
      }
      PRESCENE_RETURN_IF_ERROR(estimator.add(depth, *camera));
    }
  }
  if (images == 0) return core::invalid_input("no depth image on " + settings.topics.depth);
  if (!camera) return core::invalid_input("no camera info on " + settings.topics.camera_info);
  return core::ok_status();
}

}  // namespace

core::Result<DepthNoise> depth_noise_of(const std::filesystem::path& path, double metres_per_unit,
                                        const core::ProgressSink& progress, const core::Cancellation& cancellation,
                                        const std::string& camera) {
  DepthNoiseEstimator estimator;
  const core::Status added = interfaces::is_bag(path)
                                 ? add_recording(path, camera, progress, cancellation, estimator)
                                 : add_folder(path, metres_per_unit, progress, cancellation, estimator);
  if (!added.ok()) return added.at(path.string());
  auto noise = estimator.finish();
  if (!noise) return noise.status().at(path.string());
  return noise;
}

}  // namespace prescene::service
