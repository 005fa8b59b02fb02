// SPDX-License-Identifier: Apache-2.0
// The text files of a frame folder: the input is camera_poses.csv, a zero byte, and intrinsics.K.txt.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/images/frame_folder.h"
#include "tests/support/paths.h"

using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const prescene::tests::ScratchDir kScratch;
  static const bool kPrepared = [] {
    const prescene::geometry::ColorImage color(4, 3);
    const prescene::geometry::DepthImage depth(4, 3, 1.0F);
    return write_png(kScratch.path() / "a.color.png", color.view()).ok() &&
           write_png_depth(kScratch.path() / "a.depth.png", depth.view(), 0.001).ok();
  }();
  PRESCENE_CHECK(kPrepared);
  const std::uint8_t* middle = std::find(data, data + size, 0);
  const std::uint8_t* second = middle == data + size ? middle : middle + 1;
  PRESCENE_CHECK(write_file(kScratch.path() / "camera_poses.csv", std::span(data, middle)).ok());
  PRESCENE_CHECK(write_file(kScratch.path() / "intrinsics.K.txt", std::span(second, data + size)).ok());
  const auto folder = FrameFolder::open(kScratch.path());
  if (!folder) {
    PRESCENE_CHECK(!folder.status().message().empty());
    return 0;
  }
  for (std::size_t i = 0; i < folder->frames().size(); ++i) {
    PRESCENE_CHECK(folder->frames()[i].X_WC.is_finite());
    PRESCENE_CHECK(std::abs(folder->frames()[i].X_WC.rotation.norm() - 1.0) < 1e-9);
  }
  PRESCENE_CHECK(folder->load(0).ok());
  return 0;
}
