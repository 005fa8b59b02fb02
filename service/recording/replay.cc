// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/replay.h"

#include <algorithm>
#include <utility>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/recording/read_ahead.h"
#include "prescene/service/tracking/camera_frames.h"

namespace prescene::service {
namespace {

constexpr const char* kFolderCameraFrame = "camera";
constexpr core::TimeNs kFolderLatencyNs = 1'000'000;
constexpr std::size_t kMostDegraded = 100;  // different ones, as some name a number

/// Whether Prescene wrote step records into this file.
core::Result<bool> has_step_records(const std::filesystem::path& path, bool salvage) {
  interfaces::McapReaderOptions only_steps;
  only_steps.topics = {kStepTopic};
  only_steps.salvage = salvage;
  only_steps.check_data = false;  // It is when the messages are read.
  PRESCENE_TRY(const auto reader, interfaces::McapReader::open(path, only_steps));
  for (;;) {
    PRESCENE_TRY(const auto message, reader->next());
    if (!message) return false;
    // Another program may have recorded that topic when a recording was played.
    if (holds_own_json(reader->channels()[static_cast<std::size_t>(message->channel)])) return true;
  }
}

/// Whether there are step records that a replay follows.
core::Result<bool> follows_step_records(const RecordingReader& reader, const RecordingReadOptions& options) {
  // Only a file of ours has them; and a belief that begins later goes its own way.
  if (options.from > 0.0) return false;
  bool has_steps = false;
  // The first file may be of a time when nothing was tracked yet.
  for (const std::filesystem::path& file : reader.files()) {
    if (has_steps) break;
    if (file.extension() == ".db3") continue;
    PRESCENE_TRY(has_steps, has_step_records(file, options.salvage));
  }
  return has_steps;
}

class Replay {
 public:
  Replay(Tracker& tracker, const StepSink& on_step, bool follow) : tracker_(tracker), on_step_(on_step) {
    summary_.followed_step_records = follow;
  }

  core::Status take_in(const interfaces::ReceivedMessage& message, MessageIndex index, DecodedImages images = {}) {
    ++summary_.messages;
    note_image_topic(message);
    const core::Status taken = tracker_.take_in(message, index, std::move(images));
    if (!taken.ok()) {
      if (summary_.refused++ == 0) summary_.first_refusal = taken.message();
    }
    if (summary_.followed_step_records) return core::ok_status();
    return step_while_possible(message.received_ns);
  }

  /// What waited for more is stepped without it.
  core::Status finish() {
    while (!summary_.followed_step_records && tracker_.next_deadline()) {
      const core::TimeNs deadline = *tracker_.next_deadline();
      PRESCENE_RETURN_IF_ERROR(step_while_possible(deadline));
      if (tracker_.next_deadline() == deadline) break;
    }
    return core::ok_status();
  }

  ReplaySummary take_summary() {
    summary_.skipped = tracker_.skipped_count();
    summary_.last_skip = tracker_.last_skip();
    return std::move(summary_);
  }

  core::Status follow(const StepRecord& recorded) {
    auto step = tracker_.repeat(recorded);
    ++summary_.compared;
    if (!step || step->record.belief_hash != recorded.belief_hash || step->record.depth != recorded.depth) {
      ++summary_.different;
      if (!summary_.first_different_step) summary_.first_different_step = recorded.step;
    }
    return step ? deliver(*step) : core::ok_status();
  }

  /// A file of the recording after its first begins.
  void begin(const PartStart& part) {
    if (part.goes_on) {
      tracker_.measure_cameras_anew();
      return;
    }
    if (!summary_.followed_step_records) return;
    const auto snapshot = part.snapshot.empty()
                              ? core::Result<TrackerSnapshot>(core::not_found("it holds no belief to go on from"))
                              : snapshot_from_text(part.snapshot, tracker_.scene());
    if (snapshot) {
      tracker_.resume(*snapshot);
      return;
    }
    summary_.began_anew = "file " + std::to_string(part.number) + " of the recording: " + snapshot.status().message() +
                          "; its steps are not compared: replay it together with those before it (--all-parts)";
    summary_.followed_step_records = false;
  }

  ReplaySummary& summary() { return summary_; }

 private:
  core::Status step_while_possible(core::TimeNs now_ns) {
    while (auto step = tracker_.step(now_ns)) PRESCENE_RETURN_IF_ERROR(deliver(*step));
    return core::ok_status();
  }

  core::Status deliver(const TrackerStep& step) {
    ++summary_.steps;
    count_degraded(step.record.degraded);
    return on_step_ ? on_step_(step, tracker_) : core::ok_status();
  }

  void note_image_topic(const interfaces::ReceivedMessage& message) {
    constexpr std::size_t kMost = 100;
    std::vector<interfaces::DomainTopic>& known = summary_.image_topics;
    if (!is_image_type(message.type) || known.size() >= kMost) return;
    const interfaces::DomainTopic topic{message.topic, message.type, 1, 0};
    if (std::find(known.begin(), known.end(), topic) == known.end()) known.push_back(topic);
  }

