// SPDX-License-Identifier: Apache-2.0
// Any bytes as tosses.csv: read, or refused with a reason; what is read keeps what its header promises.
#include <cmath>
#include <filesystem>
#include <set>
#include <span>
#include <string>

#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/service/calibration/motion_dataset.h"
#include "tests/support/paths.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const prescene::tests::ScratchDir kScratch;
  const auto file = kScratch.path() / "tosses.csv";
  PRESCENE_CHECK(prescene::interfaces::write_file(file, std::span(data, size)).ok());
  const auto recordings = prescene::service::read_motion_table(file);
  if (!recordings) {
    PRESCENE_CHECK(!recordings.status().message().empty());
    return 0;
  }
  std::set<std::string> names;
  for (const prescene::service::MotionRecording& recording : *recordings) {
    PRESCENE_CHECK(names.insert(recording.name).second && !recording.frames.empty());
    for (std::size_t i = 0; i < recording.frames.size(); ++i) {
      PRESCENE_CHECK(recording.frames[i].X_WO.is_finite());
      PRESCENE_CHECK(std::abs(recording.frames[i].X_WO.rotation.norm() - 1.0) < 1e-9);
      PRESCENE_CHECK(std::isfinite(recording.frames[i].time));
      PRESCENE_CHECK(i == 0 || recording.frames[i].time > recording.frames[i - 1].time);
    }
  }
  return 0;
}
