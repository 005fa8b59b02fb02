// SPDX-License-Identifier: Apache-2.0
// The live view of a recording: it is replayed once, as fast as it can be, and every step can be shown again, in any
// order and by several pages at once, while the replay still runs. Questions are answered from the belief of the step
// that a page shows, or of the nearest one before it that is kept.
//
//   PRESCENE_TRY(const auto view, RecordingView::create(input.scene(), {.title = "milk.mcap"}, backends, log));
//   PRESCENE_TRY(auto summary, input.replay(*tracker, cancellation, progress, view->step_sink(), {}));
//   view->finish(remarks);
//   ... view->url()
#pragma once

#include <memory>
#include <string>

#include "prescene/service/backends.h"
#include "prescene/service/recording/replay.h"
#include "prescene/service/view/view_content.h"
#include "prescene/service/view/view_server.h"

namespace prescene::service {

struct RecordingViewOptions {
  ViewOptions view;
  std::string title;                                       ///< For the page: the recording's name.
  std::size_t most_belief_bytes = std::size_t{256} << 20;  ///< Of beliefs that are kept for questions.
  double question_seconds = 2.0;                           ///< Of a question without a limit of its own.
  double most_question_seconds = 10.0;
};

class RecordingView {
 public:
  /// `backends` must outlive the view.
  static core::Result<std::unique_ptr<RecordingView>> create(std::shared_ptr<const belief::Scene> scene,
                                                             const RecordingViewOptions& options, Backends& backends,
                                                             const core::LogSink& log);
  ~RecordingView();

  std::string url() const;
  int port() const;
  interfaces::WebCounts counts() const;
  /// Takes the steps of a replay in. Fails with kUnavailable where they can't be kept (a full disk).
  StepSink step_sink();
  core::Status add(const ShownStep& step);
  /// How far the replay is, in [0, 1].
  void set_progress(double fraction);
  /// The replay is over; `remarks` are for the page, one sentence each.
  void finish(const std::vector<std::string>& remarks);

 private:
  struct Impl;
  explicit RecordingView(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::service
