// SPDX-License-Identifier: Apache-2.0
// A scene file (`scenario`), played and recorded (`record`), tracked from its recording (`replay`), and asked about
// (`predict`). Failures of these steps are reported to GoogleTest.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/query.h"
#include "prescene/belief/scene.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/recording/simulated_recording.h"
#include "prescene/service/recording/tracking_score.h"
#include "tests/support/pinned.h"

namespace prescene::tests {

/// scenarios/<name>.yaml
std::shared_ptr<const belief::Scene> scenario(const std::string& name);

/// Simulates and renders `seconds` of the scene and writes a recording of `rate` frames a second.
void record(belief::Scene scene, double rate, double seconds, std::uint64_t seed, const std::filesystem::path& path);

struct Replayed {
  std::vector<TraceEntry> trace;  ///< Of each step's stages, and "belief" of its end.
  std::vector<service::ObjectTrackingScore> tracking;
  service::BeliefSummary last_belief;
  service::TruthRecord last_truth;
};
Replayed replay(const std::filesystem::path& path, const std::shared_ptr<const belief::Scene>& scene,
                std::uint64_t seed, int threads);

/// Answers "what happens?" from the scene's priors with just so many instances.
belief::Answer predict(std::shared_ptr<const belief::Scene> scene, int instances, std::uint64_t seed, int threads);
/// Over all of an answer but its wall time.
std::uint64_t content_hash(belief::Answer answer);

}  // namespace prescene::tests
