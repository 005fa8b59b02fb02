// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/simulated_recording.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/interfaces/images/lens_warp.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/recording/foreseen.h"
#include "prescene/service/recording/happened.h"
#include "prescene/service/tracking/camera_frames.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

// Of what happened, motion is looked at more often than the cameras do, as long as that takes little memory.
constexpr double kFinest = 1.0 / 240.0;  // s
constexpr double kMostFineStates = 2e4;  // some 3 kB each where there are 16 objects

bool is_transparent(const rendering::RenderInstance& instance) {
  return instance.material.behind > rendering::SurfaceMaterial::opaque().behind;
}

/// A message that is due; the recording is written in the order of these times.
struct Due {
  core::TimeNs time_ns;
  std::function<core::Status()> write;
};

/// A camera that takes the scene.
struct Taker {
  const belief::SceneCamera& scene;
  InputTopics topics;
  std::string frame;
  rendering::SimulatedCamera camera;
  std::optional<interfaces::LensWarp> warp = {};  // where there is a lens
};

class Player {
 public:
  Player(const belief::Scene& scene, const std::vector<PlayedPart>& parts, const SimulatedRecordingOptions& options,
         std::uint64_t seed, Backends& backends, rendering::Renderer& renderer, RecordingWriter& recording)
      : scene_(scene),
        parts_(parts),
        options_(options),
        backends_(backends),
        renderer_(renderer),
        recording_(recording),
        noise_(seed, core::Purpose::kSensorNoise) {
    TrackerSettings settings;
    settings.topics = options.topics;
    const std::vector<CameraInput> inputs = camera_inputs(settings, scene);
    for (int i = 0; i < belief::camera_count(scene); ++i) {
      const belief::SceneCamera& camera = *belief::camera_at(scene, i);
      Taker taker{camera, inputs[std::min(static_cast<std::size_t>(i), inputs.size() - 1)].topics,
                  camera_frame_of(scene, i),
                  rendering::SimulatedCamera(
                      rendering::SensorModel(filter::with_settings(options.sensor, belief::depth_noise_of(scene, i))),
                      options.camera)};
      if (!options.lens.is_none()) taker.warp = interfaces::LensWarp::distorting(camera.intrinsics, options.lens);
      cameras_.push_back(std::move(taker));
    }
  }

  core::Status write_camera_poses() {
    interfaces::RosTfMessage message;
    for (const Taker& camera : cameras_)
      message.transforms.push_back(interfaces::to_ros_transform(
          interfaces::FrameTransform{options_.world_frame, camera.frame, options_.start_ns, camera.scene.X_WC}));
    return write(options_.topics.tf_static, "tf2_msgs/msg/TFMessage", options_.start_ns,
                 interfaces::encode_cdr(message));
  }

  core::Status write_robot(double time) {
    interfaces::RosTfMessage message;
    for (std::size_t body = 0; body < scene_.robot.size(); ++body) {
      const geometry::Pose X_WG = robot_pose_in(parts_, static_cast<int>(body), time);
      message.transforms.push_back(interfaces::to_ros_transform(
          interfaces::FrameTransform{options_.world_frame, scene_.robot[body].name, stamp(time), X_WG}));
    }
    return write(options_.topics.tf, "tf2_msgs/msg/TFMessage", stamp(time), interfaces::encode_cdr(message));
  }

  core::Status write_control(const belief::Action& action) {
    belief::Action now = action;
    now.time = 0.0;  // relative to the message
    const ordered_json json = {{"stamp_ns", stamp(action.time)},
                               {"actions", ordered_json::array({belief::to_json(now)})}};
    return write(kControlTopic, "std_msgs/msg/String", stamp(action.time),
                 interfaces::encode_cdr(interfaces::RosString{belief::json_text(json)}));
  }

