// SPDX-License-Identifier: Apache-2.0
// Which objects of a window events are looked for of, and what its frames say of each: since when it is elsewhere, and
// where it is in each of them.
#pragma once

#include <cmath>
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
      : events_(&events), likelihood_(&likelihood), times_(times), query_(query) {
    for (std::size_t k = 1; k < likelihood.frames(); ++k)
      has_several_cameras_ = has_several_cameras_ || likelihood.camera(k) != likelihood.camera(0);
  }

  /// What was not there at the start, and nobody has found, in the last frame of a camera.
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
  static constexpr double kSilent = 0.1;  // nats
  struct Elsewhere {
    double moved = 0.0;  // m, turns by a lever of 5 cm
    bool elsewhere = false;
  };
  Elsewhere tracked_elsewhere(std::size_t object) const;
  /// By frame, nats: what it says of the object's absence.
  std::vector<double> absent_ratios(std::size_t object) const;
  /// Of several cameras, one may not see what another sees: its frames say the same of all.
  bool is_silent(double a, double b) const { return has_several_cameras_ && std::abs(a - b) < kSilent; }
  belief::Pose base_at(std::size_t object, double time) const;

  EventPaths* events_;
  WindowLikelihood* likelihood_;
  const std::vector<double>& times_;
  const ExplainQuery& query_;
  bool has_several_cameras_ = false;
  int evaluated_ = 0;
  std::vector<std::string> remarks_;
};

}  // namespace prescene::queries
