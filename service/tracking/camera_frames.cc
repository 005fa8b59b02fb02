// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/camera_frames.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/core/clock.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/tracking/image_messages.h"

namespace prescene::service {
namespace {

constexpr core::TimeNs kSilentNs = 1'000'000'000;      // a camera that has sent nothing for so long is not waited for
constexpr core::TimeNs kOtherClockNs = 1'000'000'000;  // clocks of cameras that differ by more are not the same
constexpr double kEarly = 0.8;  // of a period; the next frame of a camera is not expected earlier: stamps jitter

template <class Message>
core::Result<Message> decode_as(const interfaces::ReceivedMessage& message, const char* type) {
  if (message.type != type)
    return core::invalid_input("carries " + message.type + ", expected " + type +
                               ": correct the topic's name in the settings");
  return interfaces::decode_cdr<Message>(message.cdr, interfaces::kSmallMessage);
}

core::TimeNs offset_of(const FrameAssembler::DepthTimes& times) { return times.received_ns - times.stamp_ns; }

bool agree(const FrameAssembler::DepthTimes& a, const FrameAssembler::DepthTimes& b) {
  return std::abs(offset_of(a) - offset_of(b)) <= kOtherClockNs;
}

/// Frames do not wait for the colour of a topic that nobody named, and topics say by their names what they hold.
CameraInput settled(CameraInput input) {
  input.assembler.use_color = input.assembler.use_color && !input.topics.color.empty();
  if (!input.assembler.rectified) input.assembler.rectified = names_rectified_images(input.topics.depth);
  return input;
}

}  // namespace

InputTopics first_topics(const TrackerSettings& settings, const belief::Scene& scene) {
  return camera_inputs(settings, scene).front().topics;
}

bool PicturedFrames::has(const belief::Observation& observation) {
  if (observation.camera == 0) first_ns_ = observation.stamp_ns;
  return observation.camera == 0 || !first_ns_ || std::abs(observation.stamp_ns - *first_ns_) > kSilentNs;
}

bool names_topics(const belief::Scene& scene) { return scene.camera && scene.camera->topics; }

std::vector<CameraInput> camera_inputs(const TrackerSettings& settings, const belief::Scene& scene) {
  if (!names_topics(scene)) return {{"", settings.topics, settings.assembler}};
  std::vector<CameraInput> inputs;
  for (int i = 0; i < belief::camera_count(scene); ++i) {
    const belief::SceneCamera& camera = *belief::camera_at(scene, i);
    CameraInput input{camera.name, settings.topics, settings.assembler};
    const belief::CameraTopics topics = camera.topics.value_or(belief::CameraTopics{});
    input.topics.depth = topics.depth;
    input.topics.color = topics.color;
    input.topics.camera_info = topics.camera_info;
    input.topics.depth_form = topics.depth_form;
    input.topics.color_form = topics.color_form;
    input.assembler.rectified = topics.rectified;
    input.assembler.camera_frame = camera.frame;
    input.assembler.X_WC = camera.is_placed ? std::optional(camera.X_WC) : std::nullopt;
    input.assembler.doubts_X_WC = true;
    inputs.push_back(std::move(input));
  }
  return inputs;
}

core::Status validate(const std::vector<CameraInput>& cameras) {
  for (const CameraInput& camera : cameras) {
    core::Status valid = validate(camera.topics);
    if (!valid.ok()) return camera.name.empty() ? valid : valid.at("camera " + interfaces::quote(camera.name));
  }
  return core::ok_status();
}

std::vector<BusTopic> topics_of_cameras(const std::vector<CameraInput>& cameras) {
  std::vector<BusTopic> all;
  for (const CameraInput& camera : cameras)
    for (BusTopic& topic : bus_topics(camera.topics)) {
      const bool is_known =
          std::any_of(all.begin(), all.end(), [&](const BusTopic& other) { return other.name == topic.name; });
      if (!is_known) all.push_back(std::move(topic));
    }
  return all;
}

CameraFrames::CameraFrames(std::vector<CameraInput> cameras, const std::vector<std::string>& robot_bodies,
                           const TfBufferSettings& tf) {
  PRESCENE_CHECK(!cameras.empty());
  const bool has_several = cameras.size() > 1;
  max_wait_s_ = cameras.front().assembler.max_wait_s;
  for (CameraInput& camera : cameras) {
    const std::string prefix = has_several ? "camera " + interfaces::quote(camera.name) + ": " : "";
    const std::string doubt = rectified_doubt(camera.topics, camera.assembler);
    CameraInput input = settled(std::move(camera));
    const AssemblerSettings settings = input.assembler;
    cameras_.push_back(
        {std::move(input), FrameAssembler(settings, robot_bodies, tf), prefix, doubt.empty() ? "" : prefix + doubt});
  }
}

DecodedImages CameraFrames::decode(const interfaces::ReceivedMessage& message) const {
  DecodedImages images;
  for (const Camera& camera : cameras_) {
    if (message.topic == camera.input.topics.depth) {
      images.depth = decode_depth(message, camera.assembler.image_rules());
      break;
    }
    if (message.topic == camera.input.topics.color) {
      if (camera.assembler.uses_color()) images.color = decode_color_message(message);
      break;
    }
  }
  return images;
}

std::optional<core::Status> CameraFrames::take_in(const interfaces::ReceivedMessage& message, MessageIndex index,
                                                  core::TimeNs received_ns, DecodedImages images) {
  if (!images.any()) images = decode(message);
  const auto named = [&](const std::string& topic) { return message.topic == topic; };
  for (Camera& camera : cameras_) {
    FrameAssembler& assembler = camera.assembler;
    const InputTopics& topics = camera.input.topics;
    if (named(topics.depth)) {
      core::Result<DepthMessage>& depth = *images.depth;
      if (depth && depth->report.measured == 0)
        depth->report.warnings.push_back(
            "no pixel of its depth image is measured: look whether the camera is covered, dazzled, or too near");
      return depth ? assembler.add_depth(*std::move(depth), index, received_ns) : depth.status();
    }
    if (named(topics.color)) {
      if (!assembler.uses_color()) return core::ok_status();
      core::Result<ColorMessage>& color = *images.color;
      return color ? assembler.add_color(*std::move(color), index, received_ns) : color.status();
    }
    if (named(topics.camera_info)) {
      const auto info = decode_as<interfaces::RosCameraInfo>(message, "sensor_msgs/msg/CameraInfo");
      return info ? assembler.add_camera_info(*info, index) : info.status();
    }
  }
  const auto to_all = [&](const auto& add) {
    core::Status first_bad;
    for (Camera& camera : cameras_) {
      core::Status added = add(camera.assembler);
      if (first_bad.ok()) first_bad = std::move(added);
    }
    return first_bad;
  };
  const InputTopics& topics = cameras_.front().input.topics;
  if (named(topics.tf) || named(topics.tf_static)) {
    const auto tf = decode_as<interfaces::RosTfMessage>(message, "tf2_msgs/msg/TFMessage");
    if (!tf) return tf.status();
    return to_all([&](FrameAssembler& assembler) { return assembler.add_tf(*tf, index, named(topics.tf_static)); });
  }
  if (named(topics.joint_states) && cameras_.front().input.assembler.robot) {
    const auto joints = decode_as<interfaces::RosJointState>(message, "sensor_msgs/msg/JointState");
    if (!joints) return joints.status();
    return to_all([&](FrameAssembler& assembler) { return assembler.add_joint_state(*joints, index); });
  }
  return std::nullopt;
}

std::optional<AssembledFrame> CameraFrames::take(core::TimeNs now_ns) {
  if (cameras_.size() == 1) {
    std::optional<AssembledFrame> frame = cameras_.front().assembler.take(now_ns);
    const std::string& doubt = cameras_.front().rectified_doubt;
    if (frame && !doubt.empty()) frame->doubts.push_back(doubt);
    return frame;
  }
  asked_ns_ = now_ns;
  std::optional<std::size_t> next;
  std::vector<std::optional<FrameAssembler::DepthTimes>> offers;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    offers.push_back(offer(i, now_ns));
    if (!offers[i]) continue;
    const bool goes_first =
        !next || cameras_[i].passed_over > cameras_[*next].passed_over ||
        (cameras_[i].passed_over == cameras_[*next].passed_over && offers[i]->stamp_ns < offers[*next]->stamp_ns);
    if (goes_first) next = i;
  }
  if (!next || waits_for_others(*next, *offers[*next], now_ns)) return std::nullopt;
  std::optional<AssembledFrame> frame = cameras_[*next].assembler.take_ready(now_ns);
  cameras_[*next].passed_over = 0;
  cameras_[*next].offered_ns.reset();
  if (frame) note_used(*next, *offers[*next], *frame);
  return frame;
}