  /// Of the camera whose turn it is. `scene`: with the objects that are there now, which are the state's.
  core::Status write_frame(std::uint64_t number, const belief::Scene& scene, const belief::WorldState& state) {
    const std::size_t turn = number % cameras_.size();
    const Taker& taker = cameras_[turn];
    std::vector<geometry::Pose> X_WG;
    for (std::size_t body = 0; body < scene_.robot.size(); ++body) {
      X_WG.push_back(robot_pose_in(parts_, static_cast<int>(body), state.time));
    }
    const filter::BeliefView view =
        filter::render_scene(scene, state, X_WG, filter::MeshDetail::kDisplay, backends_.meshes());
    const belief::SceneCamera& camera = taker.scene;
    rendering::RenderOptions render_options;
    render_options.normals = true;
    render_options.color = rendering::has_looks(view.scene);
    rendering::RenderedView images;
    PRESCENE_RETURN_IF_ERROR(renderer_.render(view.scene, camera.intrinsics, camera.X_WC, render_options, &images));
    rendering::RenderedView behind;
    const bool sees_through = std::any_of(view.scene.instances.begin(), view.scene.instances.end(), is_transparent);
    if (sees_through) {
      rendering::RenderScene rest = view.scene;
      std::erase_if(rest.instances, is_transparent);
      PRESCENE_RETURN_IF_ERROR(renderer_.render(rest, camera.intrinsics, camera.X_WC, render_options, &behind));
    }
    geometry::DepthImage depth;
    geometry::ColorImage color;
    taker.camera.sample(view.scene, images, sees_through ? &behind : nullptr, camera.intrinsics, camera.X_WC, noise_,
                        number, &depth, &color);

    if (taker.warp) {
      PRESCENE_TRY(depth, taker.warp->depth(depth));
      PRESCENE_TRY(color, taker.warp->color(color));
    }

    const core::TimeNs stamp_ns = stamp(state.time);
    const interfaces::RosHeader header{interfaces::to_ros_time(stamp_ns), taker.frame};
    PRESCENE_RETURN_IF_ERROR(
        write(taker.topics.camera_info, "sensor_msgs/msg/CameraInfo", stamp_ns,
              interfaces::encode_cdr(interfaces::to_ros_camera_info(camera.intrinsics, header, options_.lens))));
    if (!taker.topics.color.empty()) {
      PRESCENE_RETURN_IF_ERROR(write(taker.topics.color, "sensor_msgs/msg/Image", stamp_ns,
                                     interfaces::encode_cdr(interfaces::to_ros_image(color, header))));
    }
    PRESCENE_RETURN_IF_ERROR(write(taker.topics.depth, "sensor_msgs/msg/Image", stamp_ns,
                                   interfaces::encode_cdr(interfaces::to_ros_image_16uc1(depth, header))));
    PRESCENE_RETURN_IF_ERROR(recording_.write_json(kTruthTopic,
                                                   belief::json_text(to_json(truth(scene, state, view, taker, images))),
                                                   stamp_ns + core::ns_of(options_.latency)));
    return options_.on_frame ? options_.on_frame({static_cast<int>(turn), scene, view, images, depth, color})
                             : core::ok_status();
  }

  core::Status write_happened(const HappenedRecord& record, double end) {
    return recording_.write_json(kHappenedTopic, belief::json_text(to_json(record)),
                                 stamp(end) + core::ns_of(options_.latency));
  }

  core::Status write_outcomes(const belief::Trajectory& trajectory) {
    if (scene_.outcomes.empty() && scene_.exclusive_outcomes.empty()) return core::ok_status();
    return recording_.write_json(kOutcomeTopic,
                                 belief::json_text(to_json(outcomes_of(scene_, trajectory, options_.start_ns))),
                                 stamp(trajectory.final().time) + core::ns_of(options_.latency));
  }

 private:
  core::TimeNs stamp(double time) const { return options_.start_ns + core::ns_of(time); }

  core::Status write(const std::string& topic, const std::string& type, core::TimeNs stamp_ns,
                     std::vector<std::uint8_t> cdr) {
    const auto written = recording_.write(
        interfaces::ReceivedMessage{topic, type, std::move(cdr), stamp_ns, stamp_ns + core::ns_of(options_.latency)});
    return written.status();
  }

