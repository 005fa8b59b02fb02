// SPDX-License-Identifier: Apache-2.0
// All that a tracker carries from frame to frame, so that another one goes on from there to the same bits.
//
//   const TrackerSnapshot snapshot = tracker.snapshot();
//   PRESCENE_TRY(const std::string text, snapshot_text(snapshot, scene));
//   PRESCENE_TRY(const TrackerSnapshot read, snapshot_from_text(text, scene));
//   other.resume(read);  // once it has taken in the messages that later frames are made of
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/core/status.h"
#include "prescene/service/tracking/frame_assembler.h"
#include "prescene/service/tracking/waiting_controls.h"

namespace prescene::service {

struct TrackerSnapshot {
  std::shared_ptr<const belief::Belief> belief;
  WaitingControls controls;
  /// A frame that was taken: its depth image, and the time by which it was.
  struct Taken {
    int camera = 0;
    MessageIndex depth = 0;
    core::TimeNs at_ns = 0;
  };
  std::vector<Taken> taken;  ///< The newest of each camera, in the order in which they were taken.
};

/// As JSON, some 3 kB a particle. `scene` is the tracker's own, from which that of the belief may differ in what is
/// held, in objects and joints that are gone, and in supports and objects that were found. kUnsupported where it
/// differs in anything else: the text would not bring the same belief back. Takes the time of writing and reading the
/// belief, some 10 ms a megabyte.
core::Result<std::string> snapshot_text(const TrackerSnapshot& snapshot,
                                        const std::shared_ptr<const belief::Scene>& scene);
/// kInvalidInput for a text that snapshot_text() did not write of such a scene.
core::Result<TrackerSnapshot> snapshot_from_text(const std::string& text,
                                                 const std::shared_ptr<const belief::Scene>& scene);

}  // namespace prescene::service