std::optional<AssembledFrame> CameraFrames::take_recorded(int camera, MessageIndex depth, core::TimeNs now_ns) {
  if (cameras_.size() == 1) return take(now_ns);
  const auto number = static_cast<std::size_t>(camera);
  if (camera < 0 || number >= cameras_.size()) return std::nullopt;
  const std::optional<FrameAssembler::DepthTimes> times = cameras_[number].assembler.waiting(depth);
  std::optional<AssembledFrame> frame = cameras_[number].assembler.take_recorded(depth, now_ns);
  if (frame) note_used(number, *times, *frame);
  return frame;
}

void CameraFrames::resume_after(int camera, MessageIndex depth, core::TimeNs now_ns) {
  const auto number = static_cast<std::size_t>(camera);
  if (camera < 0 || number >= cameras_.size()) return;
  const std::optional<FrameAssembler::DepthTimes> times = cameras_[number].assembler.waiting(depth);
  std::optional<AssembledFrame> frame = cameras_[number].assembler.take_recorded(depth, now_ns);
  if (frame && cameras_.size() > 1) note_used(number, *times, *frame);
  static_cast<void>(take_skipped());
}

std::optional<MessageIndex> CameraFrames::oldest_needed() const {
  std::optional<MessageIndex> oldest;
  for (const Camera& camera : cameras_)
    if (const auto needed = camera.assembler.oldest_needed()) oldest = oldest ? std::min(*oldest, *needed) : needed;
  return oldest;
}

