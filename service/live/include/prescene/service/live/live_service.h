// SPDX-License-Identifier: Apache-2.0
// The live service: listens on the bus, steps the belief, publishes it, answers questions, and records what happened.
//
// One thread owns the belief and steps it; the bus has its own; questions are answered by two more from snapshots, so
// that a slow question never delays a frame. What may be set while it runs are parameters of its node, as ROS's nodes
// have them. Only the newest frame is used, and skipped ones are counted. Whatever is
// lost, refused or left out on the way is counted and stands in /diagnostics (ServiceHealth); the log is limited in its
// rate.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/progress.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/service/live/history_keeper.h"
#include "prescene/service/live/node_parameters.h"
#include "prescene/service/live/query_worker.h"
#include "prescene/service/recording/frame_history.h"
#include "prescene/service/recording/rolling_recording.h"
#include "prescene/service/tracking/tracker.h"

namespace prescene::service {

struct LiveSettings {
  TrackerSettings tracker;
  interfaces::DdsOptions dds;
  QueryWorkerSettings worker;  ///< Its timeline and explanations are the service's own.
  HistorySettings history;
  /// Frames that are kept for questions what happened; their width is that of the filter's likelihood.
  FrameHistorySettings frames;
  belief::EventWeights event_weights;  ///< How probable events are, of such questions: the scene file's.
  double marker_rate = 5.0;            ///< Markers a second, at most.
  double diagnostics_rate = 1.0;
  /// Publish where the objects are on the tf topic, too, as frames "prescene/OBJECT". They are not read back.
  bool publish_tf = true;
  double overlay_rate = 5.0;  ///< Pictures of the overlay a second, at most; 0 = it is not offered.
  /// Tell MoveIt where the objects are; the supports, too.
  bool planning_scene = false;
  bool planning_supports = false;
  /// For who looks on, all optional: what they do delays the service, so that they only hand over. Called on the
  /// thread of the belief after each step, with its belief; on those of the questions with each answer; and with each
  /// round of diagnostics, with a sentence on how the service is.
  std::function<void(const TrackerStep& step, const std::shared_ptr<const belief::Belief>& belief)> on_step = {};
  std::function<void(const std::string& answer)> on_answer = {};
  std::function<void(const std::string& health)> on_health = {};
  /// Where what is learned of physical parameters is kept: written anew in the end and, where something was learned
  /// since, every `learned_interval` s. Empty = nowhere.
  std::filesystem::path learned_file;
  double learned_interval = 10.0;
  /// What else the service was started with (scene file, seed, ...), to be read as parameters of its node beside those
  /// that stand here.
  std::vector<NodeParameter> started_with = {};
};

class LiveService {
 public:
  /// Joins the bus. `backends` must outlive the service; `recording` may be null.
  static core::Result<std::unique_ptr<LiveService>> create(std::shared_ptr<const belief::Scene> scene,
                                                           const LiveSettings& settings, std::uint64_t seed,
                                                           Backends& backends,
                                                           std::unique_ptr<RollingRecording> recording,
                                                           const core::LogSink& log);
  ~LiveService();

  /// Works until cancelled, then closes the recording and writes the learned file. A recording that fails on the way (a
  /// full disk) pauses, while tracking goes on, until a new file can be begun; the status then says so, and also if the
  /// learned file could not be written in the end.
  core::Status run(const core::Cancellation& cancellation);
  /// A question as if it had come over the bus, from any thread; its answer goes there, too. See QueryWorker::ask.
  void ask(std::string question_json);

 private:
  struct Impl;
  explicit LiveService(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::service
