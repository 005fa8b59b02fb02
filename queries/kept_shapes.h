// SPDX-License-Identifier: Apache-2.0
// The shapes of the things of a belief, kept for the next belief of the same things.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/queries/query_engine.h"
#include "relation_shapes.h"

namespace prescene::queries {

/// Empty at first; relations() fills it.
struct KeptShapes {
  std::shared_ptr<const belief::Scene> scene;        ///< Whose they are, ...
  std::vector<std::pair<std::string, int>> objects;  ///< ... of these objects (name and model).
  std::optional<RelationShapes> shapes;
};

/// As relations() of a belief; `kept` is used where it fits, and made to fit otherwise.
core::Result<belief::RelationsAnswer> relations(const belief::Belief& snapshot, const belief::RelationsQuery& query,
                                                const QueryContext& context, KeptShapes& kept);

}  // namespace prescene::queries
