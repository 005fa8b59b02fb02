// SPDX-License-Identifier: Apache-2.0
// Which of the hypotheses about a window explain its frames: each is searched, those that compete again, until their
// probabilities are known well enough or the time is out.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "event_paths.h"
#include "explain_answer.h"
#include "other_motion.h"
#include "prescene/core/status.h"
#include "prescene/queries/explain.h"
#include "prescene/queries/tempered_smc.h"
#include "window_likelihood.h"

namespace prescene::queries {

/// Draws of a posterior, as many as it has points, each as probable.
std::vector<LatentPoint> equal_draws(const TemperedResult& posterior);

/// All that is given must outlive it.
class EventSearch {
 public:
  EventSearch(EventPaths& events, WindowLikelihood& likelihood, const std::vector<double>& times,
              const ExplainQuery& query, const QueryContext& context)
      : events_(events), likelihood_(likelihood), times_(times), query_(query), context_(context) {}

  /// Told of each look at what is known so far, with a copy of it: all hypotheses, also those that were not searched
  /// yet, with their probabilities.
  using Look = std::function<void(std::vector<Judged> nothings, std::vector<Judged> judged)>;

  /// Sets the probabilities of all of `hypotheses`, which are about the candidates (objects of `events`, one at least).
  /// `look` may be empty. kCancelled.
  core::Status run(const std::vector<std::size_t>& candidates, const std::vector<Hypothesis>& hypotheses,
                   const Look& look = {});

  std::vector<Judged>& nothings() { return nothings_; }  ///< By candidate.
  std::vector<Judged>& judged() { return judged_; }      ///< All others.
  /// Draws of runs that nothing was looked up in; results of other numbers are independent.
  std::vector<LatentPoint> fresh_draws(const Judged& judged, int number);

  bool cancelled() const;
  /// Notes it.
  bool out_of_time();
  bool was_out_of_time() const { return out_of_time_; }
  /// What was cut short or left out, for who reads the answer.
  std::vector<std::string> remarks() const;
  int evaluated() const { return evaluated_; }  ///< Instances.

 private:
  core::Status search_all(const std::vector<std::size_t>& candidates, const std::vector<Hypothesis>& hypotheses,
                          const Look& look);
  core::Status search_rivals();
  core::Status narrow_intervals(const Look& look);
  void tell(const std::vector<std::size_t>& candidates, const std::vector<Hypothesis>& hypotheses, const Look& look);
  static Judged nothing_about(const std::vector<std::size_t>& candidates, std::size_t candidate,
                              const std::vector<Hypothesis>& hypotheses);
  void search(Judged& judged, int runs, const std::function<bool()>& out_of_time);
  void evaluate(const Hypothesis& hypothesis, std::span<const LatentPoint> points, std::span<double> log_likelihoods);
  void propose_from_other_touch(const Hypothesis& hypothesis, TemperedTarget& target) const;
  void note_evidence(Judged& judged, double log_evidence);
  void leave_open(Judged& judged);
  TemperedTarget target_of(const Hypothesis& hypothesis);
  std::function<bool()> share_of_time(std::size_t searches) const;
  double evidence_of_nothing(std::size_t object) const;
  double most_likely(std::size_t object) const;
  double log_posterior(const Judged& judged) const;
  core::RandomStream stream_of(const Judged& judged) const;

  EventPaths& events_;
  WindowLikelihood& likelihood_;
  const std::vector<double>& times_;
  const ExplainQuery& query_;
  const QueryContext& context_;
  std::vector<Judged> nothings_;
  std::vector<Judged> judged_;
  std::vector<OtherMotion> others_;  // by object; of the candidates
  static constexpr double kNoneYet = -1e300;
  double best_ = kNoneYet;  // greatest log prior + log evidence until now
  int evaluated_ = 0;
  int told_at_ = 0;  // instances at the last look
  bool out_of_time_ = false;
};

}  // namespace prescene::queries
