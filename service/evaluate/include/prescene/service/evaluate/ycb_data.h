// SPDX-License-Identifier: Apache-2.0
// The ycb_video folder: real frames with true poses, meshes, model points, and the poses of published methods.
#pragma once

#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/pose.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::service {

struct YcbObject {
  std::string name;  ///< "003_cracker_box"
  geometry::Pose X_CO;
};

/// A frame with true poses of its labelled objects.
struct YcbFrame {
  std::string name;  ///< The folder's.
  geometry::PinholeCamera camera;
  geometry::DepthImage depth;
  geometry::ColorImage color;
  std::vector<YcbObject> objects;
};

/// Every sub-folder with depth.png and gt_poses.csv, by name. Errors name the file (and line).
core::Result<std::vector<YcbFrame>> read_ycb_frames(const std::filesystem::path& dir);

/// meshes/NAME.ply.
core::Result<geometry::TriangleMesh> read_ycb_mesh(const std::filesystem::path& dir, const std::string& object);
/// points/NAME.xyz: the data set's own model points, which errors are measured with.
core::Result<std::vector<geometry::Vector3d>> read_ycb_points(const std::filesystem::path& dir,
                                                              const std::string& object);

/// Poses of one object in one sequence, one a keyframe; nothing where it was not detected.
using YcbTrack = std::vector<std::optional<geometry::Pose>>;
/// One file of eval/METHOD: lines `qw qx qy qz tx ty tz`, a translation of 0 0 0 = not detected.
core::Result<YcbTrack> read_ycb_track(const std::filesystem::path& file);

/// Names of files in eval/ground_truth, sorted: "0048_001_chips_can.txt".
core::Result<std::vector<std::string>> list_ycb_tracks(const std::filesystem::path& dir);
/// The object in such a name.
std::string object_of_track(const std::string& file_name);

struct YcbExpectedAuc {
  std::string method;
  std::string object;  ///< Or "ALL".
  double add = 0.0;    ///< Percent.
  double adds = 0.0;
};
/// eval/expected_auc.csv, in its order.
core::Result<std::vector<YcbExpectedAuc>> read_expected_auc(const std::filesystem::path& dir);

}  // namespace prescene::service
