// SPDX-License-Identifier: Apache-2.0
// What a recording holds, without a scene and without tracking: topics, rates, gaps, cameras, and what is wrong with
// it.
//
//   PRESCENE_TRY(const RecordingOverview overview, overview_of("run", {}, {}));
//   for (const std::string& problem : overview.problems) ... problem
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/clock.h"
#include "prescene/core/progress.h"
#include "prescene/core/status.h"

namespace prescene::service {

struct RecordedTopic {
  std::string name;
  std::string type;
  std::string of;  ///< "robot", or of Prescene: "json", "output".
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;
  double first = 0.0;  ///< s since the recording's first message, by the times of receiving.
  double last = 0.0;
  double longest_gap = 0.0;       ///< s between two of its messages; 0 with fewer.
  double gap_at = 0.0;            ///< When it began.
  std::uint64_t damaged = 0;      ///< Messages that can't be decoded, of the types that are looked into.
  std::uint64_t stamps_back = 0;  ///< Messages whose stamp is before that of the message before.
  /// Hz; nothing with fewer than two messages.
  std::optional<double> rate() const;
};

struct RecordedImages {
  std::string topic, encoding, frame;   ///< Of the last message. Packed images: their format.
  std::uint32_t width = 0, height = 0;  ///< 0: not known without unpacking.
  std::uint64_t sizes = 1;              ///< How many times it changed, and 1.
};

struct RecordedCamera {
  std::string topic, frame, distortion_model;
  std::uint32_t width = 0, height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< Pixels, of K.
  bool is_distorted = false;                      ///< A coefficient is not zero.
  std::uint64_t versions = 1;                     ///< How many times it changed, and 1.
};

struct RecordedTransform {
  std::string parent, child;
  bool is_static = false;
  std::uint64_t messages = 0;
};

struct RecordedAttachment {
  std::string name;
  std::uint64_t bytes = 0;
};

struct RecordingOverview {
  std::string storage;  ///< "mcap", "sqlite3"
  std::vector<std::string> files;
  std::uint64_t bytes = 0;  ///< Of the files.
  std::uint64_t messages = 0;
  core::TimeNs start_ns = 0;  ///< When the first message came, ns since 1970 (or by a robot's own clock).
  double seconds = 0.0;
  std::string scene_file;  ///< "" = it names none.
  bool has_scene = false;
  std::uint64_t seed = 0;
  std::vector<RecordedAttachment> attachments;
  std::vector<RecordedTopic> topics;  ///< By name.
  std::vector<RecordedImages> images;
  std::vector<RecordedCamera> cameras;
  std::vector<RecordedTransform> transforms;  ///< At most 1000.
  std::vector<std::string> problems;          ///< A sentence each.
};

/// Reads a recording whole, damaged ones as far as they can be read. Errors of interfaces::BagReader::open; kCancelled.
core::Result<RecordingOverview> overview_of(const std::filesystem::path& path, const core::Cancellation& cancellation,
                                            const core::ProgressSink& progress);

nlohmann::ordered_json to_json(const RecordingOverview& overview);

}  // namespace prescene::service
