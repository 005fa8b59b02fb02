// SPDX-License-Identifier: Apache-2.0
// Models of a scene as the BOP benchmark stores them: in millimetres, in the object's own frame.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "prescene/belief/object_model.h"

namespace prescene::service {

/// PLY with vertex normals and colours: those of the model's look where it has one, else its colour.
std::string bop_model_ply(const belief::ObjectModel& model);

/// An entry of models_info.json: diameter, bounding box and symmetries. A ball, whose symmetries the format cannot
/// express, gets the turns about three axes.
nlohmann::ordered_json bop_model_info(const belief::ObjectModel& model);

}  // namespace prescene::service
