// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/frame_history.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "prescene/core/clock.h"
#include "prescene/core/text.h"
#include "prescene/rendering/sensor/pixel_grid.h"
#include "prescene/service/tracking/waiting_controls.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using nlohmann::ordered_json;

constexpr std::size_t kMostControls = 1000;
constexpr double kLastSeconds = 2.0;  // of a window that nobody gave
constexpr core::TimeNs kWindowRoundingNs = 1000;
constexpr core::TimeNs kOtherClockNs = 3600 * core::TimeNs{1'000'000'000};
// s by which frames may come earlier than the rate allows: their stamps jitter.
constexpr double kStampJitter = 1e-3;

std::size_t bytes_of(const belief::ObjectBelief& object) {
  const auto of_samples = [](const std::vector<belief::MotionSample>& samples) {
    std::size_t bytes = samples.size() * sizeof(belief::MotionSample);
    for (const belief::MotionSample& sample : samples) bytes += sample.robot.size() * sizeof(belief::Pose);
    return bytes;
  };
  std::size_t bytes = sizeof(object) + object.particles.size() * sizeof(belief::Particle);
  bytes += of_samples(object.motion.recent);
  if (const auto& episode = object.motion.episode)
    bytes += of_samples(episode->samples) + episode->others.size() * sizeof(belief::Pose) +
             episode->run_errors.size() * sizeof(double);
  return bytes;
}

std::size_t bytes_of(const queries::WindowFrame& frame) {
  std::size_t bytes = sizeof(frame) + sizeof(belief::Belief);
  if (frame.observation.frame.depth) bytes += frame.observation.frame.depth->size() * sizeof(float);
  if (frame.observation.frame.color) bytes += frame.observation.frame.color->size() * sizeof(geometry::Rgb);
  for (const belief::ObjectBelief& object : frame.belief->objects) bytes += bytes_of(object);
  return bytes;
}

template <class Pixel>
std::shared_ptr<const geometry::Image<Pixel>> sampled_image(const geometry::Image<Pixel>& image,
                                                            const geometry::PinholeCamera& camera, int step,
                                                            int offset) {
  auto sampled = std::make_shared<geometry::Image<Pixel>>(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) (*sampled)(x, y) = image(offset + step * x, offset + step * y);
  return sampled;
}

template <class Pixel>
bool fits(const geometry::Image<Pixel>& image, const geometry::PinholeCamera& camera) {
  return image.width() == camera.width && image.height() == camera.height;
}

}  // namespace

void ControlLog::add(const std::string& json, core::TimeNs sent_ns) {
  const auto control = parse_control(json);
  if (!control) return;  // the tracker refused it, and said so
  for (const auto& [after_ns, action] : control->actions) {
    const core::TimeNs due_ns = control->stamp_ns.value_or(sent_ns) + after_ns;
    known_.push_back({due_ns, sent_ns, control->stamp_ns.has_value(), action, due_ns + placement_time(action)});
  }
}

void ControlLog::forget(core::TimeNs before_ns, std::size_t most) {
  std::erase_if(known_, [&](const Known& known) { return known.end_ns < before_ns && known.sent_ns < before_ns; });
  while (known_.size() > most) known_.pop_front();
}

void ControlLog::put_into(queries::ExplainWindow& window, std::vector<std::string>& remarks) const {
  const core::TimeNs begin = window.start->stamp_ns, end = window.frames.back().observation.stamp_ns;
  int placeless = 0;
  for (const Known& known : known_) {
    if (!known.has_stamp && std::abs(known.sent_ns - begin) > kOtherClockNs)
      ++placeless;
    else if (known.due_ns > begin && known.due_ns <= end)
      window.actions.emplace_back(known.due_ns, known.action);
    else if (known.end_ns > begin && known.end_ns <= end)  // a placement that had begun before
      window.actions.emplace_back(known.end_ns, belief::Action{0.0, belief::Release{belief::object_of(known.action)}});
  }
  if (placeless > 0)
    remarks.push_back(std::to_string(placeless) +
                      " actions have no stamp and came by another clock than the frames': they are not known to the "
                      "explanation.");
}

