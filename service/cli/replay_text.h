// SPDX-License-Identifier: Apache-2.0
// What `replay` says: its tables as text, and its results as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/service/live/bus_replay.h"
#include "prescene/service/recording/foreseen.h"
#include "prescene/service/recording/replay.h"
#include "prescene/service/recording/support_score.h"
#include "prescene/service/recording/tracking_score.h"

namespace prescene::service {

/// Records of the truth and of outcomes that a recording holds but that can't be read: they are left out and reported.
class DamagedRecords {
 public:
  /// `first` is ok where there are none.
  void add(const core::Status& first, std::uint64_t count = 1);
  std::uint64_t count() const { return count_; }
  /// "3 records of what really happened left out; the first: ...", empty if there are none.
  std::string text() const;

 private:
  std::uint64_t count_ = 0;
  std::string first_;
};

nlohmann::ordered_json tracking_json(const std::vector<ObjectTrackingScore>& rows);
/// Each object's error in each frame, where the recording holds the truth.
void add_errors(const TrackingScore& score, nlohmann::ordered_json& steps);
std::string tracking_text(const std::vector<ObjectTrackingScore>& rows);
std::string supports_text(const std::vector<SupportRow>& rows);
std::string answers_text(const std::vector<BusReplayResult::Answered>& answers);
std::string foreseen_text_of(const ForeseenAndCame& foreseen);
nlohmann::ordered_json foreseen_json(const ForeseenAndCame& foreseen);
/// What was doubtful or second best on the way, and what is wrong with the file.
std::string warnings_text(const ReplaySummary& summary);
nlohmann::ordered_json degraded_json(const ReplaySummary& summary);

}  // namespace prescene::service