  void count_degraded(const std::vector<std::string>& words) {
    for (const std::string& word : words) {
      const auto known = std::find_if(summary_.degraded.begin(), summary_.degraded.end(),
                                      [&](const auto& entry) { return entry.first == word; });
      if (known != summary_.degraded.end()) {
        ++known->second;
      } else if (summary_.degraded.size() < kMostDegraded) {
        summary_.degraded.emplace_back(word, 1);
      }
    }
  }

  Tracker& tracker_;
  const StepSink& on_step_;
  ReplaySummary summary_;
};

}  // namespace

core::Result<ReplaySummary> replay_recording(const std::filesystem::path& path, const RecordingReadOptions& options,
                                             Tracker& tracker, const core::Cancellation& cancellation,
                                             const core::ProgressSink& progress, const StepSink& on_step,
                                             const JsonSink& on_json) {
  PRESCENE_TRY(const auto reader, RecordingReader::open(path, options));
  PRESCENE_TRY(const bool follow, follows_step_records(*reader, options));
  const double total = static_cast<double>(reader->message_count().value_or(0));
  Replay replay(tracker, on_step, follow);
  ReadAhead ahead(*reader, [&tracker](const auto& message) { return tracker.decode(message); });
  std::uint64_t entries = 0;
  for (;;) {
    if (cancellation.requested()) {
      replay.summary().cancelled = true;
      break;
    }
    PRESCENE_TRY(auto entry, ahead.next());
    if (!entry) break;
    if (progress && total > 0.0) progress({static_cast<double>(++entries) / total, {}, ""});
    const RecordedEntry& recorded = entry->recorded;
    if (recorded.part) replay.begin(*recorded.part);
    if (!recorded.is_json) {
      PRESCENE_RETURN_IF_ERROR(replay.take_in(recorded.message, recorded.index, std::move(entry->images)));
      continue;
    }
    const std::string json(recorded.message.cdr.begin(), recorded.message.cdr.end());
    if (replay.summary().followed_step_records && recorded.message.topic == kStepTopic) {
      PRESCENE_TRY(const StepRecord step, step_record_from_json(json));
      PRESCENE_RETURN_IF_ERROR(replay.follow(step));
    } else if (on_json) {
      PRESCENE_RETURN_IF_ERROR(on_json(recorded.message.topic, json, recorded.message.received_ns));
    }
  }
  ahead.stop();
  if (!replay.summary().cancelled) PRESCENE_RETURN_IF_ERROR(replay.finish());
  replay.summary().loss = reader->loss_text();
  replay.summary().missing = reader->missing_text();
  replay.summary().unchecked = reader->unchecked_text();
  return replay.take_summary();
}

core::Result<ReplaySummary> replay_folder(const interfaces::FrameFolder& folder, Tracker& tracker,
                                          const core::Cancellation& cancellation, const core::ProgressSink& progress,
                                          const StepSink& on_step) {
  Replay replay(tracker, on_step, false);
  const InputTopics topics = first_topics(tracker.settings(), *tracker.belief()->scene);
  MessageIndex index = 0;
  for (std::size_t i = 0; i < folder.frames().size(); ++i) {
    if (cancellation.requested()) {
      replay.summary().cancelled = true;
      break;
    }
    const interfaces::FolderFrame& frame = folder.frames()[i];
    const core::Result<interfaces::RgbdImages> images = folder.load(i);
    if (!images) {  // one bad picture does not end the sequence
      if (replay.summary().refused++ == 0) replay.summary().first_refusal = images.status().message();
      continue;
    }
    const interfaces::RosHeader header{interfaces::to_ros_time(frame.stamp_ns), kFolderCameraFrame};
    const interfaces::RosTfMessage tf{{interfaces::to_ros_transform(interfaces::FrameTransform{
        tracker.settings().assembler.world_frame, kFolderCameraFrame, frame.stamp_ns, frame.X_WC})}};
    const auto send = [&](const std::string& topic, const std::string& type, std::vector<std::uint8_t> cdr) {
      return replay.take_in({topic, type, std::move(cdr), frame.stamp_ns, frame.stamp_ns + kFolderLatencyNs}, index++);
    };
    PRESCENE_RETURN_IF_ERROR(send(topics.tf, "tf2_msgs/msg/TFMessage", interfaces::encode_cdr(tf)));
    PRESCENE_RETURN_IF_ERROR(send(topics.camera_info, "sensor_msgs/msg/CameraInfo",
                                  interfaces::encode_cdr(interfaces::to_ros_camera_info(folder.camera(), header))));
    PRESCENE_RETURN_IF_ERROR(send(topics.color, "sensor_msgs/msg/Image",
                                  interfaces::encode_cdr(interfaces::to_ros_image(images->color, header))));
    PRESCENE_RETURN_IF_ERROR(send(topics.depth, "sensor_msgs/msg/Image",
                                  interfaces::encode_cdr(interfaces::to_ros_image_32fc1(images->depth, header))));
    if (progress) progress({static_cast<double>(i + 1) / static_cast<double>(folder.frames().size()), {}, frame.name});
  }
  if (!replay.summary().cancelled) PRESCENE_RETURN_IF_ERROR(replay.finish());
  return replay.take_summary();
}

}  // namespace prescene::service