queries::WindowFrame sampled_frame(const belief::Observation& observation, std::shared_ptr<const belief::Belief> belief,
                                   int width) {
  const belief::RgbdFrame& whole = observation.frame;
  // As rendering::make_frame_terms samples it, so that its pixels are just these.
  const int step = rendering::pixel_step(whole.camera.width, width);
  const int offset = rendering::pixel_offset(step, whole.camera.width, whole.camera.height);
  queries::WindowFrame kept;
  kept.sampled = step;
  kept.belief = std::move(belief);
  kept.observation.stamp_ns = observation.stamp_ns;
  kept.observation.camera = observation.camera;
  kept.observation.X_WC = observation.X_WC;
  kept.observation.robot = observation.robot;
  kept.observation.frame.camera = whole.camera.subsampled(step, offset);
  const geometry::PinholeCamera& camera = kept.observation.frame.camera;
  kept.observation.frame.depth = sampled_image(*whole.depth, camera, step, offset);
  if (whole.color && fits(*whole.color, whole.camera))
    kept.observation.frame.color = sampled_image(*whole.color, camera, step, offset);
  return kept;
}

void FrameHistory::add(const belief::Observation& observation, std::shared_ptr<const belief::Belief> belief) {
  const belief::RgbdFrame& frame = observation.frame;
  const bool usable =
      frame.depth && !frame.depth->empty() && fits(*frame.depth, frame.camera) && observation.X_WC.is_finite();
  if (!(seconds_ > 0.0) || !usable) return;
  const core::TimeNs stamp_ns = observation.stamp_ns;
  {
    const std::lock_guard lock(mutex_);
    // Two cameras may take frames at one instant.
    if (any_ && (stamp_ns < newest_ns_ || (stamp_ns == newest_ns_ && belief->cameras.empty()))) {
      kept_.clear();
      controls_.clear();
      bytes_ = 0;
      any_ = false;
    }
    if (!any_) first_ns_ = stamp_ns;
    any_ = true;
    newest_ns_ = stamp_ns;
    // Each camera by itself: another one's frame says something else.
    const auto last = std::find_if(kept_.rbegin(), kept_.rend(), [&](const Kept& kept) {
      return kept.frame.observation.camera == observation.camera;
    });
    const bool is_soon = last != kept_.rend() && core::seconds_of(stamp_ns - last->frame.observation.stamp_ns) <
                                                     1.0 / settings_.rate - kStampJitter;
    if (is_soon) return;
  }
  Kept kept{sampled_frame(observation, std::move(belief), settings_.width)};
  kept.bytes = bytes_of(kept.frame);
  const std::lock_guard lock(mutex_);
  if (!(seconds_ > 0.0)) return;
  bytes_ += kept.bytes;
  kept_.push_back(std::move(kept));
  const core::TimeNs oldest_ns = stamp_ns - core::ns_of(seconds_);
  while (kept_.size() > 1 && (kept_.front().frame.observation.stamp_ns < oldest_ns || bytes_ > settings_.most_bytes)) {
    bytes_ -= kept_.front().bytes;
    kept_.pop_front();
  }
  controls_.forget(kept_.front().frame.observation.stamp_ns, kMostControls);
}

void FrameHistory::add_control(const std::string& json, core::TimeNs sent_ns) {
  if (!(seconds_ > 0.0)) return;
  const std::lock_guard lock(mutex_);
  controls_.add(json, sent_ns);
  controls_.forget(std::numeric_limits<core::TimeNs>::min(), kMostControls);  // before there is a frame
}

core::Result<PastWindow> FrameHistory::window(const belief::ExplainQuestion& question) const {
  return window(AskedWindow{question.from, question.to, question.last});
}