  /// Of each object the share of the pixels that it would cover alone in a camera's view, `images`.
  std::vector<double> visible_shares(std::size_t objects, const filter::BeliefView& view,
                                     const belief::SceneCamera& camera, const rendering::RenderedView& images) {
    std::vector<double> shares(objects, 0.0);
    std::vector<int> visible(view.scene.instances.size() + 1, 0);
    for (std::size_t i = 0; i < images.labels.size(); ++i) ++visible[images.labels.data()[i]];
    for (std::size_t i = 0; i < objects; ++i) {
      rendering::RenderScene alone;
      alone.instances.push_back(view.scene.instances[i]);
      rendering::RenderedView alone_view;
      if (!renderer_.render(alone, camera.intrinsics, camera.X_WC, {}, &alone_view).ok()) continue;
      const auto* labels = alone_view.labels.data();
      const auto covered =
          std::count_if(labels, labels + alone_view.labels.size(), [](std::uint16_t l) { return l != 0; });
      if (covered > 0) shares[i] = static_cast<double>(visible[i + 1]) / static_cast<double>(covered);
    }
    return shares;
  }

  TruthRecord truth(const belief::Scene& scene, const belief::WorldState& state, const filter::BeliefView& view,
                    const Taker& taker, const rendering::RenderedView& images) {
    TruthRecord record;
    record.stamp_ns = stamp(state.time);
    std::vector<double> shares = visible_shares(scene.objects.size(), view, taker.scene, images);
    for (const Taker& other : cameras_) {
      rendering::RenderedView others_images;
      if (&other == &taker ||
          !renderer_.render(view.scene, other.scene.intrinsics, other.scene.X_WC, {}, &others_images).ok())
        continue;
      const std::vector<double> more = visible_shares(scene.objects.size(), view, other.scene, others_images);
      for (std::size_t i = 0; i < shares.size(); ++i) shares[i] = std::max(shares[i], more[i]);
    }
    for (std::size_t i = 0; i < scene.objects.size(); ++i)
      record.objects.push_back({scene.objects[i].name, state.objects[i].X_WO, shares[i]});
    for (const belief::SceneObject& object : scene_.objects)
      if (!belief::find_object(scene, object.name)) record.objects.push_back({object.name, {}, 0.0, false});
    return record;
  }

  const belief::Scene& scene_;
  const std::vector<PlayedPart>& parts_;
  const SimulatedRecordingOptions& options_;
  Backends& backends_;
  rendering::Renderer& renderer_;
  RecordingWriter& recording_;
  core::RandomStream noise_;
  std::vector<Taker> cameras_;
};

/// What happened in the scene that was played every `interval` s, by looking at it more closely.
core::Result<HappenedRecord> look_closely(const belief::Scene& scene, const SimulatedRecordingOptions& options,
                                          double interval, std::uint64_t seed, Backends& backends,
                                          const core::Cancellation& cancellation) {
  const double most = std::max(1.0, kMostFineStates * interval / scene.duration);
  const double finer = std::clamp(std::round(interval / kFinest), 1.0, std::floor(most));
  std::vector<UnannouncedChange> changes = options.changes;
  for (UnannouncedChange& change : changes) change.time = frame_of_change(scene, change.time, interval);
  PRESCENE_TRY(const std::vector<PlayedPart> parts, play_scene(scene, changes, backends.simulator_factory(),
                                                               interval / finer, seed, backends.pool(), &cancellation));
  PRESCENE_TRY(const auto simulator, backends.make_simulator(scene));
  HappenedRecord record = happened_in(scene, changes, parts, options.reports_robot);
  record.first_ns = options.start_ns;
  record.stepper = simulator->stepper().name;
  record.step = simulator->step_size();
  record.resolution = interval / finer;
  return record;
}

}  // namespace

std::string camera_frame_of(const belief::Scene& scene, int camera) {
  const belief::SceneCamera& of = *belief::camera_at(scene, camera);
  return of.frame.empty() ? of.name + "_optical_frame" : of.frame;
}

