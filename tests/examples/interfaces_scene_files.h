// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/scene_files take for granted.
#pragma once

#include <string>

#include "prescene/interfaces/scene_files/binder.h"
#include "prescene/interfaces/scene_files/learned_file.h"
#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::interfaces::given_interfaces_scene_files {

namespace binder_h {
struct FilterSettings {};
struct Settings {
  int frames_unseen_max;
  std::string camera_topic;
  FilterSettings filter;
};
extern const LocatedValue document;
extern Settings settings;
void bind(const LocatedValue& value, Problems& problems, FilterSettings& settings);
}  // namespace binder_h

namespace learned_file_h {
extern const std::string text;
extern const belief::Scene scene;
extern const belief::Belief belief;
}  // namespace learned_file_h

namespace robot_description_h {
extern const std::string text;
}

namespace scene_file_h {
extern const MeshReader read_mesh;
}

}  // namespace prescene::interfaces::given_interfaces_scene_files