std::optional<FrameAssembler::DepthTimes> CameraFrames::offer(std::size_t camera, core::TimeNs now_ns) {
  Camera& mine = cameras_[camera];
  for (;;) {
    const std::optional<FrameAssembler::DepthTimes> ready = mine.assembler.ready(now_ns);
    if (mine.offered_ns && (!ready || ready->stamp_ns != *mine.offered_ns)) ++mine.passed_over;
    mine.offered_ns = ready ? std::optional(ready->stamp_ns) : std::nullopt;
    if (ready) mine.complete_ns = ready->received_ns;
    if (!ready || !used_) return ready;
    const bool is_other_clock = is_of_other_clock(camera, *ready);
    const bool is_late = ready->stamp_ns < used_->times.stamp_ns && agree(*ready, used_->times);
    if (!is_other_clock && !is_late) return ready;
    mine.assembler.skip_up_to(ready->stamp_ns, is_other_clock
                                                   ? "its clock is not that of camera " +
                                                         interfaces::quote(cameras_[used_->camera].input.name) +
                                                         ": set the clocks of the cameras' computers by one (NTP, PTP)"
                                                   : lateness(*ready));
    mine.offered_ns.reset();
    if (is_late) ++mine.passed_over;
  }
}

std::string CameraFrames::lateness(const FrameAssembler::DepthTimes& times) const {
  const std::string other = "camera " + interfaces::quote(cameras_[used_->camera].input.name);
  const core::TimeNs behind_ns = offset_of(times) - offset_of(used_->times);
  if (behind_ns > core::ns_of(max_wait_s_))
    return "its stamps are " + core::fixed_text(core::seconds_of(behind_ns), 1) + " s behind those of " + other +
           ": set the clocks of the cameras' computers by one (NTP, PTP), or let frames wait longer for each other "
           "(the parameter max_wait)";
  return "a later frame of " + other +
         " was used before it was complete: let frames wait longer for each other (the parameter max_wait)";
}

bool CameraFrames::is_of_other_clock(std::size_t camera, const FrameAssembler::DepthTimes& times) const {
  if (agree(times, used_->times)) return false;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const auto& newest = cameras_[i].assembler.newest();
    if (i != camera && newest && times.received_ns - newest->received_ns <= kSilentNs && agree(*newest, used_->times))
      return true;
  }
  return false;  // the clock of all of them was set
}

bool CameraFrames::waits_for_others(std::size_t camera, const FrameAssembler::DepthTimes& times,
                                    core::TimeNs now_ns) const {
  const core::TimeNs until_ns = times.received_ns + core::ns_of(max_wait_s_);
  if (cameras_[camera].passed_over > 0 || now_ns < times.received_ns || now_ns >= until_ns) return false;
  // What is older than this is not used any more.
  const core::TimeNs oldest_ns = used_ ? used_->times.stamp_ns : std::numeric_limits<core::TimeNs>::min();
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const FrameAssembler& other = cameras_[i].assembler;
    const auto& newest = other.newest();
    if (i == camera || !newest || now_ns - newest->received_ns > kSilentNs || !agree(*newest, times)) continue;
    if (began_ns_ && now_ns - std::max(cameras_[i].complete_ns.value_or(*began_ns_), *began_ns_) > kSilentNs) continue;
    if (other.has_waiting(oldest_ns, times.stamp_ns)) return true;
    if (other.period_ns() == 0) continue;
    const core::TimeNs next_ns =
        std::max(oldest_ns, newest->stamp_ns + core::ns_of(kEarly * core::seconds_of(other.period_ns())));
    if (next_ns < times.stamp_ns && next_ns + offset_of(*newest) <= until_ns) return true;
  }
  return false;
}

