// SPDX-License-Identifier: Apache-2.0
#include "doctor_checks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "prescene/core/order_statistics.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/service/tracking/camera_presets.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using interfaces::quote;

// A tracker follows objects that move by hand from about this rate on.
constexpr double kLeastRate = 5.0;
// Stamps that are older than this, or ahead, come from another clock than this machine's.
constexpr double kOldStamp = 1.0;
constexpr double kAheadStamp = 0.1;
// Of depth cameras: a lens narrower or wider than these (degrees, horizontally) is a calibration of something else.
constexpr double kNarrowest = 15.0;
constexpr double kWidest = 150.0;

/// What says so: the option, or the key of a camera that the scene file lists.
std::string said_with(const BusEvidence& evidence, const std::string& option) {
  if (evidence.camera_name().empty()) return option;
  static const std::map<std::string, std::string> kKeys = {{"--depth-topic", "topics.depth"},
                                                           {"--color-topic", "topics.color"},
                                                           {"--camera-info-topic", "topics.camera_info"},
                                                           {"--depth-form", "topics.depth_form"},
                                                           {"--color-form", "topics.color_form"},
                                                           {"--rectified", "rectified"},
                                                           {"--camera-pose", "pose"}};
  return "'" + kKeys.at(option) + "' of the camera in the scene file";
}

std::string percent(double share) { return fixed_text(100.0 * share, 0) + " %"; }

std::string size_of(const TopicEvidence& topic) {
  return std::to_string(topic.width) + " x " + std::to_string(topic.height);
}

/// Under another type than the one that is read; "" = none.
std::string other_type_of(const BusSurroundings& around, const std::string& topic, const std::string& type) {
  for (const interfaces::DomainTopic& there : around.topics)
    if (there.name == topic && there.type != type && there.writers > 0) return there.type;
  return "";
}

std::string remedy_for_type(const BusEvidence& evidence, const std::string& option, const std::string& type,
                            bool is_image) {
  std::string other_topic = "name a topic of that type with " + said_with(evidence, option);
  if (!is_image || !is_image_type(type)) return other_topic;
  const std::string form = type.ends_with("/Image")             ? "image"
                           : type.ends_with("/CompressedImage") ? "compressed"
                                                                : "points";
  const bool is_depth = option == "--depth-topic";
  if (form == "points" && !is_depth) return other_topic;
  const std::string says_form = is_depth ? "--depth-form" : "--color-form";
  if (!evidence.camera_name().empty())
    return "give " + form + " with " + said_with(evidence, says_form) + ", or " + other_topic;
  return says_form + " " + form + ", or " + other_topic;
}

/// Whether messages come and can be read; says why not.
bool check_topic(const std::string& name, const std::string& topic, const std::string& type, bool is_needed,
                 const std::string& option, const BusEvidence& evidence, const BusSurroundings& around,
                 Checks& checks) {
  const TopicEvidence& seen = evidence.topics().at(topic);
  const auto complain = [&](const std::string& what, const std::string& remedy) {
    if (is_needed)
      checks.fail(name, what, remedy);
    else
      checks.warn(name, what, remedy);
  };
  if (seen.messages > seen.refused) {
    if (seen.refused == 0) return true;
    checks.warn(name,
                std::to_string(seen.refused) + " of " + std::to_string(seen.messages) + " messages on " + topic +
                    " were refused: " + seen.last_refusal,
                "correct the sender as the text says");
    return true;
  }
  if (seen.refused > 0) {
    complain("all " + std::to_string(seen.messages) + " messages on " + topic + " were refused: " + seen.last_refusal,
             "correct the sender as the text says, or name another topic with " + said_with(evidence, option));
    return false;
  }
  const std::string other = other_type_of(around, topic, type);
  if (writers_of(around, topic, type) > 0) {
    complain("nothing has come on " + topic + " though somebody offers it",
             "look whether the camera runs (ros2 topic hz " + topic +
                 "); across machines, whether a firewall stops UDP, and the receive buffer");
  } else if (!other.empty()) {
    complain(topic + " carries " + other + ", not " + type,
             remedy_for_type(evidence, option, other, is_image_type(type)));
  } else if (topic == evidence.settings().topics.depth) {
    complain(nothing_came_text(evidence.settings().topics, around.topics,
                               "in DDS domain " + std::to_string(around.domain), evidence.camera_name()),
             evidence.camera_name().empty()
                 ? "name the camera's topics (--camera, " + option + "), or start its driver"
                 : "correct " + said_with(evidence, option) + ", or start the camera's driver");
  } else {
    complain("nobody offers " + topic,
             "name the topic with " + said_with(evidence, option) + ", or start what publishes it");
  }
  return false;
}

