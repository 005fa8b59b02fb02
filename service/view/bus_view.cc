// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/bus_view.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <thread>
#include <utility>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/live/log_limiter.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

using interfaces::ReceivedMessage;
using interfaces::TopicQos;

constexpr std::chrono::milliseconds kLook(50);
constexpr std::size_t kMostMarkerPoints = 100'000;

/// The triangles of a marker, or null where they are none.
belief::MeshPtr mesh_of_marker(const interfaces::RosMarker& marker) {
  const bool is_mesh = marker.type == static_cast<std::int32_t>(interfaces::RosMarkerType::kTriangleList) &&
                       marker.action == static_cast<std::int32_t>(interfaces::RosMarkerAction::kAdd);
  if (!is_mesh || marker.points.empty() || marker.points.size() % 3 != 0 || marker.points.size() > kMostMarkerPoints)
    return nullptr;
  geometry::TriangleMesh mesh;
  for (const interfaces::RosPoint& p : marker.points) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return nullptr;
    mesh.vertices.emplace_back(p.x, p.y, p.z);
  }
  for (std::uint32_t i = 0; i < mesh.vertices.size(); i += 3) mesh.triangles.push_back({i, i + 1, i + 2});
  return std::make_shared<const geometry::TriangleMesh>(std::move(mesh));
}

/// A belief that says what the summary does: one hypothesis an object.
std::shared_ptr<const belief::Belief> belief_of_summary(const BeliefSummary& summary,
                                                        const belief::Observation& observation,
                                                        std::shared_ptr<const belief::Scene> scene) {
  auto belief = std::make_shared<belief::Belief>();
  belief->step = summary.step;
  belief->stamp_ns = summary.stamp_ns;
  belief->scene = std::move(scene);
  for (const belief::KinematicBody& body : belief->scene->robot) {
    const auto known = observation.robot.find(body.name);
    belief->robot.push_back(known == observation.robot.end() ? belief::pose_at(body, 0.0) : known->second);
  }
  for (const ObjectSummary& object : summary.objects) {
    belief::ObjectBelief& known = belief->objects.emplace_back();
    known.name = object.name;
    known.particles.resize(1);
    known.particles[0].X_WO = object.X_WO;
    known.particles[0].covariance.block<6, 6>(0, 0) = object.covariance;
  }
  return belief;
}

}  // namespace

struct BusView::Impl {
  Impl(std::shared_ptr<const belief::Scene> a_scene, const BusViewSettings& of, core::LogSink a_log)
      : settings(of),
        given_scene(std::move(a_scene)),
        log(std::move(a_log)),
        bus_log(log, {}),
        cameras(camera_inputs(of.tracker, given_scene ? *given_scene : belief::Scene())),
        frames(cameras, given_scene ? robot_names(*given_scene) : std::vector<std::string>(), of.tracker.tf),
        scene(given_scene) {}

  BusViewSettings settings;
  std::shared_ptr<const belief::Scene> given_scene;
  core::LogSink log;
  LogLimiter bus_log;  // of what the middleware says

  std::vector<CameraInput> cameras;

  // Of the bus's thread.
  CameraFrames frames;
  MessageIndex next_index = 0;
  belief::Observation observation;  // the newest
  std::shared_ptr<const belief::Scene> scene;
  std::map<std::int32_t, interfaces::RosMarker> markers;  // by their ids
  std::vector<std::string> names;                         // of the objects of `scene`
  bool heard = false;

  std::unique_ptr<LiveView> view;
  interfaces::DdsPublisher queries;
  std::unique_ptr<interfaces::DdsNode> node;  // last: its thread ends first

  ~Impl() {
    if (node) node->stop_receiving();
    if (view) view->set_asker({});
    node.reset();
  }

  core::Status join();
  void take_frame_part(const ReceivedMessage& message);
  void take_belief(const ReceivedMessage& message);
  void take_markers(const ReceivedMessage& message);
  void take_health(const ReceivedMessage& message);
  void make_scene(const BeliefSummary& summary);
};

core::Result<std::unique_ptr<BusView>> BusView::create(const std::shared_ptr<const belief::Scene>& scene,
                                                       const BusViewSettings& settings, const core::LogSink& log) {
  auto impl = std::make_unique<Impl>(scene, settings, log);
  auto shown = scene ? scene : std::make_shared<const belief::Scene>();
  ViewOptions options = settings.view;
  options.world_frame = settings.tracker.assembler.world_frame;
  PRESCENE_TRY(impl->view, LiveView::create(std::move(shown), options, log));
  interfaces::DdsOptions dds = settings.dds;
  dds.node_name = "prescene_view";
  PRESCENE_TRY(impl->node, interfaces::DdsNode::create(dds, impl->bus_log.sink()));
  PRESCENE_RETURN_IF_ERROR(impl->join());
  return std::unique_ptr<BusView>(new BusView(std::move(impl)));
}

