// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/frame_assembler.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::service {
namespace {

// Bounds of what waits: only the newest frame is used, so more would be kept for nothing. 8 frames are 0.27 s at 30 Hz.
constexpr std::size_t kMaxWaiting = 8;
constexpr std::size_t kMaxColors = 8;
// The same for large images, of all that wait: eight of 2048 x 2048, two of the largest. A depth takes 4 bytes.
constexpr std::size_t kMaxWaitingPixels = std::size_t{1} << 25;
constexpr std::size_t kMaxSkippedKept = 1000;
// A stamp this much older than the last one taken means that the sender's clock was set back (a looped recording).
// One that is ahead of it by more than this, and by more than kFastestClock times the time that went by, means that the
// clock was set forward. Either may also be one wrong stamp: only so many frames in a row are believed, as in tf.
constexpr core::TimeNs kClockJumpNs = 1'000'000'000;
constexpr core::TimeNs kFastestClock = 10;  // of a recording that is played fast
constexpr int kTooManyToBeWrong = 3;
// Less of an image than this is left by no lens that was calibrated well, but by a fold in the middle of it.
constexpr double kLeastVisibleShare = 0.5;

/// Whether so many images wait that the oldest has to go.
template <class Entries, class Image>
bool too_many(const Entries& entries, std::size_t most, Image Entries::value_type::*image) {
  std::size_t pixels = 0;
  for (const auto& entry : entries) pixels += (entry.*image)->size();
  return entries.size() > most || (entries.size() > 1 && pixels > kMaxWaitingPixels);
}

template <class Image>
std::string size_text(const Image& image) {
  return std::to_string(image.width()) + " x " + std::to_string(image.height());
}

std::string text_of(const geometry::PinholeCamera& camera, int decimals) {
  const auto pair = [decimals](double x, double y) {
    return core::fixed_text(x, decimals) + " and " + core::fixed_text(y, decimals);
  };
  return std::to_string(camera.width) + " x " + std::to_string(camera.height) + " pixels, focal lengths " +
         pair(camera.fx, camera.fy) + ", principal point " + pair(camera.cx, camera.cy);
}

/// " from ... to ...", with as many decimals as it takes to tell the two apart.
std::string change_text(const geometry::PinholeCamera& before, const geometry::PinholeCamera& now) {
  int decimals = 1;
  while (decimals < 9 && text_of(before, decimals) == text_of(now, decimals)) ++decimals;
  return " from " + text_of(before, decimals) + " to " + text_of(now, decimals);
}

}  // namespace

std::vector<std::string> robot_names(const belief::Scene& scene) {
  std::vector<std::string> names;
  for (const belief::KinematicBody& body : scene.robot) names.push_back(body.name);
  return names;
}

FrameAssembler::FrameAssembler(AssemblerSettings settings, std::vector<std::string> robot_bodies,
                               TfBufferSettings tf_settings)
    : settings_(std::move(settings)),
      robot_bodies_(std::move(robot_bodies)),
      tf_(tf_settings),
      joints_(settings_.robot) {}

interfaces::ImageRules FrameAssembler::image_rules() const {
  interfaces::ImageRules rules;
  rules.mono16_is_depth = settings_.mono16_is_depth;
  return rules;
}

core::Status FrameAssembler::add_depth(const interfaces::RosImage& image, MessageIndex index,
                                       core::TimeNs received_ns) {
  DepthMessage message{image.header, {}, {}, image.encoding};
  PRESCENE_TRY(message.depth, interfaces::to_depth_image(image, image_rules(), &message.report));
  return add_depth(std::move(message), index, received_ns);
}

