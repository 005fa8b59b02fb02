// SPDX-License-Identifier: Apache-2.0
// Makes observations out of messages: pairs a depth image with its colour image and camera info, looks up where the
// camera and the robot's bodies were, and skips, with a reason, what cannot be completed in time.
//
// Only the newest complete frame is used: a frame older than one already taken is skipped, never queued. The assembler
// reads no clock; time is what its caller says, so a recording assembles to the same observations.
//
// A frame whose stamp is more than a second before the last one taken, or far ahead of it, is skipped: one stamp may be
// wrong. Three such in a row mean that the sender's clock was set, and count; where it went back, what was known of the
// moving frames of tf is forgotten.
//
// Images through a lens that the camera info describes are straightened when their frame is taken, so that observations
// are always those of a pinhole camera.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/geometry/lens.h"
#include "prescene/interfaces/images/lens_warp.h"
#include "prescene/interfaces/ros_messages/messages.h"
#include "prescene/service/tracking/image_messages.h"
#include "prescene/service/tracking/joint_transforms.h"
#include "prescene/service/tracking/tf_buffer.h"

namespace prescene::service {

/// Of the bodies whose poses come from tf.
std::vector<std::string> robot_names(const belief::Scene& scene);

struct AssemblerSettings {
  std::string world_frame = "world";
  /// Frame of the camera; empty = the frame_id of the depth image.
  std::string camera_frame;
  /// The camera's pose when tf does not know it; empty = frames without tf are skipped.
  std::optional<geometry::Pose> X_WC;
  /// X_WC is what the scene file says: tf is waited for first, and a frame that goes without it says so.
  bool doubts_X_WC = false;
  double max_wait_s = 0.05;               ///< How long a depth image waits for its colour image, camera info and tf.
  double max_stamp_difference_s = 0.017;  ///< Between a depth image and its colour image.
  bool use_color = true;
  /// Whether the images are rectified: the camera is then P of the camera info instead of K, and its distortion is not
  /// that of the images. Empty = not, unless the topic's name says so (is_rectified(TrackerSettings)).
  std::optional<bool> rectified;
  bool mono16_is_depth = false;  ///< Take `mono16` depth images as millimetres.
  /// How the robot of the scene moves, for its joint states; null: they are not used. Of the scene, not of recordings'
  /// settings.
  std::shared_ptr<const interfaces::RobotKinematics> robot;
};

/// Running number of a message in a recording (or since the start), over all topics.
using MessageIndex = std::uint64_t;

struct AssembledFrame {
  belief::Observation observation;
  MessageIndex depth = 0;
  std::optional<MessageIndex> color;
  MessageIndex camera_info = 0;
  /// All messages of tf and joint states up to this number had been taken in when the poses were looked up.
  MessageIndex tf_until = 0;
  /// Of its depth image and camera info: an unlikely unit, an unknown or a changed lens.
  std::vector<std::string> doubts;
  std::string camera_frame;  ///< Of the camera in tf; "" = the depth image names none.
};

struct SkippedFrame {
  MessageIndex depth = 0;
  core::TimeNs stamp_ns = 0;
  std::string reason;
};

class FrameAssembler {
 public:
  /// `robot_bodies` are looked up in tf by name; a body that tf does not know is left out of the observation.
  FrameAssembler(AssemblerSettings settings, std::vector<std::string> robot_bodies, TfBufferSettings tf_settings = {});

  /// Each takes a message with its running number and the time it came in. A message that says something impossible is
  /// refused with a status that names the field and the remedy, and changes nothing.
  core::Status add_depth(DepthMessage&& message, MessageIndex index, core::TimeNs received_ns);
  core::Status add_depth(const interfaces::RosImage& image, MessageIndex index, core::TimeNs received_ns);
  core::Status add_color(ColorMessage&& message, MessageIndex index, core::TimeNs received_ns);
  core::Status add_color(const interfaces::RosImage& image, MessageIndex index, core::TimeNs received_ns);
  /// As in the settings; frames that wait now wait by it, too.
  void set_waits(double max_wait_s, double max_stamp_difference_s) {
    settings_.max_wait_s = max_wait_s;
    settings_.max_stamp_difference_s = max_stamp_difference_s;
  }
  /// How depth images are to be read.
  interfaces::ImageRules image_rules() const;
  bool uses_color() const { return settings_.use_color; }
  core::Status add_camera_info(const interfaces::RosCameraInfo& info, MessageIndex index);
  /// Takes every good transform of the message; the status names the first bad one.
  core::Status add_tf(const interfaces::RosTfMessage& message, MessageIndex index, bool is_static);
  /// Takes the links' transforms that follow from the joints' positions, as JointTransforms::add.
  core::Status add_joint_state(const interfaces::RosJointState& message, MessageIndex index);

