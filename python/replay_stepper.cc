// SPDX-License-Identifier: Apache-2.0
#include "replay_stepper.h"

#include <cmath>
#include <exception>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/scene_files/learned_file.h"

namespace prescene::python {
namespace {

constexpr double kMostSeconds = 1e9;
constexpr std::chrono::milliseconds kCancellationInterval{20};

core::Status check(const service::ReplayInputOptions& input) {
  const double from = input.read.from;
  const double to = input.read.to;
  if (!(from >= 0.0 && from <= kMostSeconds))
    return core::invalid_input("begin: " + core::rounded_text(from) + " is out of range: give seconds from 0 to 1e9");
  if (!(to > from))
    return core::invalid_input("begin " + core::rounded_text(from) + " is not before end " + core::rounded_text(to) +
                               ": exchange them");
  if (!(input.metres_per_unit > 0.0 && std::isfinite(input.metres_per_unit)))
    return core::invalid_input("depth_scale: give metres per unit of the depth images, above 0");
  if (!(input.frames_per_second > 0.0 && std::isfinite(input.frames_per_second)))
    return core::invalid_input("frame_rate: give frames a second, above 0");
  return core::ok_status();
}

core::Status read_learned(const std::string& path, service::TrackerSettings& settings) {
  if (path.empty()) return core::ok_status();
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, interfaces::read_file(path, interfaces::YamlLimits{}.max_bytes));
  settings.learned.assign(bytes.begin(), bytes.end());
  settings.learned_file = path;
  return core::ok_status();
}

std::string json_of(const service::ReplaySummary& summary) {
  nlohmann::ordered_json degraded = nlohmann::ordered_json::array();
  for (const auto& [what, steps] : summary.degraded) degraded.push_back({{"what", what}, {"steps", steps}});
  return belief::json_text({{"messages", summary.messages},
                            {"refused", summary.refused},
                            {"first_refusal", summary.first_refusal},
                            {"steps", summary.steps},
                            {"skipped_frames", summary.skipped},
                            {"followed_step_records", summary.followed_step_records},
                            {"compared_steps", summary.compared},
                            {"different_steps", summary.different},
                            {"cancelled", summary.cancelled},
                            {"loss", summary.loss},
                            {"unchecked", summary.unchecked},
                            {"degraded", degraded}});
}

}  // namespace

core::Result<std::unique_ptr<ReplayStepper>> ReplayStepper::open(const ReplayRequest& request,
                                                                 const core::LogSink& log) {
  PRESCENE_RETURN_IF_ERROR(check(request.input));
  PRESCENE_TRY(service::ReplayInput input, service::ReplayInput::open(request.input, log));
  PRESCENE_TRY(service::TrackerSettings settings, input.recorded_settings());
  settings.assembler.robot = input.robot();
  PRESCENE_RETURN_IF_ERROR(read_learned(request.learned, settings));
  PRESCENE_RETURN_IF_ERROR(service::validate(settings.topics));
  auto engine = std::make_shared<Engine>(request.threads, service::BackendSettings{});
  const std::uint64_t seed = request.seed ? *request.seed : input.seed_or(1);
  PRESCENE_TRY(auto tracker, service::Tracker::create(input.scene(), settings, seed, engine->backends));
  return std::unique_ptr<ReplayStepper>(
      new ReplayStepper(std::move(input), std::move(engine), std::move(tracker), seed));
}

ReplayStepper::ReplayStepper(service::ReplayInput input, std::shared_ptr<Engine> engine,
                             std::unique_ptr<service::Tracker> tracker, std::uint64_t seed)
    : input_(std::move(input)), engine_(std::move(engine)), tracker_(std::move(tracker)), seed_(seed) {}

core::Result<std::shared_ptr<const ReplayFrame>> ReplayStepper::next(const core::Cancellation& cancellation) {
  if (is_asked_.exchange(true))
    return core::invalid_input("another thread is waiting for this replay's next frame: let one thread ask");
  struct Asked {
    std::atomic<bool>& flag;
    ~Asked() { flag = false; }
  } const asked{is_asked_};
  {
    const std::lock_guard lock(thread_mutex_);
    if (!thread_.joinable() && !closed_.requested()) thread_ = std::thread([this] { track(); });
  }
  std::unique_lock lock(mutex_);
  wanted_ = true;
  changed_.notify_all();
  while (!frame_ && !ended_) {
    if (closed_.requested()) return std::shared_ptr<const ReplayFrame>();
    if (cancellation.requested()) return core::cancelled("stopped on request");
    changed_.wait_for(lock, kCancellationInterval);
  }
  if (frame_) {
    wanted_ = false;
    return std::exchange(frame_, nullptr);
  }
  if (exception_) std::rethrow_exception(std::exchange(exception_, nullptr));
  if (!end_.ok()) return std::exchange(end_, core::ok_status());
  return std::shared_ptr<const ReplayFrame>();
}

void ReplayStepper::give_back(std::shared_ptr<const ReplayFrame> frame) {
  const std::lock_guard lock(mutex_);
  if (!frame_ && !wanted_) frame_ = std::move(frame);
}

void ReplayStepper::close() {
  closed_.request();
  changed_.notify_all();
  const std::lock_guard lock(thread_mutex_);
  if (thread_.joinable()) thread_.join();
}

std::string ReplayStepper::learned() const { return interfaces::learned_yaml(tracker_->learned()); }

std::string ReplayStepper::summary_json() const {
  const std::lock_guard lock(mutex_);
  return summary_json_;
}

void ReplayStepper::track() {
  core::Status end;
  std::string text;
  std::exception_ptr exception;
  try {
    const auto summary =
        input_.replay(*tracker_, closed_, {},
                      [this](const service::TrackerStep& step, const service::Tracker&) { return deliver(step); }, {});
    if (summary) {
      text = json_of(*summary);
      if (!summary->cancelled) end = check_steps(*summary, tracker_->settings().topics);
    } else if (!closed_.requested()) {
      end = summary.status();
    }
  } catch (const std::exception&) {
    exception = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  ended_ = true;
  end_ = std::move(end);
  summary_json_ = std::move(text);
  exception_ = exception;
  changed_.notify_all();
}

core::Status ReplayStepper::deliver(const service::TrackerStep& step) {
  auto frame = std::make_shared<ReplayFrame>();
  frame->belief = tracker_->belief();
  frame->summary = service::summary_of(*frame->belief);
  frame->record = step.record;
  frame->images = step.observation.frame;
  frame->X_WC = step.observation.X_WC;
  if (!first_ns_) first_ns_ = step.record.stamp_ns;
  frame->seconds = core::seconds_of(step.record.stamp_ns - *first_ns_);

  std::unique_lock lock(mutex_);
  frame_ = std::move(frame);
  changed_.notify_all();
  // The next step is worked out when it is asked for, so that a loop that ends early has cost no more.
  while (frame_ || !wanted_) {
    if (closed_.requested()) return core::cancelled("closed");
    changed_.wait_for(lock, kCancellationInterval);
  }
  return core::ok_status();
}

}  // namespace prescene::python
