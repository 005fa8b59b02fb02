// SPDX-License-Identifier: Apache-2.0
// Which objects of a window events are looked for of, and what its frames say of each: since when it is elsewhere, and
// where it is in each of them.
#pragma once

#include <string>
#include <vector>

#include "event_paths.h"
#include "window_likelihood.h"

namespace prescene::queries {

class CandidateObjects {
 public:
  /// All must outlive it; the base of `likelihood` is set, `times` are those of its frames.
  CandidateObjects(EventPaths& events, WindowLikelihood& likelihood, const std::vector<double>& times,
                   const ExplainQuery& query)
      : events_(&events), likelihood_(&likelihood), times_(times), query_(query) {}

  /// What was not there at the start, and the tracker did not find, in the last frame that weighs.
  core::Status look_for_missing(const WindowFrame& last, const ExplainContext& context,
                                const filter::FilterTools& tools);
  bool may_be_explained(std::size_t object) const;
  /// Objects that the frames show to be elsewhere, those that moved furthest first; the least certain one if none did.
  std::vector<std::size_t> to_look_at();
  /// From which frames on it is not where it was, and where it was tracked last.
  void note_when_seen(std::size_t object);
  /// Of the candidates, and of all else that was tracked elsewhere: what moves may move others.
  void look_for_peaks(const std::vector<std::size_t>& candidates);

  /// Poses that were weighed.
  int evaluated() const { return evaluated_; }
  const std::vector<std::string>& remarks() const { return remarks_; }

 private:
  struct Elsewhere {
    double moved = 0.0;  // m, turns by a lever of 5 cm
    bool elsewhere = false;
  };
  Elsewhere tracked_elsewhere(std::size_t object) const;
  /// By frame, nats: what it says of the object's absence.
  std::vector<double> absent_ratios(std::size_t object) const;
  belief::Pose base_at(std::size_t object, double time) const;

  EventPaths* events_;
  WindowLikelihood* likelihood_;
  const std::vector<double>& times_;
  const ExplainQuery& query_;
  int evaluated_ = 0;
  std::vector<std::string> remarks_;
};

}  // namespace prescene::queries