core::Status simulate_recording(const belief::Scene& scene, const SimulatedRecordingOptions& options,
                                std::uint64_t seed, Backends& backends, const core::Cancellation& cancellation,
                                const core::ProgressSink& progress, RecordingWriter& recording) {
  if (!scene.camera) {
    return core::invalid_input("scene '" + scene.name +
                               "' has no camera to record with: add one (docs/reference/scene_files.md)");
  }
  if (options.on_frame && !options.lens.is_none())
    return core::invalid_input(
        "frames with what they show cannot be had through a lens: leave the lens or on_frame out");
  for (int i = 0; i < belief::camera_count(scene); ++i) {
    const belief::SceneCamera& camera = *belief::camera_at(scene, i);
    if (camera.topics && !camera.is_placed)
      return core::invalid_input("camera '" + camera.name +
                                 "' has no place to record from: give it 'look' or 'pose' in the scene file");
  }
  const double interval = 1.0 / (options.rate * belief::camera_count(scene));
  PRESCENE_TRY(const std::vector<PlayedPart> parts, play_scene(scene, options.changes, backends.simulator_factory(),
                                                               interval, seed, backends.pool(), &cancellation));
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  Player player(scene, parts, options, seed, backends, *renderer, recording);

  std::vector<Due> due;
  std::uint64_t number = 0;
  for (const PlayedPart& part : parts) {
    for (const belief::WorldState& state : part.trajectory.states) {
      due.push_back({core::ns_of(state.time),
                     [&player, &part, &state, i = number++] { return player.write_frame(i, part.scene, state); }});
    }
  }
  const double end = parts.back().trajectory.final().time;
  if (!scene.robot.empty() && options.reports_robot) {
    for (int i = 0; i / options.tf_rate <= end; ++i) {
      const double time = i / options.tf_rate;
      due.push_back({core::ns_of(time), [&player, time] { return player.write_robot(time); }});
    }
  }
  for (const belief::Action& action : scene.actions) {
    if (options.reports_robot && action.time <= end)
      due.push_back({core::ns_of(action.time), [&player, &action] { return player.write_control(action); }});
  }
  std::stable_sort(due.begin(), due.end(), [](const Due& a, const Due& b) { return a.time_ns < b.time_ns; });

  PRESCENE_RETURN_IF_ERROR(player.write_camera_poses());
  for (std::size_t i = 0; i < due.size(); ++i) {
    if (cancellation.requested()) return core::cancelled("stopped on request; the frames recorded so far are kept");
    PRESCENE_RETURN_IF_ERROR(due[i].write());
    if (progress) progress({static_cast<double>(i + 1) / static_cast<double>(due.size()), {}, ""});
  }
  const core::Result<HappenedRecord> happened = look_closely(scene, options, interval, seed, backends, cancellation);
  if (happened.status().code() == core::StatusCode::kCancelled)
    return core::cancelled("stopped on request; the frames are kept, without the record of what happened");
  if (!happened) return happened.status();
  PRESCENE_RETURN_IF_ERROR(player.write_happened(*happened, end));
  return options.changes.empty() ? player.write_outcomes(parts.back().trajectory) : core::ok_status();
}

ordered_json to_json(const TruthRecord& record) {
  ordered_json objects = ordered_json::array();
  for (const TruthRecord::Object& object : record.objects) {
    if (object.present) {
      objects.push_back(
          {{"name", object.name}, {"pose", belief::to_json(object.X_WO)}, {"visible_share", object.visible_share}});
    } else {
      objects.push_back({{"name", object.name}, {"present", false}});
    }
  }
  return {{"stamp_ns", record.stamp_ns}, {"objects", objects}};
}

core::Result<TruthRecord> truth_from_json(const std::string& text) {
  const core::Status bad = core::data_loss("a truth record of the recording is damaged");
  const ordered_json json = parse_or_discard(text, kMostParsedJsonBytes);
  if (!json.is_object() || !json.contains("stamp_ns") || !is_stamp(json["stamp_ns"]) || !json.contains("objects") ||
      !json["objects"].is_array())
    return bad;
  TruthRecord record;
  record.stamp_ns = json["stamp_ns"].get<core::TimeNs>();
  for (const ordered_json& object : json["objects"]) {
    if (!object.is_object() || !object.contains("name") || !object["name"].is_string()) return bad;
    if (const auto present = object.find("present"); present != object.end() && *present == false) {
      record.objects.push_back({object["name"].get<std::string>(), {}, 0.0, false});
      continue;
    }
    if (!object.contains("pose")) return bad;
    PRESCENE_TRY(const geometry::Pose X_WO, belief::pose_from_json(object["pose"]));
    const auto share = object.find("visible_share");
    const double visible_share = share != object.end() && share->is_number() ? share->get<double>() : 0.0;
    record.objects.push_back({object["name"].get<std::string>(), X_WO, visible_share});
  }
  return record;
}

}  // namespace prescene::service
