// SPDX-License-Identifier: Apache-2.0
// The frames of the last seconds with the beliefs after them, so that what happened in them can be asked afterwards.
//
//   FrameHistory history(FrameHistorySettings{.seconds = 20.0});
//   history.add(step.observation, tracker.belief());      // after each step
//   PRESCENE_TRY(PastWindow past, history.window(question));
//   PRESCENE_TRY(const auto explained, explain_past(std::move(past), question, weights, context));
//
// Images are kept at the resolution that the likelihood looks at, by the same pixels; beliefs are shared with whoever
// else has them. What is kept is bounded by time and by bytes.
#pragma once

#include <atomic>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "prescene/belief/explain_question.h"
#include "prescene/queries/explain.h"
#include "prescene/service/recording/explained.h"

namespace prescene::service {

struct FrameHistorySettings {
  double seconds = 20.0;  ///< That are kept, of the frames' stamps; 0 = nothing is.
  double rate = 15.0;     ///< Frames a second of each camera, at most.
  /// Of images and beliefs; where they have more, the oldest are forgotten early. 20 s of five objects and 15 frames a
  /// second have some 50 MB.
  std::size_t most_bytes = std::size_t{96} << 20;
  int width = 80;  ///< Of the kept images, about: rendering::FrameTermsOptions::target_width.
};

/// What the robot said that it does, by the clock of the frames.
class ControlLog {
 public:
  /// A control message's text (ros2.md) and when it was sent; what makes no sense is left out, as the tracker refused
  /// it.
  void add(const std::string& json, core::TimeNs sent_ns);
  /// Forgets what was sent and due before, and all but the newest `most` actions.
  void forget(core::TimeNs before_ns, std::size_t most);
  void clear() { known_.clear(); }
  /// Puts what is due in the window into it. Controls without a stamp that came by another clock than the frames' can't
  /// be placed, which is remarked.
  void put_into(queries::ExplainWindow& window, std::vector<std::string>& remarks) const;

 private:
  struct Known {
    core::TimeNs due_ns = 0, sent_ns = 0;
    bool has_stamp = false;
    belief::Action action;
    core::TimeNs end_ns = 0;  // of a placement, when it lets go; of others due_ns
  };
  std::deque<Known> known_;
};

/// Which window of the history is asked for.
struct AskedWindow {
  std::optional<double> from, to;  ///< s since the session's first frame; both or neither.
  /// s before the newest frame, where `from` is not given; empty: 2 s, or as much of them as is kept.
  std::optional<double> last;
};

/// A window of the history.
struct PastWindow {
  queries::ExplainWindow window;
  core::TimeNs first_ns = 0;    ///< Stamp of the session's first frame.
  double from = 0.0, to = 0.0;  ///< s since the session's first frame: of the start, and of the last frame.
  std::vector<std::string> remarks;
};

/// Any thread may call any of it.
class FrameHistory {
 public:
  explicit FrameHistory(const FrameHistorySettings& settings) : settings_(settings), seconds_(settings.seconds) {}

  /// After a step; takes some ten microseconds. Where stamps go back, what was before is forgotten and a new session
  /// begins.
  void add(const belief::Observation& observation, std::shared_ptr<const belief::Belief> belief);
  void add_control(const std::string& json, core::TimeNs sent_ns);
  /// kUnavailable where nothing is kept, or no frame came yet; kInvalidInput for a window that is not in the history,
  /// naming what is.
  core::Result<PastWindow> window(const belief::ExplainQuestion& question) const;
  core::Result<PastWindow> window(const AskedWindow& asked) const;

  /// Instead of FrameHistorySettings::seconds: what is older is forgotten with the next frame, with 0 at once.
  void keep(double seconds);

  std::size_t frames() const;
  std::size_t bytes() const;

 private:
  struct Kept {
    queries::WindowFrame frame;
    std::size_t bytes = 0;
  };

  FrameHistorySettings settings_;  // but for its seconds
  std::atomic<double> seconds_;    // changed under the lock
  mutable std::mutex mutex_;       // guards all below
  std::deque<Kept> kept_;
  std::size_t bytes_ = 0;
  core::TimeNs first_ns_ = 0, newest_ns_ = 0;
  bool any_ = false;
  ControlLog controls_;
};

/// `frame` with the pixels only that the likelihood looks at, about `width` in a row.
queries::WindowFrame sampled_frame(const belief::Observation& observation, std::shared_ptr<const belief::Belief> belief,
                                   int width);

/// The window of a question, whose answer so far is still to be filled in.
Explained not_explained_yet(const PastWindow& past);
/// Answers the question; `past` is its window.
core::Result<Explained> explain_past(PastWindow past, const belief::ExplainQuestion& question,
                                     const belief::EventWeights& weights, const queries::ExplainContext& context);
/// {"id", "step", "explain": {...}}: as to_json(Explained), with what was asked, its window by frames, under "asked":
/// the same question of the same frames has the same answer, wall times aside, unless "cut_short".
nlohmann::ordered_json explain_answer_json(const belief::ExplainQuestion& question, const Explained& explained);

}  // namespace prescene::service