void CameraFrames::note_used(std::size_t camera, FrameAssembler::DepthTimes times, AssembledFrame& frame) {
  Camera& mine = cameras_[camera];
  frame.observation.camera = static_cast<int>(camera);
  for (std::string& doubt : frame.doubts) doubt.insert(0, mine.prefix);
  if (!mine.rectified_doubt.empty()) frame.doubts.push_back(mine.rectified_doubt);
  // The clock of all of them went back: what the others have is of the time before.
  if (used_ && times.stamp_ns < used_->times.stamp_ns)
    for (std::size_t i = 0; i < cameras_.size(); ++i)
      if (i != camera) cameras_[i].assembler.clock_jumped_back();
  used_ = {camera, times};
  mine.used_ns = mine.complete_ns = times.received_ns;
  mine.last_skip.clear();
  ++mine.used;
  if (!began_ns_) began_ns_ = times.received_ns;
}

std::optional<core::TimeNs> CameraFrames::next_deadline() const {
  // A frame that has waited long enough may still have to let an older one of another camera go first.
  std::optional<core::TimeNs> deadline;
  for (const Camera& camera : cameras_) {
    const auto mine = camera.assembler.next_deadline(asked_ns_);
    if (mine) deadline = deadline ? std::min(*deadline, *mine) : *mine;
  }
  return deadline;
}

std::vector<SkippedFrame> CameraFrames::take_skipped() {
  std::vector<SkippedFrame> all;
  for (Camera& camera : cameras_) {
    std::vector<SkippedFrame> skipped = camera.assembler.take_skipped();
    if (!skipped.empty()) camera.last_skip = skipped.back().reason;
    for (SkippedFrame& frame : skipped) frame.reason.insert(0, camera.prefix);
    std::ranges::move(skipped, std::back_inserter(all));
  }
  if (cameras_.size() > 1)
    std::ranges::stable_sort(all, [](const SkippedFrame& a, const SkippedFrame& b) { return a.depth < b.depth; });
  return all;
}

std::string CameraFrames::last_skip() const {
  std::string reason;
  MessageIndex newest = 0;
  for (const Camera& camera : cameras_) {
    const std::optional<SkippedFrame> skipped = camera.assembler.last_skipped();
    if (!skipped || (!reason.empty() && skipped->depth < newest)) continue;
    newest = skipped->depth;
    reason = camera.prefix + skipped->reason;
  }
  return reason;
}

std::uint64_t CameraFrames::skipped_count() const {
  std::uint64_t count = 0;
  for (const Camera& camera : cameras_) count += camera.assembler.skipped_count();
  return count;
}

void CameraFrames::set_waits(double max_wait_s, double max_stamp_difference_s) {
  max_wait_s_ = max_wait_s;
  for (Camera& camera : cameras_) camera.assembler.set_waits(max_wait_s, max_stamp_difference_s);
}

std::string CameraFrames::lens_text() const {
  std::string text;
  for (const Camera& camera : cameras_) {
    const std::string lens = camera.assembler.lens_text();
    if (!lens.empty()) text += (text.empty() ? "" : "; ") + camera.prefix + lens;
  }
  return text;
}

std::vector<SilentCamera> CameraFrames::silent_cameras(core::TimeNs now_ns) const {
  std::vector<SilentCamera> silent;
  if (cameras_.size() < 2 || !began_ns_) return silent;
  for (const Camera& camera : cameras_) {
    const auto& newest = camera.assembler.newest();
    if (now_ns - (newest ? newest->received_ns : *began_ns_) > kSilentNs)
      silent.push_back({camera.input.name, newest ? "it sends no more depth images"
                                                  : "no depth image of it has come on " + camera.input.topics.depth +
                                                        ": start its driver, or correct its topics in the scene file"});
    else if (now_ns - std::max(camera.used_ns.value_or(*began_ns_), *began_ns_) > kSilentNs)
      silent.push_back({camera.input.name,
                        "none of its frames is used" + (camera.last_skip.empty() ? "" : ": " + camera.last_skip)});
  }
  return silent;
}

std::vector<std::string> CameraFrames::silent(core::TimeNs now_ns) const {
  std::vector<std::string> words;
  for (const SilentCamera& camera : silent_cameras(now_ns))
    words.push_back("camera '" + camera.name + "': " + camera.reason);
  return words;
}

std::string CameraFrames::counts_text() const {
  if (cameras_.size() < 2) return "";
  std::string text;
  for (const Camera& camera : cameras_)
    text += (text.empty() ? "" : "; ") + camera.input.name + ": " + std::to_string(camera.used) + " frames used, " +
            std::to_string(camera.assembler.skipped_count()) + " not";
  return text;
}

}  // namespace prescene::service
