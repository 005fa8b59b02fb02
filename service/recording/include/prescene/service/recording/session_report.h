// SPDX-License-Identifier: Apache-2.0
// The page about one tracked session: pictures with the belief drawn in at each change of a state, a band of states,
// curves, what was learned, where hidden things may be, and what was answered.
//
//   SessionReport report(scene, settings, backends);
//   report.add(summary);              // of each step, and then
//   report.add(observation);          // its frame; or all summaries, then all messages
//   PRESCENE_RETURN_IF_ERROR(report.write("session.html", score));
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
#include "prescene/service/recording/residuals.h"
#include "prescene/service/recording/support_score.h"
#include "prescene/service/recording/tracking_score.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/tracking/tracker_settings.h"

namespace prescene::service {

/// Collects while a session runs; keeps a bounded number of pictures.
class SessionReport {
 public:
  /// `backends` must outlive the report.
  SessionReport(std::shared_ptr<const belief::Scene> scene, const TrackerSettings& settings, Backends& backends);

  /// What was believed after a frame. In the order of their stamps, each before the frame itself.
  void add(const BeliefSummary& summary);
  /// A message of the robot: its frames are assembled as the tracker does.
  void add(const interfaces::ReceivedMessage& message);
  /// A frame. Those of which no summary is known are left out.
  void add(const belief::Observation& observation);
  /// The scene as the tracker sees it by now (supports that it found).
  void set_scene(std::shared_ptr<const belief::Scene> scene) { scene_ = std::move(scene); }
  /// Supports as they were followed; the last call counts.
  void set_supports(const SupportScore& supports) { supports_ = supports; }
  /// An answer as JSON, and when it was asked for (s into the session).
  void add_answer(double at, const std::string& json) { answers_.emplace_back(at, json); }

  /// The file of `prescene train` that objects were looked for with; "" = none.
  void set_proposals(std::string file) { proposals_ = std::move(file); }

  /// The page of the live view with the session in it, which stands first.
  void set_page(interfaces::PageBlock page) { page_ = std::move(page); }

  /// What was foreseen beside what came.
  void set_foreseen(const ForeseenAndCame& foreseen) {
    comparisons_ = foreseen.comparisons();
    came_is_truth_ = foreseen.knows_truth();
  }

  core::Status write(const std::filesystem::path& path, const TrackingScore& score) const;

 private:
  /// Of each camera, evenly spread over the session.
  interfaces::PictureBlock pictures() const;
  /// ", camera side"; "" of the only one.
  std::string by_camera(const belief::Observation& observation) const;
  void add_changes(interfaces::ReportContents& contents) const;
  void add_supports(interfaces::ReportContents& contents) const;
  void add_foreseen(interfaces::ReportContents& contents) const;
  void add_answers(interfaces::ReportContents& contents) const;
  void add_answer_section(double at, const nlohmann::ordered_json& answer, interfaces::ReportContents& contents) const;

  std::shared_ptr<const belief::Scene> scene_;
  CameraFrames frames_;
  MessageIndex next_index_ = 0;
  Backends* backends_;
  ResidualMeter residual_meter_;
  /// The frames of a camera that are kept.
  struct Kept {
    std::vector<belief::Observation> observations;
    std::size_t every = 1;  // frames between two that are kept
    std::size_t seen = 0;
  };
  std::map<int, Kept> kept_;  // by camera
  std::map<core::TimeNs, BeliefSummary> summaries_;
  std::map<core::TimeNs, std::string> changes_;  // of states: what they are
  std::map<core::TimeNs, belief::Observation> at_changes_;
  std::map<core::TimeNs, std::map<std::string, double>> residuals_;
  SupportScore supports_;
  std::vector<std::pair<double, std::string>> answers_;
  std::vector<Comparison> comparisons_;
  bool came_is_truth_ = false;
  std::string proposals_;
  interfaces::PageBlock page_;
};

}  // namespace prescene::service
