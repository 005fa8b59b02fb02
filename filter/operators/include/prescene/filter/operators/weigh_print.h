// SPDX-License-Identifier: Apache-2.0
// Weighs particles by what is printed on their model, and looks for poses that depth takes for the same: the turns of a
// can, the other faces of a cube, front and back of a box.
//
//   PrintCache prints;                                              // kept with the filter
//   const PrintedModel* printed = prints.get(model, meshes);        // null: nothing is printed on it
//   if (printed) weigh_print(*printed, frame, observation, options, RivalLook::kTracked, object);
#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/filter/proposals/surface_print.h"

namespace prescene::filter {

struct WeighPrintOptions {
  /// switch. Weigh what is printed on models that have colours of their own. Range true or false. Chosen.
  bool use = true;
  /// count. Cells across an object. Range 16 to 128. Tuned: docs/studies/tracking.md.
  int cells = 40;
  /// count. Every so many frames of a tracked object, poses that depth takes for the same are compared. Range 1 to
  /// 1000. Chosen.
  int rivals_every = 12;
  /// probability. That one of these is right, before it is compared, where the pose was tracked. Range 0 to 1. Chosen.
  double rival_prior = 0.01;
  /// share. What a frame's print is worth, as frames that follow each other err alike. Range 0 to 1. Chosen.
  double frame_share = 0.3;
};

/// What the filter keeps of a printed model.
struct PrintedModel {
  SurfacePrint print;
  /// Of the shape alone: that of the model, or if it has none (as its print breaks it) what its mesh suggests.
  geometry::SymmetryGroup shape_symmetry;
};

/// Prints of models, made on first use.
class PrintCache {
 public:
  /// Null where nothing is printed on the model: it has no look, or one colour, or it is not opaque.
  const PrintedModel* get(const belief::ObjectModel& model, MeshCache& meshes);

 private:
  /// What a print is made of. It keeps mesh and look alive, so that their addresses stay their names.
  struct Entry {
    belief::MeshPtr visual;
    geometry::LookPtr look;
    belief::Color color;
    geometry::SymmetryGroup symmetry;
    std::unique_ptr<const PrintedModel> model;
  };
  std::vector<std::unique_ptr<const Entry>> entries_;
};

/// How far the rivals of an object's pose are known to be wrong.
enum class RivalLook {
  kNone,     ///< They are not compared in this frame.
  kTracked,  ///< The pose was tracked: a rival is as probable as WeighPrintOptions::rival_prior.
  kFound,    ///< The pose was found by depth alone, which says nothing of which it is.
};
/// Whether rivals are compared in a frame. `frame` counts frames, `found`: the pose comes from a search in this frame.
RivalLook rival_look(const WeighPrintOptions& options, const belief::ObjectBelief& object, std::uint64_t frame,
                     bool found);

struct PrintReport {
  double log_ratio = 0.0;  ///< Of the heaviest particle, nats.
  bool turned = false;     ///< Particles were moved to a rival.
};

/// The poses that a shape's symmetry takes for X_WO: 72 turns about a continuous axis. Without X_WO itself; nothing of
/// balls.
std::vector<Pose> rival_poses(const geometry::SymmetryGroup& symmetry, const Pose& X_WO);

/// Changes weights, the turn about a continuous axis (a measurement of it, Gaussian about the best one nearby), and
/// where the rivals are likelier, moves as many particles to each as it is probable. Nothing where the frame has no
/// colours, the object is not seen, or no pose's print agrees with the frame better than chance.
PrintReport weigh_print(const PrintedModel& printed, const FilterFrame& frame, const belief::Observation& observation,
                        const WeighPrintOptions& options, RivalLook look, belief::ObjectBelief& object);

}  // namespace prescene::filter
