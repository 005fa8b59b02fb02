// SPDX-License-Identifier: Apache-2.0
// `prescene evaluate FOLDER`: how well somebody's own recordings are forecast.
#pragma once

#include <optional>
#include <string>

#include "verb.h"

namespace prescene::service {

struct EvaluateFolderOptions {
  std::string folder;
  std::string model;  ///< A model file; empty: the scene's own.
  std::optional<int> folds;
  std::optional<int> max_evaluations;
  bool each = false;   ///< Every toss in the text as well.
  std::string report;  ///< Empty: none.
};
core::Status evaluate_folder(const EvaluateFolderOptions& options, VerbContext& context);

}  // namespace prescene::service