core::Status FrameAssembler::add_depth(DepthMessage&& message, MessageIndex index, core::TimeNs received_ns) {
  PRESCENE_TRY(const core::TimeNs stamp_ns, interfaces::to_stamp_ns(message.header.stamp));
  std::string frame_id = settings_.camera_frame;
  if (frame_id.empty() && !message.header.frame_id.empty()) {
    PRESCENE_TRY(frame_id, interfaces::to_frame_id(message.header.frame_id));
  }
  Waiting entry{index,
                stamp_ns,
                received_ns,
                std::move(frame_id),
                std::make_shared<geometry::DepthImage>(std::move(message.depth)),
                std::move(message.report.warnings)};
  if (newest_ && stamp_ns > newest_->stamp_ns) period_ns_ = stamp_ns - newest_->stamp_ns;
  newest_ = {stamp_ns, received_ns};
  if (const char* doubt = doubt_of_stamp(entry)) {
    skip(entry, doubt);
    return core::ok_status();
  }
  if (last_taken_ && stamp_ns <= last_taken_->stamp_ns) {
    skip(entry, "not newer than the frame before it");
    return core::ok_status();
  }
  const auto place = std::upper_bound(waiting_.begin(), waiting_.end(), stamp_ns,
                                      [](core::TimeNs t, const Waiting& other) { return t < other.stamp_ns; });
  waiting_.insert(place, std::move(entry));
  while (too_many(waiting_, kMaxWaiting, &Waiting::depth)) {
    skip(waiting_.front(), "too many frames wait");
    waiting_.pop_front();
  }
  return core::ok_status();
}

const char* FrameAssembler::doubt_of_stamp(const Waiting& frame) {
  if (!last_taken_) return nullptr;
  const core::TimeNs step_ns = frame.stamp_ns - last_taken_->stamp_ns;
  const core::TimeNs went_by_ns = std::max<core::TimeNs>(0, frame.received_ns - last_taken_->received_ns);
  // Divided, as the product may be out of range.
  const bool is_ahead = (step_ns - kClockJumpNs) / kFastestClock > went_by_ns;
  ahead_in_a_row_ = is_ahead ? ahead_in_a_row_ + 1 : 0;
  behind_in_a_row_ = step_ns < -kClockJumpNs ? behind_in_a_row_ + 1 : 0;
  if (is_ahead && ahead_in_a_row_ < kTooManyToBeWrong)
    return "far ahead of the frame before it: its stamp is wrong, or the sender's clock was set";
  if (behind_in_a_row_ == 0) return nullptr;
  if (behind_in_a_row_ < kTooManyToBeWrong)
    return "far behind the frame before it: its stamp is wrong, or the sender's clock was set";
  clock_jumped_back();
  return nullptr;
}

core::Status FrameAssembler::add_color(const interfaces::RosImage& image, MessageIndex index,
                                       core::TimeNs received_ns) {
  if (!settings_.use_color) return core::ok_status();
  ColorMessage message{image.header, {}, image.encoding};
  PRESCENE_TRY(message.color, interfaces::to_color_image(image));
  return add_color(std::move(message), index, received_ns);
}

core::Status FrameAssembler::add_color(ColorMessage&& message, MessageIndex index, core::TimeNs) {
  if (!settings_.use_color) return core::ok_status();
  PRESCENE_TRY(const core::TimeNs stamp_ns, interfaces::to_stamp_ns(message.header.stamp));
  colors_.push_back({index, stamp_ns, std::make_shared<geometry::ColorImage>(std::move(message.color))});
  while (too_many(colors_, kMaxColors, &Color::image)) colors_.pop_front();
  return core::ok_status();
}

core::Status FrameAssembler::add_camera_info(const interfaces::RosCameraInfo& info, MessageIndex index) {
  interfaces::CameraReport report;
  interfaces::CameraRules rules;
  rules.rectified = settings_.rectified.value_or(false);
  PRESCENE_TRY(const geometry::PinholeCamera camera, interfaces::to_camera(info, rules, &report));
  std::vector<std::string> doubts = std::move(report.warnings);
  PRESCENE_TRY(const geometry::LensDistortion lens, interfaces::to_lens(info, rules, &report));
  std::ranges::move(report.warnings, std::back_inserter(doubts));
  // A driver sends the same camera info with every frame.
  if (camera_ != camera || lens_ != lens) warp_.reset();
  camera_ = camera;
  lens_ = lens;
  lens_model_ = info.distortion_model;
  camera_index_ = index;
  camera_doubts_ = std::move(doubts);
  return core::ok_status();
}

std::string FrameAssembler::lens_text() const {
  if (!camera_) return "";
  if (settings_.rectified.value_or(false)) return "images are rectified already, D is not used";
  if (lens_.is_none()) return camera_doubts_.empty() ? "no distortion" : "distortion ignored";
  return interfaces::quote(lens_model_) + ", images are straightened here";
}

