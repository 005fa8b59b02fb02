// SPDX-License-Identifier: Apache-2.0
// The frames of all cameras that see one scene, in the order in which one belief takes them.
//
// With one camera it is that camera's FrameAssembler, and nothing else. With several, frames are taken in the order of
// their stamps: a frame waits for those of other cameras that are older and have not come, or are not complete, but for
// no longer than max_wait_s after it came; whether another camera's frame is still to come follows from the stamps of
// its last two. What comes later than that is older than what was used, and is skipped, with the reason. Where the
// caller can't keep up, cameras take turns. Nobody waits for a camera that has sent nothing for a second, of which no
// frame was complete for a second (tf or its camera info is missing), or whose stamps are so far behind that its frames
// would come too late in any case.
//
// The cameras' stamps are by one clock. A camera whose clock differs by more than a second from that of the frames
// which are used is not used while another one keeps that clock, and that is said.
//
// Which frame is taken also depends on when take() was called. A replay therefore takes those that a recording names.
//
//   CameraFrames frames(camera_inputs(settings, *scene), robot_names(*scene), settings.tf);
//   if (auto taken = frames.take_in(message, index, received_ns)) return *taken;  // it was on one of the topics
//   if (auto frame = frames.take(now_ns)) ... frame->observation.camera
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/service/tracking/frame_assembler.h"
#include "prescene/service/tracking/image_messages.h"
#include "prescene/service/tracking/topics.h"
#include "prescene/service/tracking/tracker_settings.h"

namespace prescene::service {

/// One camera: what its images are called and how frames are made of them.
struct CameraInput {
  std::string name;    ///< "" = of the only one.
  InputTopics topics;  ///< Those that are not the camera's are the same for all.
  AssemblerSettings assembler;
};

/// The cameras that are listened to: those that the scene lists under `cameras`, with their topics, frames, and poses
/// where tf has none; of a scene without such a list the one that the settings tell of.
std::vector<CameraInput> camera_inputs(const TrackerSettings& settings, const belief::Scene& scene);
/// The topics of the first of them.
InputTopics first_topics(const TrackerSettings& settings, const belief::Scene& scene);
/// Whether the scene says under which topics its cameras' images come.
bool names_topics(const belief::Scene& scene);
/// Errors of validate(InputTopics), with the camera's name.
core::Status validate(const std::vector<CameraInput>& cameras);
/// Those of bus_topics(InputTopics) of all cameras, each once.
std::vector<BusTopic> topics_of_cameras(const std::vector<CameraInput>& cameras);

/// Of the frames of several cameras those that one strip of pictures is made of: the first camera's, and others while
/// it gives none for a second.
class PicturedFrames {
 public:
  bool has(const belief::Observation& observation);

 private:
  std::optional<core::TimeNs> first_ns_;  // stamp of the first camera's newest
};

/// A camera that gives nothing: it has sent nothing for a second, or what it sends is not used, and why.
struct SilentCamera {
  std::string name;
  std::string reason;
};

/// Not thread-safe. Reads no clock.
class CameraFrames {
 public:
  /// At least one camera (checked).
  CameraFrames(std::vector<CameraInput> cameras, const std::vector<std::string>& robot_bodies,
               const TfBufferSettings& tf);

  /// Takes in a message on a topic of images, camera infos, tf or joint states; empty if it is on none of them. The
  /// status is not ok where it says something impossible.
  /// Images that decode() made of it already are taken.
  std::optional<core::Status> take_in(const interfaces::ReceivedMessage& message, MessageIndex index,
                                      core::TimeNs received_ns, DecodedImages images = {});
  /// The images of a message on a topic of images. From any thread: it depends on the settings alone.
  DecodedImages decode(const interfaces::ReceivedMessage& message) const;
  /// The next frame for the belief; doubts name the camera where there are several.
  std::optional<AssembledFrame> take(core::TimeNs now_ns);
  /// The frame that a recording names, by its camera and depth image, at the time at which it was taken; empty if it
  /// is not there. Of a single camera that is what take() does.
  std::optional<AssembledFrame> take_recorded(int camera, MessageIndex depth, core::TimeNs now_ns);
  /// Goes on as after that frame was taken, which is not given again: nothing older is. Where it is not there, nothing
  /// is changed.
  void resume_after(int camera, MessageIndex depth, core::TimeNs now_ns);
  /// As of FrameAssembler, the lowest of all cameras.
  std::optional<MessageIndex> oldest_needed() const;
  /// As of FrameAssembler, of all cameras; reasons name the camera where there are several.
  std::optional<core::TimeNs> next_deadline() const;
  std::vector<SkippedFrame> take_skipped();
  std::string last_skip() const;
  std::uint64_t skipped_count() const;
  void set_waits(double max_wait_s, double max_stamp_difference_s);
  std::string lens_text() const;
  std::uint64_t tf_forgotten() const { return cameras_.front().assembler.tf_forgotten(); }
  std::uint64_t tf_late() const { return cameras_.front().assembler.tf_late(); }

  /// Of several cameras those that give nothing.
  std::vector<SilentCamera> silent_cameras(core::TimeNs now_ns) const;
  /// The same, a sentence each.
  std::vector<std::string> silent(core::TimeNs now_ns) const;
  /// Of several cameras what was used of each since the start, for a person; "" of a single one.
  std::string counts_text() const;

 private:
  struct Camera {
    CameraInput input;
    FrameAssembler assembler;
    std::string prefix;                            // of messages: "camera 'side': ", "" of the only one
    std::string rectified_doubt;                   // rectified_doubt(), with the prefix
    int passed_over = 0;                           // complete frames that were not used since the last one that was
    std::optional<core::TimeNs> offered_ns = {};   // stamp of the complete frame that waits its turn
    std::optional<core::TimeNs> complete_ns = {};  // when the last one that was complete had come
    std::optional<core::TimeNs> used_ns = {};      // when the last one that was used had come
    std::uint64_t used = 0;
    std::string last_skip = {};  // why the last one that was not used was not, until one is
  };
  /// The frame that was used last.
  struct Used {
    std::size_t camera = 0;
    FrameAssembler::DepthTimes times;
  };
  /// Notes that a frame of the camera is used, and completes it.
  void note_used(std::size_t camera, FrameAssembler::DepthTimes times, AssembledFrame& frame);
  /// What is ready of a camera and can be used; skips what can't.
  std::optional<FrameAssembler::DepthTimes> offer(std::size_t camera, core::TimeNs now_ns);
  bool is_of_other_clock(std::size_t camera, const FrameAssembler::DepthTimes& times) const;
  /// Why a frame is not used that is older than what was used last.
  std::string lateness(const FrameAssembler::DepthTimes& times) const;
  /// Whether a frame of another camera that comes before `times` may be still to come.
  bool waits_for_others(std::size_t camera, const FrameAssembler::DepthTimes& times, core::TimeNs now_ns) const;

  std::vector<Camera> cameras_;
  std::optional<Used> used_;
  std::optional<core::TimeNs> began_ns_;  // when the first frame that was used had come
  std::optional<core::TimeNs> asked_ns_;  // of several cameras: the time of the last take()
  double max_wait_s_ = 0.0;
};

}  // namespace prescene::service
