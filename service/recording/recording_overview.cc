// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/recording_overview.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <tuple>
#include <utility>

#include "prescene/core/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using nlohmann::ordered_json;

constexpr std::size_t kMostTransforms = 1000;
constexpr std::size_t kMostProblems = 200;
// A gap is worth a line if it is longer than so many of the topic's usual ones, and longer than this.
constexpr double kGapIntervals = 5.0;
constexpr double kShortestGap = 0.2;
constexpr std::uint64_t kFewMessages = 10;  // fewer have no usual interval
constexpr double kOtherClock = 1.0;         // s

class Overview {
 public:
  void add(const interfaces::McapChannel& channel, const interfaces::McapMessage& message) {
    if (is_repeated(channel)) {  // What is known from it is; it does not count.
      Topic& topic = topics_[{channel.topic, "robot", channel.schema.name}];
      topic.row.name = channel.topic;
      topic.row.type = channel.schema.name;
      look_into(message, topic);
      return;
    }
    if (out_.messages++ == 0) out_.start_ns = message.log_time_ns;
    const double at = core::seconds_of(message.log_time_ns - out_.start_ns);
    out_.seconds = std::max(out_.seconds, at);
    const char* of = holds_own_json(channel) ? "json" : is_own_output(channel) ? "output" : "robot";
    Topic& topic = topics_[{channel.topic, of, channel.schema.name}];
    RecordedTopic& row = topic.row;
    if (row.messages++ == 0) {
      row.name = channel.topic;
      row.type = channel.message_encoding == "json" ? "JSON" : channel.schema.name;
      row.of = of;
      row.first = at;
    } else if (at - row.last > row.longest_gap) {
      row.longest_gap = at - row.last;
      row.gap_at = row.last;
    }
    row.last = at;
    row.bytes += message.data.size();
    if (std::string_view(of) == "robot" && !other_encodings_.note(channel.topic, channel.message_encoding))
      look_into(message, topic);
  }

  RecordingOverview finish() {
    for (auto& [key, topic] : topics_) {
      if (topic.row.messages == 0) continue;
      judge(topic);
      out_.topics.push_back(std::move(topic.row));
    }
    for (auto& [name, images] : images_) out_.images.push_back(std::move(images));
    for (auto& [name, camera] : cameras_) out_.cameras.push_back(std::move(camera));
    for (auto& [key, transform] : transforms_) out_.transforms.push_back(std::move(transform));
    if (more_transforms_)
      problem("tf has more than " + std::to_string(kMostTransforms) + " frames; the others are left out");
    if (const std::string others = other_encodings_.text(); !others.empty()) problem(others);
    judge_cameras();
    return std::move(out_);
  }

  void problem(const std::string& text) {
    if (out_.problems.size() < kMostProblems) out_.problems.push_back(text);
  }
  RecordingOverview& out() { return out_; }

 private:
  struct Topic {
    RecordedTopic row;
    std::optional<core::TimeNs> stamp_ns;
    double stamp_behind = 0.0;  ///< s from the last stamp to its message's receiving.
    std::string first_damage;
  };

  void look_into(const interfaces::McapMessage& message, Topic& topic) {
    const std::string& type = topic.row.type;
    if (type == "sensor_msgs/msg/Image") {
      const auto image = decoded<interfaces::RosImage>(message, topic);
      if (image) note_images(topic, image->header, image->encoding, image->width, image->height, message);
    } else if (type == "sensor_msgs/msg/CompressedImage") {
      const auto image = decoded<interfaces::RosCompressedImage>(message, topic);
      if (image) note_images(topic, image->header, image->format, 0, 0, message);
    } else if (type == "sensor_msgs/msg/PointCloud2") {
      const auto cloud = decoded<interfaces::RosPointCloud2>(message, topic);
      if (cloud) note_images(topic, cloud->header, "points", cloud->width, cloud->height, message);
    } else if (type == "sensor_msgs/msg/CameraInfo") {
      const auto info = decoded<interfaces::RosCameraInfo>(message, topic);
      if (info) note_camera(topic, *info, message);
    } else if (type == "tf2_msgs/msg/TFMessage") {
      const auto tf = decoded<interfaces::RosTfMessage>(message, topic);
      if (tf) note_transforms(*tf, topic.row.name.ends_with("static"));
    }
  }

  template <class Message>
  static core::Result<Message> decoded(const interfaces::McapMessage& message, Topic& topic) {
    auto read = interfaces::decode_cdr<Message>(message.data);
    if (!read && topic.row.damaged++ == 0) topic.first_damage = read.status().message();
    return read;
  }