core::Status FrameAssembler::straighten(AssembledFrame& frame) {
  if (lens_.is_none()) return core::ok_status();
  if (!warp_) warp_ = interfaces::LensWarp::undistorting(*camera_, lens_);
  belief::RgbdFrame& images = frame.observation.frame;
  PRESCENE_TRY(geometry::DepthImage depth, warp_->depth(*images.depth));
  images.depth = std::make_shared<geometry::DepthImage>(std::move(depth));
  if (images.color) {
    PRESCENE_TRY(geometry::ColorImage color, warp_->color(*images.color));
    images.color = std::make_shared<geometry::ColorImage>(std::move(color));
  }
  if (warp_->visible_share() < kLeastVisibleShare) {
    frame.doubts.push_back("d: the lens shows " + std::to_string(std::lround(100.0 * warp_->visible_share())) +
                           " % of the straightened image; check the calibration");
  }
  return core::ok_status();
}

core::Status FrameAssembler::add_tf(const interfaces::RosTfMessage& message, MessageIndex index, bool is_static) {
  tf_until_ = index;
  PRESCENE_TRY(const interfaces::FrameTransforms transforms, interfaces::to_transforms(message));
  core::Status first_bad = transforms.rejected.empty() ? core::ok_status() : transforms.rejected.front();
  for (const interfaces::FrameTransform& transform : transforms.accepted) {
    joints_.give_way(transform.child, tf_);
    core::Status added = tf_.add(transform.parent, transform.child, transform.stamp_ns, transform.X_PC, is_static);
    if (!added.ok() && first_bad.ok()) first_bad = std::move(added);
  }
  return first_bad;
}

core::Status FrameAssembler::add_joint_state(const interfaces::RosJointState& message, MessageIndex index) {
  tf_until_ = index;
  return joints_.add(message, settings_.world_frame, tf_);
}

const FrameAssembler::Color* FrameAssembler::color_of(const Waiting& waiting) const {
  const Color* best = nullptr;
  for (const Color& color : colors_) {
    if (!best || std::abs(color.stamp_ns - waiting.stamp_ns) < std::abs(best->stamp_ns - waiting.stamp_ns))
      best = &color;
  }
  return best && std::abs(best->stamp_ns - waiting.stamp_ns) <= core::ns_of(settings_.max_stamp_difference_s) ? best
                                                                                                              : nullptr;
}

FrameAssembler::Attempt FrameAssembler::assemble(const Waiting& waiting, bool out_of_time) const {
  if (!camera_) return {{}, "no usable camera info has come", false};
  if (camera_->width != waiting.depth->width() || camera_->height != waiting.depth->height()) {
    return {{},
            "the camera info is for " + std::to_string(camera_->width) + " x " + std::to_string(camera_->height) +
                " pixels, the depth image has " + std::to_string(waiting.depth->width()) + " x " +
                std::to_string(waiting.depth->height()),
            true};
  }
  AssembledFrame frame;
  frame.depth = waiting.index;
  frame.camera_info = camera_index_;
  frame.tf_until = tf_until_;
  frame.doubts = waiting.doubts;
  frame.doubts.insert(frame.doubts.end(), camera_doubts_.begin(), camera_doubts_.end());
  belief::Observation& observation = frame.observation;
  observation.stamp_ns = waiting.stamp_ns;
  observation.frame.depth = waiting.depth;
  frame.camera_frame = waiting.frame_id;
  observation.frame.camera = *camera_;

  // Colour helps but is not needed: a frame whose colour does not come in time goes without it.
  if (settings_.use_color) {
    const Color* color = color_of(waiting);
    if (!color && !out_of_time) return {{}, "its colour image has not come", false};
    if (color && color->image->width() == camera_->width && color->image->height() == camera_->height) {
      observation.frame.color = color->image;
      frame.color = color->index;
    } else {
      frame.doubts.push_back(color ? "the colour image has " + size_text(*color->image) + " pixels, the depth image " +
                                         size_text(*waiting.depth) + ": depth alone is used; publish both of one size"
                                   : "no colour image came with the depth image: depth alone is used; look at the "
                                     "stamps of both, or give no colour topic where there is none (--color-topic '')");
    }
  }
  core::Result<geometry::Pose> X_WC =
      waiting.frame_id.empty() ? core::Result<geometry::Pose>(core::not_found("the depth image names no frame"))
                               : tf_.lookup(settings_.world_frame, waiting.frame_id, waiting.stamp_ns);
  if (!X_WC && !settings_.X_WC) return {{}, X_WC.status().message(), false};
  if (!X_WC && !out_of_time && (settings_.doubts_X_WC || tf_.knows(waiting.frame_id)))
    return {{}, X_WC.status().message(), false};
  observation.X_WC = X_WC ? *X_WC : *settings_.X_WC;
  if (!X_WC && settings_.doubts_X_WC)
    frame.doubts.push_back("tf does not say where the camera is: it is taken to be where the scene says");

  for (const std::string& body : robot_bodies_) {
    const core::Result<geometry::Pose> X_WG = tf_.lookup(settings_.world_frame, body, waiting.stamp_ns);
    if (X_WG) {
      observation.robot[body] = *X_WG;
    } else if ((tf_.knows(body) || !last_taken_) && !out_of_time) {
      // At the start nothing is known of a body yet: the first frame waits for it, later ones go without.
      return {{}, X_WG.status().message(), false};
    }
  }
  const std::vector<std::string> joint_doubts = joints_.doubts(waiting.stamp_ns);
  frame.doubts.insert(frame.doubts.end(), joint_doubts.begin(), joint_doubts.end());
  return {std::move(frame), "", false};
}

