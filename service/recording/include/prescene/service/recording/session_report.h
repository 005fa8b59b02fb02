// SPDX-License-Identifier: Apache-2.0
// The page about one tracked session: pictures with the belief drawn in, tracking table, curves, and what was answered.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "prescene/interfaces/reports/report.h"
#include "prescene/service/backends.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/recording/foreseen.h"
#include "prescene/service/recording/support_score.h"
#include "prescene/service/recording/tracking_score.h"
#include "prescene/service/tracking/frame_assembler.h"
#include "prescene/service/tracking/topics.h"
#include "prescene/service/tracking/tracker_settings.h"

namespace prescene::service {

/// Collects while a session runs; keeps a bounded number of pictures, evenly spread.
class SessionReport {
 public:
  SessionReport(std::shared_ptr<const belief::Scene> scene, const TrackerSettings& settings);

  /// A message of the robot: its frames are assembled as the tracker does.
  void add(const interfaces::ReceivedMessage& message);
  void add(const belief::Observation& observation);
  void add(const BeliefSummary& summary);
  /// The scene as the tracker sees it by now (supports that it found).
  void set_scene(std::shared_ptr<const belief::Scene> scene) { scene_ = std::move(scene); }
  /// Supports as they were followed; the last call counts.
  void set_supports(const SupportScore& supports) { supports_ = supports; }
  /// An answer as JSON, and when it was asked for (s into the session).
  void add_answer(double at, const std::string& json) { answers_.emplace_back(at, json); }

  /// What was foreseen beside what came.
  void set_foreseen(const ForeseenAndCame& foreseen) {
    comparisons_ = foreseen.comparisons();
    came_is_truth_ = foreseen.knows_truth();
  }

  core::Status write(const std::filesystem::path& path, const std::vector<ObjectTrackingScore>& rows,
                     Backends& backends) const;

 private:
  interfaces::PictureBlock pictures(Backends& backends) const;
  std::vector<interfaces::ReportBlock> curves() const;
  void add_supports(interfaces::ReportContents& contents) const;
  void add_foreseen(interfaces::ReportContents& contents) const;
  void add_answers(interfaces::ReportContents& contents) const;
  void add_answer_section(double at, const nlohmann::ordered_json& answer, interfaces::ReportContents& contents) const;

  std::shared_ptr<const belief::Scene> scene_;
  InputTopics topics_;
  FrameAssembler assembler_;
  MessageIndex next_index_ = 0;
  std::vector<belief::Observation> observations_;
  std::size_t every_ = 1;  // observations between two that are kept
  std::size_t seen_ = 0;
  std::map<core::TimeNs, BeliefSummary> summaries_;
  SupportScore supports_;
  std::vector<std::pair<double, std::string>> answers_;
  std::vector<Comparison> comparisons_;
  bool came_is_truth_ = false;
};

}  // namespace prescene::service