BusView::BusView(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BusView::~BusView() = default;

std::string BusView::url() const { return impl_->view->url(); }
int BusView::port() const { return impl_->view->port(); }

core::Status BusView::Impl::join() {
  PRESCENE_TRY(queries, node->advertise(kQueryTopic, "std_msgs/msg/String", TopicQos::kReliable));
  view->set_asker([this](const std::string& question) {
    const core::Status sent = node->publish(queries, interfaces::RosString{question});
    if (!sent.ok()) core::log(log, core::LogLevel::kWarning, sent.message());
  });
  const auto subscribe = [&](const std::string& topic, const std::string& type, TopicQos qos, auto take) {
    return node->subscribe(topic, type, qos, [this, take](ReceivedMessage&& message) { (this->*take)(message); });
  };
  const auto is_input = [this](const std::string& name) {
    return std::any_of(cameras.begin(), cameras.end(), [&](const CameraInput& camera) {
      const InputTopics& topics = camera.topics;
      return name == topics.depth || name == topics.color || name == topics.camera_info || name == topics.tf ||
             name == topics.tf_static || (settings.tracker.assembler.robot && name == topics.joint_states);
    });
  };
  for (const BusTopic& topic : topics_of_cameras(cameras)) {
    const bool is_of_frames = is_input(topic.name);
    if (is_of_frames) PRESCENE_RETURN_IF_ERROR(subscribe(topic.name, topic.type, topic.read, &Impl::take_frame_part));
  }
  PRESCENE_RETURN_IF_ERROR(subscribe(kBeliefTopic, "std_msgs/msg/String", TopicQos::kState, &Impl::take_belief));
  PRESCENE_RETURN_IF_ERROR(
      subscribe(kMarkersTopic, "visualization_msgs/msg/MarkerArray", TopicQos::kState, &Impl::take_markers));
  PRESCENE_RETURN_IF_ERROR(
      subscribe(kDiagnosticsTopic, "diagnostic_msgs/msg/DiagnosticArray", TopicQos::kState, &Impl::take_health));
  return node->subscribe(kAnswerTopic, "std_msgs/msg/String", TopicQos::kCommands, [this](ReceivedMessage&& message) {
    const auto answer = interfaces::decode_cdr<interfaces::RosString>(message.cdr);
    if (answer && !text_is_so_far(answer->data)) view->answer(answer->data);
  });
}

void BusView::Impl::take_frame_part(const ReceivedMessage& message) {
  // What is refused here the service refuses too, and says why.
  static_cast<void>(frames.take_in(message, next_index++, message.received_ns));
  while (auto frame = frames.take(message.received_ns)) {
    observation = std::move(frame->observation);
    if (cameras.size() > 1) view->note_frame(observation);
  }
  static_cast<void>(frames.take_skipped());
}

void BusView::Impl::take_markers(const ReceivedMessage& message) {
  const auto array = interfaces::decode_cdr<interfaces::RosMarkerArray>(message.cdr);
  if (!array || given_scene) return;
  constexpr std::size_t kMostMarkers = 1000;
  for (const interfaces::RosMarker& marker : array->markers)
    if (marker.ns == "prescene" && (markers.size() < kMostMarkers || markers.contains(marker.id)))
      markers[marker.id] = marker;
}

void BusView::Impl::make_scene(const BeliefSummary& summary) {
  std::vector<std::string> wanted;
  belief::Scene made;
  made.name = "what is on the bus";
  for (std::size_t i = 0; i < summary.objects.size(); ++i) {
    const ObjectSummary& object = summary.objects[i];
    // An object's mesh has twice its number, and its label the number after it.
    const auto marker = markers.find(static_cast<std::int32_t>(2 * i));
    if (marker == markers.end()) continue;
    belief::ObjectModel model;
    model.visual = mesh_of_marker(marker->second);
    if (!model.visual) continue;
    model.name = object.name;
    model.color = {marker->second.color.r, marker->second.color.g, marker->second.color.b};
    belief::SceneObject& known = made.objects.emplace_back();
    known.name = object.name;
    known.model = static_cast<int>(made.models.size());
    made.models.push_back(std::move(model));
    wanted.push_back(object.name);
  }
  if (scene && wanted == names) return;
  names = std::move(wanted);
  scene = std::make_shared<const belief::Scene>(std::move(made));
}

void BusView::Impl::take_belief(const ReceivedMessage& message) {
  const auto text = interfaces::decode_cdr<interfaces::RosString>(message.cdr);
  if (!text) return;
  auto summary = belief_summary_from_json(text->data);
  if (!summary) return view->set_health("a belief was left out: " + summary.status().message());
  heard = true;
  if (!given_scene) make_scene(*summary);
  ShownStep step{belief_of_summary(*summary, observation, scene), observation, 0.0, {}};
  step.summary = std::make_shared<const BeliefSummary>(*std::move(summary));
  view->show(std::move(step));
}

void BusView::Impl::take_health(const ReceivedMessage& message) {
  const auto array = interfaces::decode_cdr<interfaces::RosDiagnosticArray>(message.cdr);
  if (!array) return;
  for (const interfaces::RosDiagnosticStatus& status : array->status)
    if (status.name.starts_with("prescene")) view->set_health(status.message);
}

void BusView::run(const core::Cancellation& cancellation) {
  const std::string none = std::string("no service publishes ") + kBeliefTopic + " in DDS domain " +
                           std::to_string(impl_->settings.dds.domain) + ": start `prescene serve`";
  constexpr int kLooksBeforeReport = 60;  // of kLook: discovery takes a moment
  bool reported = false;
  for (int looks = 0; !cancellation.requested(); ++looks) {
    std::this_thread::sleep_for(kLook);
    const bool alone = looks >= kLooksBeforeReport && impl_->node->other_writers(kBeliefTopic) == 0;
    if (alone && !reported) {
      core::log(impl_->log, core::LogLevel::kWarning, none);
      impl_->view->set_health(none);
    }
    if (!alone && reported) impl_->view->set_health("");
    reported = alone;
  }
}

}  // namespace prescene::service