bool FrameAssembler::is_out_of_time(const Waiting& waiting, core::TimeNs now_ns) const {
  // A time before it came is that of a simulation that began anew.
  return now_ns < waiting.received_ns || now_ns - waiting.received_ns >= core::ns_of(settings_.max_wait_s);
}

std::optional<AssembledFrame> FrameAssembler::finish(std::size_t index, AssembledFrame&& frame) {
  const Waiting taken = waiting_[index];
  if (last_taken_ && (last_taken_->camera != *camera_ || last_taken_->lens != lens_)) {
    const bool is_lens = last_taken_->camera == *camera_;
    frame.doubts.push_back("the camera info has changed" +
                           (is_lens ? " in its lens" : change_text(last_taken_->camera, *camera_)) +
                           ": the new one is used; if the camera was not set otherwise, two nodes publish it");
  }
  last_taken_ = Taken{taken.index, taken.stamp_ns, taken.received_ns, *camera_, lens_};
  for (std::size_t older = 0; older < index; ++older) skip(waiting_[older], "a newer frame was ready");
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(index + 1));
  // Last, as it needs memory: the frame is gone even if there is none.
  const core::Status straight = straighten(frame);
  if (straight.ok()) return std::move(frame);
  skip(taken, straight.message());
  return std::nullopt;
}

std::optional<std::size_t> FrameAssembler::pick(core::TimeNs now_ns, std::optional<AssembledFrame>* frame) {
  std::optional<std::size_t> picked;
  for (std::size_t i = 0; i < waiting_.size();) {
    const Waiting& waiting = waiting_[i];
    const bool out_of_time = is_out_of_time(waiting, now_ns);
    Attempt attempt = assemble(waiting, out_of_time);
    if (!attempt.frame && (attempt.hopeless || out_of_time)) {
      skip(waiting, attempt.missing);
      waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(i));
      continue;
    }
    if (attempt.frame) {
      picked = i;
      *frame = std::move(attempt.frame);
      if (now_ns - waiting.received_ns < 2 * core::ns_of(settings_.max_wait_s)) break;
    }
    ++i;
  }
  return picked;
}

std::optional<FrameAssembler::DepthTimes> FrameAssembler::ready(core::TimeNs now_ns) {
  std::optional<AssembledFrame> frame;
  const auto picked = pick(now_ns, &frame);
  if (!picked) return std::nullopt;
  return DepthTimes{waiting_[*picked].stamp_ns, waiting_[*picked].received_ns};
}