  static void note_stamp(Topic& topic, const interfaces::RosTime& stamp, const interfaces::McapMessage& message) {
    const core::TimeNs stamp_ns = core::TimeNs{stamp.sec} * 1'000'000'000 + stamp.nanosec;
    if (topic.stamp_ns && stamp_ns < *topic.stamp_ns) ++topic.row.stamps_back;
    topic.stamp_ns = stamp_ns;
    topic.stamp_behind = core::seconds_of(message.log_time_ns - stamp_ns);
  }

  void note_images(Topic& topic, const interfaces::RosHeader& header, const std::string& encoding, std::uint32_t width,
                   std::uint32_t height, const interfaces::McapMessage& message) {
    note_stamp(topic, header.stamp, message);
    const auto [entry, is_new] = images_.try_emplace(topic.row.name);
    RecordedImages& images = entry->second;
    const bool changed = std::tie(images.encoding, images.width, images.height) != std::tie(encoding, width, height);
    if (!is_new && changed) ++images.sizes;
    images = {topic.row.name, encoding, header.frame_id, width, height, images.sizes};
  }

  void note_camera(Topic& topic, const interfaces::RosCameraInfo& info, const interfaces::McapMessage& message) {
    note_stamp(topic, info.header.stamp, message);
    const auto [entry, is_new] = cameras_.try_emplace(topic.row.name);
    RecordedCamera now{topic.row.name,
                       info.header.frame_id,
                       info.distortion_model,
                       info.width,
                       info.height,
                       info.k[0],
                       info.k[4],
                       info.k[2],
                       info.k[5]};
    now.is_distorted = std::any_of(info.d.begin(), info.d.end(), [](double d) { return d != 0.0; });
    const RecordedCamera& before = entry->second;
    const auto content = [](const RecordedCamera& c) {
      return std::tie(c.frame, c.distortion_model, c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.is_distorted);
    };
    now.versions = before.versions + (!is_new && content(before) != content(now) ? 1 : 0);
    entry->second = std::move(now);
  }

  void note_transforms(const interfaces::RosTfMessage& tf, bool is_static) {
    for (const interfaces::RosTransformStamped& transform : tf.transforms) {
      const auto key = std::tuple(transform.header.frame_id, transform.child_frame_id, is_static);
      if (transforms_.size() >= kMostTransforms && !transforms_.contains(key)) {
        more_transforms_ = true;
        continue;
      }
      RecordedTransform& row = transforms_[key];
      row.parent = transform.header.frame_id;
      row.child = transform.child_frame_id;
      row.is_static = is_static;
      ++row.messages;
    }
  }

  void judge(const Topic& topic) {
    const RecordedTopic& row = topic.row;
    if (row.damaged > 0)
      problem(row.name + ": " + std::to_string(row.damaged) + " of " + std::to_string(row.messages) +
              " messages can't be decoded: " + topic.first_damage);
    if (row.of != "robot") return;
    const bool is_stream = is_image_type(row.type) || row.type == "sensor_msgs/msg/CameraInfo";
    const auto rate = row.rate();
    if (is_stream && rate && row.messages >= kFewMessages &&
        row.longest_gap > std::max(kShortestGap, kGapIntervals / *rate))
      problem(row.name + ": nothing came for " + fixed_text(row.longest_gap, 2) + " s at " + fixed_text(row.gap_at, 2) +
              " s, at a rate of " + fixed_text(*rate, 1) + " Hz");
    if (row.stamps_back > 0) problem(row.name + ": " + std::to_string(row.stamps_back) + " stamps go back");
    if (is_stream && topic.stamp_ns && std::abs(topic.stamp_behind) > kOtherClock)
      problem(row.name + ": the stamps are by another clock than the recorder's: the last is " +
              fixed_text(std::abs(topic.stamp_behind), 1) + " s " + (topic.stamp_behind > 0.0 ? "before" : "after") +
              " its message");
  }

  void judge_cameras() {
    if (out_.images.empty()) problem("no topic has images: nothing can be tracked");
    std::set<std::string> children;
    for (const RecordedTransform& transform : out_.transforms) children.insert(transform.child);
    for (const RecordedImages& images : out_.images) {
      if (images.sizes > 1)
        problem(images.topic + ": encoding or size of the images changed " + std::to_string(images.sizes - 1) +
                " times");
      const bool has_camera = std::any_of(out_.cameras.begin(), out_.cameras.end(), [&](const RecordedCamera& camera) {
        return images.width == 0 || (camera.width == images.width && camera.height == images.height);
      });
      if (!has_camera)
        problem(images.topic + ": no camera info of " + std::to_string(images.width) + " x " +
                std::to_string(images.height) + " pixels");
      if (!children.contains(images.frame))
        problem(images.topic + ": no transform leads to its frame '" + images.frame + "'");
    }
    for (const RecordedCamera& camera : out_.cameras)
      if (camera.versions > 1)
        problem(camera.topic + ": the camera changed " + std::to_string(camera.versions - 1) + " times");
  }

