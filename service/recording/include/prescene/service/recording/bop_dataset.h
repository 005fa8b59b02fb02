// SPDX-License-Identifier: Apache-2.0
// Simulated frames with their labels as training data, in the layout of the BOP benchmark of pose estimation
// [Hodan 2018] (bop_toolkit, docs/bop_datasets_format.md): one scene folder a camera, and the models.
//
//   PRESCENE_TRY(const auto dataset, BopDataset::create("labels", scene, *renderer));
//   options.on_frame = [&](const SimulatedFrame& frame) { return dataset->add(frame); };
//   PRESCENE_RETURN_IF_ERROR(simulate_recording(scene, options, 1, backends, cancellation, progress, *recording));
//   PRESCENE_RETURN_IF_ERROR(dataset->close());
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/status.h"
#include "prescene/rendering/renderer.h"
#include "prescene/service/recording/simulated_recording.h"

namespace prescene::service {

/// FOLDER/CCCCCC of camera number C holds, of its image number N and of the object number O of that image:
/// - rgb/NNNNNN.png and depth/NNNNNN.png: as recorded, with the sensor's noise; depth in mm, 16 bit.
/// - mask/NNNNNN_OOOOOO.png: 255 where the object alone would be seen.
/// - mask_visib/NNNNNN_OOOOOO.png: 255 where it is seen.
/// - scene_camera.json, scene_gt.json, scene_gt_info.json: intrinsics and poses (mm), and counts of pixels.
/// FOLDER/models holds obj_IIIIII.ply (mm, in the object's own frame, with normals and colours), models_info.json (with
/// the models' symmetries) and names.json, which maps obj_id to the name of the model.
///
/// Counts are those of bop_toolkit's calc_gt_info.py: px_count_all and bbox_obj are of the whole silhouette, also
/// beyond the image's border up to the image's size on each side, and widths are the last column minus the first. What
/// is visible is known here, though, not estimated from depth. Not thread-safe.
class BopDataset {
 public:
  /// Makes the folder where there is none. kInvalidInput where it is something else or is not empty, kUnavailable where
  /// nothing can be written into it. `renderer` must outlive the data set.
  static core::Result<std::unique_ptr<BopDataset>> create(const std::filesystem::path& folder,
                                                          const belief::Scene& scene, rendering::Renderer& renderer);

  /// Frames of `scene`, of which objects may be missing. With the first one the models are written. kUnavailable as
  /// write_file(); errors of the renderer.
  core::Status add(const SimulatedFrame& frame);
  /// Writes the JSON files of all frames that were added, if any was.
  core::Status close();
  /// Removes all that it wrote, and the folder if nothing else is in it. kUnavailable where something stays.
  core::Status discard();

 private:
  struct CameraFolder {
    std::filesystem::path path;
    std::uint64_t images = 0;
    std::string camera, truth, info;  // the JSON files so far
  };

  BopDataset(const std::filesystem::path& folder, const belief::Scene& scene, rendering::Renderer& renderer);
  core::Status begin();
  core::Status write_models() const;

  std::filesystem::path folder_;
  rendering::Renderer& renderer_;
  std::vector<belief::ObjectModel> models_;
  std::vector<int> ids_;  // of each model of the scene; 0 = no object is one
  std::vector<CameraFolder> cameras_;
  bool has_begun_ = false;
};

}  // namespace prescene::service