void check_image(const std::string& name, const std::string& topic, const std::string& type,
                 const BusEvidence& evidence, const BusSurroundings& around, Checks& checks) {
  const TopicEvidence& seen = evidence.topics().at(topic);
  const std::string what = topic + ": " + size_of(seen) + " " + quote(seen.encoding) + ", " + rate_text(seen) +
                           ", frame " + quote(seen.frame_id);
  const auto rate = seen.rate();
  const int writers = writers_of(around, topic, type);
  if (writers > 1)
    checks.warn(name, std::to_string(writers) + " nodes publish on it; " + what, "stop all but the camera's driver");
  else if (rate && *rate < kLeastRate)
    checks.warn(name, what, "objects that move are lost between frames so far apart: raise the camera's rate");
  else
    checks.ok(name, what);
}

void check_depth_values(const BusEvidence& evidence, Checks& checks) {
  const std::string name = "depth values";
  const interfaces::DepthImageReport& report = evidence.depth_report();
  const std::int64_t pixels = report.measured + report.missing;
  if (pixels == 0) return;
  const double share = static_cast<double>(report.measured) / static_cast<double>(pixels);
  const std::string what =
      percent(share) + " of the pixels have depth, median " + fixed_text(report.median_depth, 2) + " m";
  if (!report.warnings.empty())
    checks.warn(name, what + "; " + report.warnings.front(), "correct the sender as the text says");
  else if (share < 0.2)
    checks.warn(name, what, "look whether the camera sees surfaces within its range, and is not covered or dazzled");
  else
    checks.ok(name, what);
}

void check_agreement(const BusEvidence& evidence, Checks& checks) {
  const std::string name = "images agree";
  const InputTopics& topics = evidence.settings().topics;
  const TopicEvidence& depth = evidence.topics().at(topics.depth);
  const TopicEvidence& info = evidence.topics().at(topics.camera_info);
  bool agree = true;
  const auto warn = [&](const std::string& what, const std::string& remedy) {
    checks.warn(name, what, remedy);
    agree = false;
  };
  const auto& camera = evidence.camera();
  if (camera && (camera->width != depth.width || camera->height != depth.height)) {
    checks.fail(name,
                "the camera info is for " + std::to_string(camera->width) + " x " + std::to_string(camera->height) +
                    " pixels, the depth image has " + size_of(depth),
                "publish depth that is registered to colour, and the camera info of its size");
    agree = false;
  }
  if (camera && !info.frame_id.empty() && info.frame_id != depth.frame_id)
    warn("the depth image is of frame " + quote(depth.frame_id) + ", the camera info of " + quote(info.frame_id),
         "name the camera info of the camera that depth is registered to (" +
             said_with(evidence, "--camera-info-topic") + "), or publish registered depth");
  if (!topics.color.empty()) {
    const TopicEvidence& color = evidence.topics().at(topics.color);
    if (color.messages > color.refused) {
      if (color.width != depth.width || color.height != depth.height)
        warn("depth has " + size_of(depth) + " pixels, colour " + size_of(color) + ": colour is not used",
             "publish depth that is registered to colour, or leave colour out (" +
                 (evidence.camera_name().empty() ? "--color-topic ''" : said_with(evidence, "--color-topic")) + ")");
      else if (color.frame_id != depth.frame_id)
        warn("depth is of frame " + quote(depth.frame_id) + ", colour of " + quote(color.frame_id),
             "publish depth that is registered to colour");
      else if (evidence.frames() > 0 && 2 * evidence.frames_with_color() < evidence.frames())
        warn("only " + std::to_string(evidence.frames_with_color()) + " of " + std::to_string(evidence.frames()) +
                 " frames have a colour image stamped within " +
                 fixed_text(1e3 * evidence.settings().assembler.max_stamp_difference_s, 0) + " ms of depth",
             "let the driver synchronise the two streams, at the same rate");
    }
  }
  if (const std::string doubt = rectified_doubt(evidence.settings()); !doubt.empty() && agree)
    warn(doubt, "say it with " + (evidence.camera_name().empty() ? "--rectified or --not-rectified"
                                                                 : said_with(evidence, "--rectified")));
  if (agree && camera) checks.ok(name, "sizes, frames and stamps of depth, colour and camera info fit together");
}