  RecordingOverview out_;
  interfaces::OtherEncodings other_encodings_;
  std::map<std::tuple<std::string, std::string, std::string>, Topic> topics_;
  std::map<std::string, RecordedImages> images_;
  std::map<std::string, RecordedCamera> cameras_;
  std::map<std::tuple<std::string, std::string, bool>, RecordedTransform> transforms_;
  bool more_transforms_ = false;
};

}  // namespace

std::optional<double> RecordedTopic::rate() const {
  if (messages < 2 || !(last > first)) return std::nullopt;
  return static_cast<double>(messages - 1) / (last - first);
}

core::Result<RecordingOverview> overview_of(const std::filesystem::path& path, const core::Cancellation& cancellation,
                                            const core::ProgressSink& progress) {
  PRESCENE_TRY(const auto bag, interfaces::BagReader::open(path, {.salvage = true}));
  Overview overview;
  RecordingOverview& out = overview.out();
  for (const interfaces::McapReader::AttachedFile& file : bag->attachments())
    out.attachments.push_back({file.name, file.bytes});
  const double total = static_cast<double>(bag->message_count().value_or(0));
  std::uint64_t repeated = 0;  // messages that an earlier file holds, too
  for (;;) {
    if (cancellation.requested()) return core::cancelled("stopped on request");
    PRESCENE_TRY(const auto message, bag->next());
    if (!message) break;
    const interfaces::McapChannel& channel = bag->channels()[static_cast<std::size_t>(message->channel)];
    repeated += is_repeated(channel) ? 1 : 0;
    overview.add(channel, *message);
    if (progress && total > 0.0) progress({std::min(1.0, static_cast<double>(out.messages) / total), {}, ""});
  }
  if (const std::string lost = bag->loss_text(); !lost.empty()) overview.problem(lost);
  if (const auto count = bag->message_count(); count && *count != out.messages + repeated)
    overview.problem("it says that it holds " + std::to_string(*count) + " messages; " +
                     std::to_string(out.messages + repeated) + " could be read");
  {
    PRESCENE_TRY(const auto reader, RecordingReader::open(path, {.salvage = true, .check_data = false}));
    out.scene_file = reader->info().scene_file;
    out.has_scene = !reader->info().scene_text.empty();
    out.seed = reader->info().seed;
  }
  std::error_code none;
  for (const std::filesystem::path& file : bag->files()) {
    out.files.push_back(file.string());
    if (const auto bytes = std::filesystem::file_size(file, none); !none) out.bytes += bytes;
  }
  out.storage = bag->storage();
  return overview.finish();
}

ordered_json to_json(const RecordingOverview& overview) {
  ordered_json json = {
      {"storage", overview.storage},   {"files", overview.files},           {"bytes", overview.bytes},
      {"messages", overview.messages}, {"start_ns", overview.start_ns},     {"seconds", overview.seconds},
      {"scene", overview.has_scene},   {"scene_file", overview.scene_file}, {"seed", overview.seed}};
  for (const char* list : {"attachments", "topics", "images", "cameras", "transforms"})
    json[list] = ordered_json::array();
  for (const RecordedAttachment& file : overview.attachments)
    json["attachments"].push_back({{"name", file.name}, {"bytes", file.bytes}});
  for (const RecordedTopic& topic : overview.topics) {
    ordered_json row = {{"name", topic.name},         {"type", topic.type},   {"of", topic.of},
                        {"messages", topic.messages}, {"bytes", topic.bytes}, {"first", topic.first},
                        {"last", topic.last}};
    row["rate"] = topic.rate() ? ordered_json(*topic.rate()) : ordered_json();
    row["longest_gap"] = topic.longest_gap;
    row["gap_at"] = topic.gap_at;
    row["damaged"] = topic.damaged;
    row["stamps_back"] = topic.stamps_back;
    json["topics"].push_back(std::move(row));
  }
  for (const RecordedImages& images : overview.images)
    json["images"].push_back({{"topic", images.topic},
                              {"encoding", images.encoding},
                              {"frame", images.frame},
                              {"width", images.width},
                              {"height", images.height}});
  for (const RecordedCamera& camera : overview.cameras)
    json["cameras"].push_back({{"topic", camera.topic},
                               {"frame", camera.frame},
                               {"width", camera.width},
                               {"height", camera.height},
                               {"fx", camera.fx},
                               {"fy", camera.fy},
                               {"cx", camera.cx},
                               {"cy", camera.cy},
                               {"distortion_model", camera.distortion_model},
                               {"distorted", camera.is_distorted}});
  for (const RecordedTransform& transform : overview.transforms)
    json["transforms"].push_back({{"parent", transform.parent},
                                  {"child", transform.child},
                                  {"static", transform.is_static},
                                  {"messages", transform.messages}});
  json["problems"] = overview.problems;
  return json;
}

}  // namespace prescene::service
