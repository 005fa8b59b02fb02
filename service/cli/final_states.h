// SPDX-License-Identifier: Apache-2.0
// What tracking came to: each object's last state, and in how many frames it was in which.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/service/belief_summary.h"

namespace prescene::service {

class FinalStates {
 public:
  void add(const BeliefSummary& summary);
  bool empty() const { return objects_.empty(); }
  /// A table for a person; empty without objects.
  std::string text() const;
  /// [{"name", "state", "confidence", "pose", "frames": {"tracked": n, ...}}]
  nlohmann::ordered_json json() const;

 private:
  struct Object {
    ObjectSummary last;
    std::map<belief::TrackState, int> frames;
  };
  std::vector<Object> objects_;  // in the order of their first frames
};

}  // namespace prescene::service