std::optional<AssembledFrame> FrameAssembler::take_ready(core::TimeNs now_ns) {
  std::optional<AssembledFrame> frame;
  const auto picked = pick(now_ns, &frame);
  if (!picked) return std::nullopt;
  return finish(*picked, *std::move(frame));
}

std::optional<FrameAssembler::DepthTimes> FrameAssembler::waiting(MessageIndex depth) const {
  for (const Waiting& waiting : waiting_)
    if (waiting.index == depth) return DepthTimes{waiting.stamp_ns, waiting.received_ns};
  return std::nullopt;
}

std::optional<AssembledFrame> FrameAssembler::take_recorded(MessageIndex depth, core::TimeNs now_ns) {
  const auto found = std::find_if(waiting_.begin(), waiting_.end(),
                                  [depth](const Waiting& waiting) { return waiting.index == depth; });
  if (found == waiting_.end()) return std::nullopt;
  Attempt attempt = assemble(*found, is_out_of_time(*found, now_ns));
  if (!attempt.frame) return std::nullopt;
  return finish(static_cast<std::size_t>(found - waiting_.begin()), *std::move(attempt.frame));
}

std::optional<MessageIndex> FrameAssembler::oldest_needed() const {
  std::optional<MessageIndex> oldest;
  const auto need = [&oldest](MessageIndex index) { oldest = oldest ? std::min(*oldest, index) : index; };
  if (last_taken_) need(last_taken_->index);
  for (const Waiting& waiting : waiting_) need(waiting.index);
  for (const Color& color : colors_)
    if (!last_taken_ || color.stamp_ns >= last_taken_->stamp_ns - core::ns_of(settings_.max_stamp_difference_s))
      need(color.index);
  return oldest;
}

bool FrameAssembler::has_waiting(core::TimeNs from_ns, core::TimeNs before_ns) const {
  return std::any_of(waiting_.begin(), waiting_.end(), [&](const Waiting& waiting) {
    return waiting.stamp_ns >= from_ns && waiting.stamp_ns < before_ns;
  });
}

void FrameAssembler::skip_up_to(core::TimeNs stamp_ns, const std::string& reason) {
  while (!waiting_.empty() && waiting_.front().stamp_ns <= stamp_ns) {
    skip(waiting_.front(), reason);
    waiting_.pop_front();
  }
}

std::optional<AssembledFrame> FrameAssembler::take(core::TimeNs now_ns) {
  for (std::size_t newest = waiting_.size(); newest > 0; --newest) {
    const Waiting& waiting = waiting_[newest - 1];
    const bool out_of_time = is_out_of_time(waiting, now_ns);
    Attempt attempt = assemble(waiting, out_of_time);
    if (attempt.frame) return finish(newest - 1, *std::move(attempt.frame));
    if (attempt.hopeless || out_of_time) {
      skip(waiting, attempt.missing);
      waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(newest - 1));
    }
  }
  return std::nullopt;
}

std::optional<core::TimeNs> FrameAssembler::next_deadline(std::optional<core::TimeNs> asked_ns) const {
  std::optional<core::TimeNs> deadline;
  for (const Waiting& waiting : waiting_) {
    const core::TimeNs mine = waiting.received_ns + core::ns_of(settings_.max_wait_s);
    if (asked_ns && mine <= *asked_ns) continue;
    deadline = deadline ? std::min(*deadline, mine) : mine;
  }
  return deadline;
}

std::vector<SkippedFrame> FrameAssembler::take_skipped() {
  const std::deque<SkippedFrame> taken = std::exchange(skipped_, {});
  return {taken.begin(), taken.end()};
}

void FrameAssembler::skip(const Waiting& waiting, std::string reason) {
  skipped_.push_back({waiting.index, waiting.stamp_ns, std::move(reason)});
  if (skipped_.size() > kMaxSkippedKept) skipped_.pop_front();
  ++skipped_count_;
}

void FrameAssembler::clock_jumped_back() {
  for (const Waiting& waiting : waiting_) skip(waiting, "the sender's clock jumped back");
  waiting_.clear();
  colors_.clear();
  tf_.forget_moving();
  joints_.begin_again();
  last_taken_.reset();
  ahead_in_a_row_ = behind_in_a_row_ = 0;
}

}  // namespace prescene::service
