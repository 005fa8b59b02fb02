// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/live_view.h"

#include <condition_variable>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <utility>

#include "json_fields.h"
#include "picture_pace.h"
#include "prescene/belief/json.h"
#include "prescene/core/thread_priority.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/view/question_ids.h"
#include "prescene/service/view/view_history.h"

namespace prescene::service {
namespace {

using interfaces::WebClient;
using interfaces::WebDelivery;
using nlohmann::ordered_json;

constexpr double kPicturesPerSecond = 15.0, kStripsPerSecond = 0.5, kIdlePerSecond = 0.5;
constexpr std::size_t kMostLiveStrips = 64;

}  // namespace

struct LiveView::Impl {
  std::unique_ptr<ViewServer> server;

  std::mutex asker_mutex;
  std::function<void(std::string)> asker;

  std::mutex mutex;  // guards what is handed over
  std::condition_variable changed;
  std::optional<ShownStep> waiting;
  std::map<int, belief::Observation> frames;  // of several cameras the newest of each
  std::string health;
  bool health_changed = false;
  bool stop = false;

  std::mutex shown_mutex;  // guards what a page that opens is given
  interfaces::WebMessagePtr scene, step;
  std::map<int, interfaces::WebMessagePtr> pictures;  // by camera
  ViewHistory history;
  std::vector<interfaces::WebMessagePtr> strips;

  // Of the view's thread.
  std::uint64_t next_index = 0;
  std::shared_ptr<const belief::Scene> last_scene;
  std::uint64_t scene_hash = 0, revision = 0;
  struct Pictured {
    Pace pace{kPicturesPerSecond};
    std::optional<core::TimeNs> stamp_ns;  // of the frame whose picture was made last
  };
  std::map<int, Pictured> pictured;  // by camera
  PicturedFrames stripped;
  Pace strip_pace{kStripsPerSecond}, idle_pace{kIdlePerSecond};
  std::thread thread;

  /// Of the newest frames; with the lock.
  void note(const belief::Scene& of, const belief::Observation& observation);
  void work();
  void show(const ShownStep& shown);
  void show_strip(const ShownStep& shown, std::uint64_t index);
  void show_picture(const belief::Observation& frame, std::uint64_t index, bool watched);
  void open(WebClient client);
  void take(WebClient client, const std::string& op, const ordered_json& request);

  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      stop = true;
    }
    changed.notify_all();
    if (thread.joinable()) thread.join();
    server.reset();
  }
};

core::Result<std::unique_ptr<LiveView>> LiveView::create(std::shared_ptr<const belief::Scene> scene,
                                                         const ViewOptions& options, const core::LogSink& log) {
  auto impl = std::make_unique<Impl>();
  Impl* raw = impl.get();
  ViewOptions of_scene = options;
  for (int i = 0; !scene->more_cameras.empty() && i < belief::camera_count(*scene); ++i)
    of_scene.cameras.push_back(belief::camera_at(*scene, i)->name);
  impl->scene = view_text(scene_document(*scene), WebDelivery::kEach);
  impl->scene_hash = scene_shape_hash(*scene);
  impl->last_scene = std::move(scene);
  ViewHandlers handlers;
  handlers.on_open = [raw](WebClient client) { raw->open(client); };
  handlers.on_request = [raw](WebClient client, const std::string& op, const ordered_json& request) {
    raw->take(client, op, request);
  };
  PRESCENE_TRY(auto server, ViewServer::create(of_scene, true, std::move(handlers), log));
  {
    const std::lock_guard lock(raw->shown_mutex);  // a page may be opening already
    impl->server = std::move(server);
  }
  impl->thread = std::thread([raw] { raw->work(); });
  return std::unique_ptr<LiveView>(new LiveView(std::move(impl)));
}

LiveView::LiveView(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LiveView::~LiveView() = default;

std::string LiveView::url() const { return impl_->server->url(); }
int LiveView::port() const { return impl_->server->port(); }
interfaces::WebCounts LiveView::counts() const { return impl_->server->counts(); }

void LiveView::set_asker(std::function<void(std::string)> asker) {
  const std::lock_guard lock(impl_->asker_mutex);
  impl_->asker = std::move(asker);
}

void LiveView::show(ShownStep step) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->note(*step.belief->scene, step.observation);
    impl_->waiting = std::move(step);
  }
  impl_->changed.notify_one();
}

void LiveView::note_frame(const belief::Observation& observation) {
  const std::lock_guard lock(impl_->mutex);
  impl_->frames[observation.camera] = observation;
}

void LiveView::set_health(const std::string& text) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->health_changed = impl_->health_changed || impl_->health != text;
    impl_->health = text;
  }
  impl_->changed.notify_one();
}

void LiveView::answer(const std::string& answer) {
  if (const auto asked = asker_of(answer)) impl_->server->send(asked->client, answer_message(*asked, answer));
}

void LiveView::Impl::open(WebClient client) {
  const std::lock_guard lock(shown_mutex);
  if (!server) return;
  server->send(client, view_text(JsonFields().text("op", "hello").text("mode", "live").take(), WebDelivery::kEach));
  server->send(client, scene);
  server->send(client, view_text(to_json(history), WebDelivery::kEach));
  for (const auto& strip : strips) server->send(client, strip);
  if (step) server->send(client, step);
  for (const auto& [camera, picture] : pictures) server->send(client, picture);
}