core::Result<PastWindow> FrameHistory::window(const AskedWindow& question) const {
  if (!(seconds_ > 0.0))
    return core::unavailable("no frames are kept, so that nothing can be explained: start 'serve' with --history");
  const std::lock_guard lock(mutex_);
  if (kept_.empty()) return core::unavailable("no frame was seen yet: ask again when there is something to explain");
  const auto stamp = [&](std::size_t i) { return kept_[i].frame.observation.stamp_ns; };
  const core::TimeNs newest_ns = stamp(kept_.size() - 1);
  const core::TimeNs to_ns = question.to ? first_ns_ + core::ns_of(*question.to) : newest_ns;
  const core::TimeNs last_from_ns = to_ns - core::ns_of(question.last.value_or(kLastSeconds));
  const core::TimeNs from_ns = question.from   ? first_ns_ + core::ns_of(*question.from)
                               : question.last ? last_from_ns
                                               : std::max(last_from_ns, stamp(0));
  const auto seconds = [&](core::TimeNs time_ns) { return core::seconds_of(time_ns - first_ns_); };
  const std::string asked =
      "the window from " + fixed_text(seconds(from_ns), 2) + " to " + fixed_text(seconds(to_ns), 2) + " s ";
  const std::string held =
      "the history holds " + fixed_text(seconds(stamp(0)), 2) + " to " + fixed_text(seconds(newest_ns), 2) + " s";
  std::size_t next = 0;
  while (next < kept_.size() && stamp(next) <= from_ns + kWindowRoundingNs) ++next;
  if (next == 0)
    return core::invalid_input(asked + "begins before the history: " + held +
                               "; ask about a later one, or keep more (serve --history)");
  const double between = kept_.size() > 1
                             ? core::seconds_of(newest_ns - stamp(0)) / static_cast<double>(kept_.size() - 1)
                             : 1.0 / settings_.rate;
  if (core::seconds_of(to_ns - newest_ns) > between + 0.01)
    return core::invalid_input(asked + "ends after the newest frame: " + held);
  PastWindow past;
  past.first_ns = first_ns_;
  past.window.start = kept_[next - 1].frame.belief;
  past.from = seconds(stamp(next - 1));
  for (; next < kept_.size() && stamp(next) <= to_ns + kWindowRoundingNs; ++next)
    past.window.frames.push_back(kept_[next].frame);
  if (past.window.frames.empty()) return core::invalid_input(asked + "holds no frame but its first: give a longer one");
  past.to = seconds(past.window.frames.back().observation.stamp_ns);
  controls_.put_into(past.window, past.remarks);
  return past;
}

void FrameHistory::keep(double seconds) {
  const std::lock_guard lock(mutex_);
  seconds_ = seconds;
  if (seconds > 0.0) return;
  kept_.clear();
  controls_.clear();
  bytes_ = 0;
}

std::size_t FrameHistory::frames() const {
  const std::lock_guard lock(mutex_);
  return kept_.size();
}

std::size_t FrameHistory::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

Explained not_explained_yet(const PastWindow& past) {
  Explained explained;
  explained.from = past.from;
  explained.to = past.to;
  if (!past.window.frames.empty()) explained.step = past.window.frames.back().belief->step;
  explained.remarks = past.remarks;
  return explained;
}

core::Result<Explained> explain_past(PastWindow past, const belief::ExplainQuestion& question,
                                     const belief::EventWeights& weights, const queries::ExplainContext& context) {
  queries::ExplainQuery query;
  query.object = question.object;
  query.frames = question.frames;
  query.runs = question.runs;
  query.points = question.points;
  query.half_width = question.half_width;
  query.seed = question.seed;
  query.weights = weights;
  query.change = question.change;
  query.wanted_name = question.wanted_name;
  query.wanted = question.wanted;
  const core::Stopwatch watch;
  const double cpu = core::process_cpu_seconds();
  PRESCENE_TRY(queries::ExplainAnswer answer, queries::explain(past.window, query, context));
  Explained explained = not_explained_yet(past);
  explained.answer = std::move(answer);
  explained.seconds = watch.seconds();
  explained.cpu_seconds = core::process_cpu_seconds() - cpu;
  explained.window = std::move(past.window);
  return explained;
}

ordered_json explain_answer_json(const belief::ExplainQuestion& question, const Explained& explained) {
  belief::ExplainQuestion asked = question;
  asked.from = explained.from;
  asked.to = explained.to;
  ordered_json answer = to_json(explained);
  answer["asked"] = belief::to_json(asked)["explain"];
  return {{"id", question.id}, {"step", explained.step}, {"explain", std::move(answer)}};
}

}  // namespace prescene::service
