// SPDX-License-Identifier: Apache-2.0
// Learns to find a scene's models in single frames: what places on their surfaces look like, from views of each model,
// and how far a fit is to be believed, from searches in imagined scenes in which the truth is known.
//
//   PRESCENE_TRY(TrainedProposals trained, train_proposals(*scene, {}, backends));
//   PRESCENE_RETURN_IF_ERROR(write_proposals("proposals.bin", trained.proposals));
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/filter/proposals/learned_proposals.h"
#include "prescene/service/backends.h"

namespace prescene::service {

struct TrainingOptions {
  std::uint64_t seed = 1;
  int views = 300;   ///< Of each model, > 0.
  int places = 6;    ///< On each view, > 0.
  int scenes = 300;  ///< Imagined; 0 = fits are not judged, places alone are learned.
};

/// How fits do that were judged, in the last fifth of the imagined scenes, from which only the confidence was learned.
struct TrainingCheck {
  int expected = 0;         ///< Objects in these scenes of which enough is visible to expect that they are found.
  int found = 0;            ///< Of these.
  int reported = 0;         ///< Finds that are more likely right than not ...
  int right = 0;            ///< ... and those that are.
  double confidence = 0.0;  ///< Mean of the reported; to be compared with right / reported.
};

struct TrainedProposals {
  filter::LearnedProposals proposals;
  int patches = 0;           ///< Of all models.
  int candidates = 0;        ///< Judged fits that were learned from ...
  int right_candidates = 0;  ///< ... and the right ones among them.
  TrainingCheck check;
};

/// kInvalidInput for a scene without models or numbers that are not in range, and as Backends::make_simulator for
/// models that can't be simulated. kCancelled when stopped: half of a training is none. The same bits for any number of
/// threads.
core::Result<TrainedProposals> train_proposals(const belief::Scene& scene, const TrainingOptions& options,
                                               Backends& backends, const core::ProgressSink& progress = {},
                                               const core::Cancellation* cancellation = nullptr);

nlohmann::ordered_json to_json(const TrainedProposals& trained);

}  // namespace prescene::service
