// SPDX-License-Identifier: Apache-2.0
// Learned files: what was learned of physical parameters, kept from one session to the next. YAML that a program writes
// and a person can read; docs/reference/scene_files.md describes it.
//
//   PRESCENE_TRY(const LearnedFile learned, parse_learned(text, "learned.yaml"));
//   PRESCENE_TRY(const belief::Scene fitted, with_learned_models(scene, learned));
//   PRESCENE_TRY(const auto physics, learned_physics(fitted, learned));   // one an object of the scene
//   const std::string yaml = learned_yaml(with_learned(learned, fitted, belief.objects));
//
// It has two parts. Of models it holds values that take the place of the scene's, as `prescene calibrate` finds them.
// Of objects it holds the weighted draws that a tracker's evidence left, together with the priors that they were drawn
// from: they mean nothing for other priors.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/physical_priors.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::interfaces {

/// What was found about a model; what is empty stays as the scene says.
struct LearnedModel {
  std::string name;
  std::optional<belief::ScalarDistribution> mass;  ///< kg
  std::optional<belief::ScalarDistribution> friction;
  std::optional<belief::ScalarDistribution> impact_friction;
  std::optional<belief::ScalarDistribution> restitution;
  std::optional<belief::Vector3Distribution> center_of_mass;  ///< p_OoOcm, m
  std::optional<geometry::Matrix3d> unit_inertia;             ///< m^2, of 1 kg about the centre of mass.
  std::optional<double> rolling_friction;                     ///< m
  std::optional<double> edge_radius;                          ///< m
  FilePlace place;
};

/// What a tracker learned of an object.
struct LearnedObject {
  std::string name;
  std::vector<belief::PhysicalPrior> priors;  ///< As belief::physical_priors of the model that it had.
  belief::PhysicalBelief physics;             ///< With draws.
  FilePlace place;
};

struct LearnedFile {
  std::vector<LearnedModel> models;
  std::vector<LearnedObject> objects;
};

/// The values of a calibrated model that `prescene calibrate` fits: all but the mass.
LearnedModel learned_model(const belief::ObjectModel& fitted);

/// Reads a learned file; `file` is its name in messages. The status of a failure lists every mistake on a line of its
/// own (file:line: key: reason: remedy); `report` holds them one by one.
core::Result<LearnedFile> parse_learned(std::string_view text, const std::string& file, FileReport* report = nullptr,
                                        const YamlLimits& limits = {});
/// The text of the file, with the estimates as comments. What is read back from it equals what was written, to the bit.
std::string learned_yaml(const LearnedFile& file);

/// The scene with the values of the file's models in place of its own; models that it does not have are left out.
/// kInvalidInput, with file and line, where a model would be none (belief::validate).
core::Result<belief::Scene> with_learned_models(belief::Scene scene, const LearnedFile& file);
/// What the file says of each object of the scene, in the scene's order; of others it says nothing (the priors).
/// kInvalidInput, with file and line, where an object was learned from other priors than the scene has now.
core::Result<std::vector<belief::PhysicalBelief>> learned_physics(const belief::Scene& scene, const LearnedFile& file);
/// The file with what is believed now of each object of the scene in place of what it says; objects of which nothing
/// was learned, and those that the scene does not have, stay in it as they are.
LearnedFile with_learned(LearnedFile file, const belief::Scene& scene, std::span<const belief::ObjectBelief> objects);

}  // namespace prescene::interfaces
