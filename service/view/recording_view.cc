// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/recording_view.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "json_fields.h"
#include "picture_pace.h"
#include "prescene/belief/json.h"
#include "prescene/service/live/query_worker.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/view/step_store.h"
#include "prescene/service/view/view_history.h"
#include "recording_answers.h"

namespace prescene::service {
namespace {

using interfaces::WebClient;
using interfaces::WebDelivery;
using interfaces::WebMessagePtr;
using nlohmann::ordered_json;

constexpr std::size_t kMostStrips = 64;
constexpr double kExtentsPerSecond = 5.0;

}  // namespace

struct RecordingView::Impl {
  explicit Impl(const RecordingViewOptions& of) : options(of), beliefs(of.most_belief_bytes) {}

  RecordingViewOptions options;
  std::unique_ptr<StepStore> store;

  std::mutex mutex;  // guards what pages are given when they open, and the beliefs
  WebMessagePtr scene;
  ViewHistory history;
  std::uint64_t revision = 0;
  ordered_json new_rows = ordered_json::array(), new_runs = ordered_json::array();
  std::vector<int> cameras;  // whose frame each step is of
  struct Strip {
    std::uint64_t number;  // of the frames that strips are made of
    WebMessagePtr message;
  };
  std::vector<Strip> strips;
  std::uint64_t strip_stride = 10;
  KeptBeliefs beliefs;
  double progress = 0.0;
  bool done = false;
  std::vector<std::string> remarks;

  // Of the replay's thread.
  std::shared_ptr<const belief::Scene> last_scene;
  std::uint64_t scene_hash = 0;
  Pace extent_pace{kExtentsPerSecond};
  PicturedFrames stripped;
  std::uint64_t strip_frames = 0;
  std::map<int, belief::Observation> frames;  // of several cameras the newest of each

  std::unique_ptr<RecordingAnswers> answers;
  std::unique_ptr<ViewServer> server;

  ~Impl() {
    if (answers) answers->stop();  // it sends through the server,
    server.reset();                // which takes questions for it
  }

  void open(WebClient client);
  void take(WebClient client, const std::string& op, const ordered_json& request);
  void ask(WebClient client, const ordered_json& request);
  void show(WebClient client, std::uint64_t index, int camera);
  /// The step at or before this one whose frame is of the camera.
  std::uint64_t step_of(std::uint64_t index, int camera);
  core::Status add(const ShownStep& step);
  void add_strip(const ShownStep& step, std::uint64_t index);
  void send_new_scene(const ShownStep& step);
  void send_news();
  ordered_json extent() const;
};

core::Result<std::unique_ptr<RecordingView>> RecordingView::create(std::shared_ptr<const belief::Scene> scene,
                                                                   const RecordingViewOptions& options,
                                                                   Backends& backends, const core::LogSink& log) {
  auto impl = std::make_unique<Impl>(options);
  Impl* raw = impl.get();
  PRESCENE_TRY(impl->store, StepStore::create());
  impl->scene = view_text(scene_document(*scene), WebDelivery::kEach);
  impl->scene_hash = scene_shape_hash(*scene);
  impl->last_scene = std::move(scene);
  impl->answers = std::make_unique<RecordingAnswers>(options, backends,
                                                     [raw](const PageQuestion& asked, const std::string& answer) {
                                                       raw->server->send(asked.client, answer_message(asked, answer));
                                                     });
  ViewHandlers handlers;
  handlers.on_open = [raw](WebClient client) { raw->open(client); };
  handlers.on_request = [raw](WebClient client, const std::string& op, const ordered_json& request) {
    raw->take(client, op, request);
  };
  {
    const std::lock_guard lock(raw->mutex);  // a page that opens waits for the server to be there
    PRESCENE_TRY(impl->server, ViewServer::create(options.view, false, std::move(handlers), log));
  }
  return std::unique_ptr<RecordingView>(new RecordingView(std::move(impl)));
}

RecordingView::RecordingView(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RecordingView::~RecordingView() = default;

std::string RecordingView::url() const { return impl_->server->url(); }
int RecordingView::port() const { return impl_->server->port(); }
interfaces::WebCounts RecordingView::counts() const { return impl_->server->counts(); }

StepSink RecordingView::step_sink() {
  return [this](const TrackerStep& step, const Tracker& tracker) {
    return add({tracker.belief(), step.observation, step.record.seconds, step.record.degraded});
  };
}

core::Status RecordingView::add(const ShownStep& step) { return impl_->add(step); }

void RecordingView::set_progress(double fraction) {
  const std::lock_guard lock(impl_->mutex);
  impl_->progress = fraction;
}

void RecordingView::finish(const std::vector<std::string>& remarks) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->progress = 1.0;
    impl_->done = true;
    impl_->remarks = remarks;
    if (const std::uint64_t left_out = impl_->store->pictures_left_out(); left_out > 0)
      impl_->remarks.push_back("The pictures of " + std::to_string(left_out) +
                               " steps were left out for want of room.");
  }
  impl_->send_news();
}

ordered_json RecordingView::Impl::extent() const {
  return JsonFields()
      .text("op", "extent")
      .count("steps", store->size())
      .number("progress", progress)
      .flag("done", done)
      .texts("remarks", remarks)
      .take();
}

