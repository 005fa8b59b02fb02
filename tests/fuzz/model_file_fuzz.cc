// SPDX-License-Identifier: Apache-2.0
// Any bytes as a model file: read, or refused with a message. A model that is read is valid; written again, it is read
// as the same model.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "prescene/core/check.h"
#include "prescene/geometry/primitives.h"
#include "prescene/interfaces/scene_files/model_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace prescene;
  interfaces::SceneFileOptions options;
  options.follow_files = false;
  // Every mesh is a cup of 8 by 10, in the file's unit.
  options.read_mesh = [](const interfaces::MeshRequest& request) -> core::Result<geometry::TriangleMesh> {
    return geometry::scaled(
        geometry::make_lathe({{0.0, 0.0}, {4.0, 0.0}, {4.0, 10.0}, {3.6, 10.0}, {3.6, 0.6}, {0.0, 0.6}}, 8),
        request.scale);
  };
  interfaces::FileReport report;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto model = interfaces::parse_model(text, "fuzz.yaml", "fuzz", options, &report);
  PRESCENE_CHECK(model.ok() == report.errors.empty());
  if (!model) {
    PRESCENE_CHECK(!model.status().message().empty());
    return 0;
  }
  PRESCENE_CHECK(belief::validate(*model).ok());
  PRESCENE_CHECK(!model->collision.empty());
  const auto* mesh = std::get_if<belief::MeshShape>(&model->collision[0]);
  if (model->collision.size() > 1 || !mesh) return 0;
  // As `inspect` writes it, with a scale that makes the cup 8 by 10 cm.
  interfaces::ModelFile file;
  file.mesh_file = "cup.ply";
  file.scale = 0.01;
  file.use = belief::MeshUse::kConvexHull;
  file.model = *model;
  const auto again = interfaces::parse_model(interfaces::model_yaml(file), "again.yaml", "fuzz", options);
  if (!again) return 0;  // Its mass or its edges are not for a cup of that size.
  PRESCENE_CHECK(again->mass == model->mass && again->center_of_mass == model->center_of_mass);
  PRESCENE_CHECK(again->unit_inertia == model->unit_inertia && again->surface == model->surface);
  return 0;
}