void check_camera(const BusEvidence& evidence, Checks& checks) {
  const auto& camera = evidence.camera();
  if (!camera) return;
  const double fov = 2.0 * std::atan(0.5 * camera->width / camera->fx) * 180.0 / std::numbers::pi;
  const std::string what = "focal lengths " + fixed_text(camera->fx, 1) + " and " + fixed_text(camera->fy, 1) +
                           " pixels (" + fixed_text(fov, 0) + " degrees wide), principal point (" +
                           fixed_text(camera->cx, 1) + ", " + fixed_text(camera->cy, 1) + ")";
  const std::string remedy = "load the calibration of this camera at this resolution into its driver";
  if (fov < kNarrowest || fov > kWidest)
    checks.warn("intrinsics", what + ": that is no usual depth camera", remedy);
  else if (std::abs(camera->fx / camera->fy - 1.0) > 0.1)
    checks.warn("intrinsics", what + ": the pixels would not be square", remedy);
  else if (std::abs(camera->cx / (camera->width - 1) - 0.5) > 0.2 ||
           std::abs(camera->cy / (camera->height - 1) - 0.5) > 0.2)
    checks.warn("intrinsics", what + ": that is far from the middle of the image", remedy);
  else
    checks.ok("intrinsics", what);

  const std::string lens = evidence.lens_text();
  double moved = 0.0;
  int unseen = 0;
  for (const double u : {0.0, 0.5 * (camera->width - 1), camera->width - 1.0}) {
    for (const double v : {0.0, 0.5 * (camera->height - 1), camera->height - 1.0}) {
      const Eigen::Vector2d p((u - camera->cx) / camera->fx, (v - camera->cy) / camera->fy);
      const auto q = evidence.lens().distort(p);
      if (!q) ++unseen;
      if (q) moved = std::max(moved, std::hypot(camera->fx * (q->x() - p.x()), camera->fy * (q->y() - p.y())));
    }
  }
  if (!evidence.camera_doubts().empty())
    checks.warn("lens", evidence.camera_doubts().front(), "correct the camera info as the text says");
  else if (unseen > 0 && !evidence.lens().is_none())
    checks.warn("lens",
                lens + ", but the model does not reach " + std::to_string(unseen) +
                    " of 9 points of the image's border and middle",
                "calibrate with points up to the corners");
  else
    checks.ok("lens", lens + (evidence.lens().is_none() ? "" : ", by up to " + fixed_text(moved, 1) + " pixels"));
}

void check_tf(const BusEvidence& evidence, Checks& checks) {
  const AssemblerSettings& settings = evidence.settings().assembler;
  const InputTopics& topics = evidence.settings().topics;
  const std::string frame = evidence.camera_frame();
  const core::TimeNs stamp_ns = evidence.topics().at(topics.depth).stamp_ns;
  const bool is_listed = !evidence.camera_name().empty();
  const std::string pose_option = is_listed ? said_with(evidence, "--camera-pose") : "--camera-pose x y z qw qx qy qz";
  const auto X_WC = frame.empty() ? core::Result<geometry::Pose>(core::not_found("the depth image names no frame"))
                                  : evidence.tf().lookup(settings.world_frame, frame, stamp_ns);
  std::string way;
  if (!frame.empty())
    for (const std::string& name : evidence.tf().chain(settings.world_frame, frame))
      way += (way.empty() ? "" : " > ") + name;
  const auto pose_text = [](const geometry::Pose& X) {
    return "(" + fixed_text(X.translation.x(), 3) + ", " + fixed_text(X.translation.y(), 3) + ", " +
           fixed_text(X.translation.z(), 3) + ") m";
  };
  const auto& newest = evidence.newest();
  if (X_WC) {
    checks.ok("tf to the camera",
              way + "; the camera is at " + pose_text(*X_WC) + " of " + quote(settings.world_frame));
  } else if (is_listed && settings.X_WC && way.empty()) {
    checks.warn("tf to the camera",
                X_WC.status().message() + "; it is taken to be where the scene file says: " + pose_text(*settings.X_WC),
                "publish the camera's pose in tf, from " + quote(settings.world_frame) + " to its frame");
  } else if (newest) {
    // Moving transforms may be ahead of or behind the last image.
    checks.ok("tf to the camera", (settings.X_WC && way.empty() ? "none, --camera-pose is used" : way) +
                                      "; the camera is at " + pose_text(newest->observation.X_WC));
  } else if (settings.X_WC) {
    checks.ok("tf to the camera", "none, --camera-pose is used: " + pose_text(*settings.X_WC));
  } else {
    const std::uint64_t messages =
        evidence.topics().at(topics.tf).messages + evidence.topics().at(topics.tf_static).messages;
    checks.fail("tf to the camera",
                X_WC.status().message() +
                    (messages == 0 ? "; nothing has come on " + topics.tf + " and " + topics.tf_static : ""),
                "start robot_state_publisher and the camera's description; name the world frame (--world-frame), or "
                "give the camera's pose with " +
                    pose_option);
  }
}