void RecordingView::Impl::open(WebClient client) {
  const std::lock_guard lock(mutex);
  if (!server) return;
  server->send(client,
               view_text(JsonFields().text("op", "hello").text("mode", "recording").text("title", options.title).take(),
                         WebDelivery::kEach));
  server->send(client, scene);
  server->send(client, view_text(to_json(history), WebDelivery::kEach));
  for (const Strip& strip : strips) server->send(client, strip.message);
  server->send(client, view_text(extent(), WebDelivery::kEach));
}

void RecordingView::Impl::take(WebClient client, const std::string& op, const ordered_json& request) {
  if (op == "ask") return ask(client, request);
  if (op != "show") return;
  if (const auto asked = step_request(request)) show(client, asked->index, asked->camera);
}

std::uint64_t RecordingView::Impl::step_of(std::uint64_t index, int camera) {
  const std::lock_guard lock(mutex);
  for (std::uint64_t i = std::min<std::uint64_t>(index + 1, cameras.size()); i-- > 0;)
    if (cameras[i] == camera) return i;
  return index;
}

void RecordingView::Impl::show(WebClient client, std::uint64_t index, int camera) {
  const auto entry = store->read(index);
  if (!entry) return;
  using interfaces::make_web_message;
  const std::uint64_t of_camera = step_of(index, camera);
  const auto other = of_camera == index ? entry : store->read(of_camera);
  // The step is last: when it is there, the page has all of it and may ask for the next.
  if (other && !other->picture.empty()) {
    int shown = camera;
    {
      const std::lock_guard lock(mutex);
      if (of_camera < cameras.size()) shown = cameras[of_camera];
    }
    server->send(client, view_picture(ViewPictureKind::kFrame, index, other->picture, WebDelivery::kEach, shown));
  }
  server->send(client, make_web_message(interfaces::WebSocketKind::kText, entry->text, WebDelivery::kEach));
}

void RecordingView::Impl::ask(WebClient client, const ordered_json& request) {
  PageQuestion asked{client, 0};
  auto question = question_text(asked, request);
  if (!question) {
    server->send(client, answer_message(asked, error_answer("", question.status())));
    return;
  }
  const auto index = request.find("index");
  std::shared_ptr<const belief::Belief> belief;
  if (index != request.end() && index->is_number_unsigned()) {
    const std::lock_guard lock(mutex);
    belief = beliefs.at(index->get<std::uint64_t>());
  }
  answers->ask(asked, *std::move(question), std::move(belief));
}

core::Status RecordingView::Impl::add(const ShownStep& given) {
  ShownStep step = given;
  const int camera = step.observation.camera;
  if (!step.belief->scene->more_cameras.empty()) frames[camera] = step.observation;
  step.frames = frames;
  const BeliefSummary summary = summary_of(step);
  const std::uint64_t index = store->size();
  send_new_scene(step);
  ordered_json document = step_document(step, summary, index);
  {
    const std::lock_guard lock(mutex);
    const std::size_t runs = history.runs().size();
    if (history.add(summary, index)) new_rows.push_back(to_json(history.rows().back()));
    // Where runs were taken away, all are sent anew.
    for (std::size_t i = runs; i < history.runs().size(); ++i) new_runs.push_back(to_json(history.runs()[i]));
    document["time"] = history.seconds_of(summary.stamp_ns);
    beliefs.add(index, step.belief);
    cameras.push_back(camera);
  }
  PRESCENE_RETURN_IF_ERROR(
      store->add(belief::json_text(document), picture_jpeg(step.observation, kPictureWidth, kPictureQuality)));
  add_strip(step, index);
  if (extent_pace.due()) send_news();
  return core::ok_status();
}

void RecordingView::Impl::add_strip(const ShownStep& step, std::uint64_t index) {
  if (!stripped.has(step.observation)) return;
  const std::uint64_t number = strip_frames++;
  if (number % strip_stride != 0) return;
  const std::string jpeg = picture_jpeg(step.observation, kStripWidth, kStripQuality);
  auto message = view_picture(ViewPictureKind::kStrip, index, jpeg, WebDelivery::kEach, step.observation.camera);
  server->send_to_all(message);
  const std::lock_guard lock(mutex);
  strips.push_back({number, std::move(message)});
  if (strips.size() <= kMostStrips) return;
  strip_stride *= 2;
  std::erase_if(strips, [this](const Strip& strip) { return strip.number % strip_stride != 0; });
}

void RecordingView::Impl::send_new_scene(const ShownStep& step) {
  if (step.belief->scene == last_scene) return;
  last_scene = step.belief->scene;
  const std::uint64_t hash = scene_shape_hash(*last_scene);
  if (hash == scene_hash) return;
  auto message = view_text(scene_document(*last_scene), WebDelivery::kEach);
  server->send_to_all(message);
  const std::lock_guard lock(mutex);
  scene = std::move(message);
  scene_hash = hash;
}

void RecordingView::Impl::send_news() {
  WebMessagePtr rows, news;
  {
    const std::lock_guard lock(mutex);
    const bool anew = history.revision() != revision;
    revision = history.revision();
    if (anew) {
      rows = view_text(to_json(history), WebDelivery::kEach);
    } else if (!new_rows.empty() || !new_runs.empty()) {
      rows = view_text(
          JsonFields().text("op", "rows").field("rows", std::move(new_rows)).field("runs", std::move(new_runs)).take(),
          WebDelivery::kEach);
    }
    new_rows = ordered_json::array();
    new_runs = ordered_json::array();
    news = view_text(extent(), WebDelivery::kEach);
  }
  if (rows) server->send_to_all(rows);
  server->send_to_all(news);
}

}  // namespace prescene::service