void LiveView::Impl::take(WebClient client, const std::string& op, const ordered_json& request) {
  if (op != "ask") return;
  PageQuestion asked{client, 0};
  const auto question = question_text(asked, request);
  const std::lock_guard lock(asker_mutex);
  if (question && asker) return asker(*question);
  const core::Status why = question ? core::unavailable("the service ends") : question.status();
  server->send(client, answer_message(asked, belief::json_text(belief::error_to_json(why))));
}

void LiveView::Impl::work() {
  core::lower_thread_priority();  // who looks on does not take the processor from who tracks
  for (;;) {
    std::optional<ShownStep> shown;
    std::optional<std::string> health_text;
    {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return stop || waiting || health_changed; });
      if (stop) return;
      shown = std::exchange(waiting, std::nullopt);
      if (shown) shown->frames = frames;
      if (std::exchange(health_changed, false)) health_text = health;
    }
    try {
      if (shown) show(*shown);
      if (health_text)
        server->send_to_all(
            view_text(JsonFields().text("op", "health").text("text", *health_text).take(), WebDelivery::kNewest));
    } catch (const std::exception&) {  // no memory: the next step is shown, or the one after it
    }
  }
}

void LiveView::Impl::show(const ShownStep& shown) {
  const BeliefSummary summary = summary_of(shown);
  const std::uint64_t index = next_index++;
  interfaces::WebMessagePtr new_history;
  {
    const std::lock_guard lock(shown_mutex);
    const std::size_t runs = history.runs().size();
    history.add(summary, index);
    ordered_json new_runs = ordered_json::array();
    for (std::size_t i = runs; i < history.runs().size(); ++i) new_runs.push_back(to_json(history.runs()[i]));
    if (history.revision() != revision) {
      new_history = view_text(to_json(history), WebDelivery::kEach);
    } else if (!new_runs.empty()) {  // a page makes the rows from the steps, of which it may miss some
      new_history = view_text(JsonFields()
                                  .text("op", "rows")
                                  .field("rows", ordered_json::array())
                                  .field("runs", std::move(new_runs))
                                  .take(),
                              WebDelivery::kEach);
    }
    revision = history.revision();
  }
  if (new_history) server->send_to_all(new_history);
  server->publish_step(shown, summary);
  const bool watched = server->has_clients();
  if (!watched && !idle_pace.due()) return;  // a page that opens is to find something
  if (shown.belief->scene != last_scene) {
    last_scene = shown.belief->scene;
    const std::uint64_t hash = scene_shape_hash(*last_scene);
    if (hash != scene_hash) {
      auto message = view_text(scene_document(*last_scene), WebDelivery::kEach);
      server->send_to_all(message);
      const std::lock_guard lock(shown_mutex);
      scene = std::move(message);
      scene_hash = hash;
    }
  }
  ordered_json document = step_document(shown, summary, index);
  {
    const std::lock_guard lock(shown_mutex);
    document["time"] = history.seconds_of(summary.stamp_ns);
  }
  auto message = view_text(document, WebDelivery::kNewest);
  server->send_to_all(message);
  {
    const std::lock_guard lock(shown_mutex);
    step = std::move(message);
  }
  show_strip(shown, index);
  if (shown.frames.empty()) show_picture(shown.observation, index, watched);
  for (const auto& [camera, frame] : shown.frames)
    if (pictured[camera].stamp_ns != frame.stamp_ns) show_picture(frame, index, watched);
}

void LiveView::Impl::note(const belief::Scene& of, const belief::Observation& observation) {
  if (!of.more_cameras.empty()) frames[observation.camera] = observation;
}

void LiveView::Impl::show_strip(const ShownStep& shown, std::uint64_t index) {
  if (!stripped.has(shown.observation) || !strip_pace.due()) return;
  const std::string jpeg = picture_jpeg(shown.observation, kStripWidth, kStripQuality);
  auto message = view_picture(ViewPictureKind::kStrip, index, jpeg, WebDelivery::kEach, shown.observation.camera);
  server->send_to_all(message);
  const std::lock_guard lock(shown_mutex);
  strips.push_back(std::move(message));
  if (strips.size() > kMostLiveStrips) strips.erase(strips.begin());
}

void LiveView::Impl::show_picture(const belief::Observation& frame, std::uint64_t index, bool watched) {
  Pictured& of_camera = pictured[frame.camera];
  if (watched && !of_camera.pace.due()) return;
  of_camera.stamp_ns = frame.stamp_ns;
  const std::string jpeg = picture_jpeg(frame, kPictureWidth, kPictureQuality);
  if (jpeg.empty()) return;
  auto message = view_picture(ViewPictureKind::kFrame, index, jpeg, WebDelivery::kNewest, frame.camera);
  server->send_to_all(message);
  const std::lock_guard lock(shown_mutex);
  pictures[frame.camera] = std::move(message);
}

}  // namespace prescene::service
