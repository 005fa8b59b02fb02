// SPDX-License-Identifier: Apache-2.0
// Looks at a robot's topics before anything is tracked, and says what would keep the service from tracking, each with
// its remedy.
//
//   PRESCENE_TRY(const Diagnosis diagnosis, examine_bus(options, scene, backends, cancellation, progress, log));
//   for (const DoctorCheck& check : diagnosis.checks) ... check.status, check.what, check.remedy
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/core/log.h"
#include "prescene/core/progress.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/service/backends.h"
#include "prescene/service/tracking/tracker_settings.h"

namespace prescene::service {

enum class CheckStatus {
  kOk,
  kWarning,  ///< The service would track, but worse than it could, or something is unlikely to be meant.
  kError,    ///< The service would not track.
};
/// "ok", "warning", "error".
const char* to_string(CheckStatus status);

struct DoctorCheck {
  std::string name;    ///< "depth image"
  std::string camera;  ///< Of several cameras the one that it is about; "" of all, or the only one.
  CheckStatus status = CheckStatus::kOk;
  std::string what;    ///< What was found.
  std::string remedy;  ///< "" if ok.
};

/// A topic of the domain; of those that the service reads, what came.
struct ExaminedTopic {
  interfaces::DomainTopic topic;
  std::uint64_t messages = 0;
  std::optional<double> rate;  ///< Messages a second, where two or more came.
};

struct DoctorOptions {
  interfaces::DdsOptions dds;
  TrackerSettings tracker;  ///< Cameras that the scene lists take precedence over its topics.
  double seconds = 5.0;     ///< How long to listen.
};

struct Diagnosis {
  std::vector<DoctorCheck> checks;
  std::vector<ExaminedTopic> topics;
  std::optional<belief::Observation> frame;  ///< The newest that the service would have used, of the first camera.
  /// That frame with the scene drawn over it, of several cameras those of all, one below the other and named; empty
  /// without frame or scene.
  geometry::ColorImage overlay;

  /// Without errors.
  bool usable() const;
};
/// {"usable": .., "checks": [{"check", "camera" (of several), "status", "what", "remedy"}..], "topics": [{"topic",
/// "type", "writers", "readers", "messages", "rate"}..]}
nlohmann::ordered_json to_json(const Diagnosis& diagnosis);

/// Listens for the time that the options say. `scene` may be null: its checks are left out. Errors of
/// DdsNode::create; kCancelled when stopped on request.
core::Result<Diagnosis> examine_bus(const DoctorOptions& options, const std::shared_ptr<const belief::Scene>& scene,
                                    Backends& backends, const core::Cancellation& cancellation,
                                    const core::ProgressSink& progress, const core::LogSink& log);

}  // namespace prescene::service