void check_clock(const BusEvidence& evidence, Checks& checks) {
  const TopicEvidence& depth = evidence.topics().at(evidence.settings().topics.depth);
  if (depth.ages.empty()) return;
  const double age = core::upper_median(depth.ages);
  if (depth.stamps_not_later > 0) {
    checks.warn("stamps",
                std::to_string(depth.stamps_not_later) + " of " + std::to_string(depth.messages) +
                    " depth images are stamped no later than the one before",
                "let one driver alone publish on the topic, with the time of each exposure");
  } else if (depth.stamp_ns == 0) {
    checks.warn("stamps", "the depth images are stamped 0", "let the driver stamp them");
  } else if (age > kOldStamp || age < -kAheadStamp) {
    checks.warn("stamps",
                "depth images are stamped " + fixed_text(std::abs(age), 2) + " s " + (age > 0 ? "before" : "after") +
                    " they came, by " +
                    (evidence.settings().topics.clock.empty() ? "this machine's clock" : "simulated time"),
                "that is as it should be for a recording; in simulated time give --use-sim-time; else synchronise the "
                "clocks (chrony, PTP). Controls must have stamps of the camera's clock");
  } else {
    checks.ok("stamps", "depth images come " + fixed_text(1e3 * age, 0) + " ms (median) after their stamps");
  }
}

}  // namespace

void check_frames(const BusEvidence& evidence, Checks& checks) {
  const TopicEvidence& depth = evidence.topics().at(evidence.settings().topics.depth);
  if (depth.messages == 0) return;
  std::string reasons;
  std::uint64_t most = 0;
  for (const auto& [reason, count] : evidence.skipped()) {
    if (count > most) reasons = reason;
    most = std::max(most, count);
  }
  const std::string what = std::to_string(evidence.frames()) + " of " + std::to_string(depth.messages) +
                           " depth images make a frame that can be used";
  if (evidence.frames() == 0)
    checks.fail("frames", what + (reasons.empty() ? "" : "; most often because: " + reasons),
                "mend what is reported above; the reason here is the one that the service would log");
  else if (2 * evidence.frames() < depth.messages)
    checks.warn("frames", what + (reasons.empty() ? "" : "; most often because: " + reasons),
                "mend what is reported above");
  else
    checks.ok("frames", what);
}

bool check_one_camera(const BusEvidence& evidence, const BusSurroundings& around, Checks& checks) {
  const InputTopics& topics = evidence.settings().topics;
  const bool has_depth =
      check_topic("depth image", topics.depth, depth_type(topics), true, "--depth-topic", evidence, around, checks);
  if (has_depth) check_image("depth image", topics.depth, depth_type(topics), evidence, around, checks);
  if (topics.color.empty()) {
    checks.ok("colour image", "none is asked for");
  } else if (check_topic("colour image", topics.color, color_type(topics), false, "--color-topic", evidence, around,
                         checks)) {
    check_image("colour image", topics.color, color_type(topics), evidence, around, checks);
  }
  const bool has_info = check_topic("camera info", topics.camera_info, "sensor_msgs/msg/CameraInfo", true,
                                    "--camera-info-topic", evidence, around, checks);
  if (has_info) {
    const TopicEvidence& seen = evidence.topics().at(topics.camera_info);
    checks.ok("camera info", topics.camera_info + ": for " + size_of(seen) + " pixels, frame " + quote(seen.frame_id));
    check_camera(evidence, checks);
  }
  if (!has_depth) return false;
  check_depth_values(evidence, checks);
  check_agreement(evidence, checks);
  check_clock(evidence, checks);
  check_tf(evidence, checks);
  return true;
}

}  // namespace prescene::service