  /// The newest frame that is complete at `now_ns`; older waiting frames are skipped.
  std::optional<AssembledFrame> take(core::TimeNs now_ns);
  /// For whoever takes the frames of several cameras in their order. The frame that take_ready() takes, if there is
  /// one: the oldest that is complete; of those that have waited for twice max_wait_s, as the caller can't keep up, the
  /// newest.
  struct DepthTimes {
    core::TimeNs stamp_ns = 0;
    core::TimeNs received_ns = 0;
  };
  std::optional<DepthTimes> ready(core::TimeNs now_ns);
  std::optional<AssembledFrame> take_ready(core::TimeNs now_ns);
  /// A depth image that waits; empty = it does not.
  std::optional<DepthTimes> waiting(MessageIndex depth) const;
  /// Its frame, as a recording says; empty if it does not wait or is not complete.
  std::optional<AssembledFrame> take_recorded(MessageIndex depth, core::TimeNs now_ns);
  /// The lowest number of a message that a later frame may be made of, images only: the depth image that was taken
  /// last, what waits, and the colour images that may belong to either. Empty where there is none.
  std::optional<MessageIndex> oldest_needed() const;
  /// Skips what waits with a stamp up to this one.
  void skip_up_to(core::TimeNs stamp_ns, const std::string& reason);
  /// Whether a depth image waits whose stamp is in [from_ns, before_ns).
  bool has_waiting(core::TimeNs from_ns, core::TimeNs before_ns) const;
  /// The depth image that came last, used or not; empty = none has come.
  const std::optional<DepthTimes>& newest() const { return newest_; }
  /// Between the stamps of the last two depth images that came in order; 0 = there are no two.
  core::TimeNs period_ns() const { return period_ns_; }
  /// The sender's clock went back, as another camera's frames show.
  void clock_jumped_back();

  /// When take() should be asked again although nothing has come in; empty if nothing waits. For whoever asked at
  /// `asked_ns` already, later than that.
  std::optional<core::TimeNs> next_deadline(std::optional<core::TimeNs> asked_ns = {}) const;
  /// What was skipped since the last call, oldest first; of more than a thousand, the newest.
  std::vector<SkippedFrame> take_skipped();
  /// The newest of them.
  std::optional<SkippedFrame> last_skipped() const {
    return skipped_.empty() ? std::nullopt : std::optional(skipped_.back());
  }
  /// Why it was; "" if there are none.
  std::string last_skip() const { return skipped_.empty() ? "" : skipped_.back().reason; }
  /// Since the start.
  std::uint64_t skipped_count() const { return skipped_count_; }
  std::uint64_t tf_forgotten() const { return tf_.forgotten(); }
  std::uint64_t tf_late() const { return tf_.late(); }
  /// What is done about the lens, for a person; "" before a camera info has come.
  std::string lens_text() const;

 private:
  struct Waiting {
    MessageIndex index;
    core::TimeNs stamp_ns;
    core::TimeNs received_ns;
    std::string frame_id;
    std::shared_ptr<const geometry::DepthImage> depth;
    std::vector<std::string> doubts;
  };
  struct Color {
    MessageIndex index;
    core::TimeNs stamp_ns;
    std::shared_ptr<const geometry::ColorImage> image;
  };
  struct Attempt {
    std::optional<AssembledFrame> frame;
    std::string missing;  ///< What it still waits for.
    bool hopeless = false;
  };
  Attempt assemble(const Waiting& waiting, bool out_of_time) const;
  const Color* color_of(const Waiting& waiting) const;
  /// Why a frame's stamp is not believed, or null. Counts those in a row, and follows a clock that was set.
  const char* doubt_of_stamp(const Waiting& frame);
  core::Status straighten(AssembledFrame& frame);
  void skip(const Waiting& waiting, std::string reason);
  /// Index into waiting_ of the frame that take_ready() takes.
  std::optional<std::size_t> pick(core::TimeNs now_ns, std::optional<AssembledFrame>* frame);
  /// Takes that frame out, and skips those before it.
  std::optional<AssembledFrame> finish(std::size_t index, AssembledFrame&& frame);
  bool is_out_of_time(const Waiting& waiting, core::TimeNs now_ns) const;

  AssemblerSettings settings_;
  std::vector<std::string> robot_bodies_;
  TfBuffer tf_;
  JointTransforms joints_;
  MessageIndex tf_until_ = 0;
  std::deque<Waiting> waiting_;  // ascending stamps
  std::deque<Color> colors_;     // newest last, bounded
  std::optional<geometry::PinholeCamera> camera_;
  geometry::LensDistortion lens_;
  std::string lens_model_;                    // as the camera info calls it
  std::optional<interfaces::LensWarp> warp_;  // of camera_ and lens_, once a frame has needed it
  MessageIndex camera_index_ = 0;
  std::vector<std::string> camera_doubts_;
  struct Taken {
    MessageIndex index;
    core::TimeNs stamp_ns;
    core::TimeNs received_ns;
    geometry::PinholeCamera camera;
    geometry::LensDistortion lens;
  };
  std::optional<Taken> last_taken_;
  std::optional<DepthTimes> newest_;
  core::TimeNs period_ns_ = 0;
  int ahead_in_a_row_ = 0;            // frames whose stamps are far ahead of the last one taken, ...
  int behind_in_a_row_ = 0;           // ... or before it
  std::deque<SkippedFrame> skipped_;  // not taken yet, bounded
  std::uint64_t skipped_count_ = 0;
};

}  // namespace prescene::service
