// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/topics.h"

#include <cctype>
#include <map>
#include <utility>

#include "prescene/core/utf8.h"

namespace prescene::service {

core::Status validate(const InputTopics& topics) {
  const std::pair<const char*, const std::string*> named[] = {{"depth", &topics.depth},
                                                              {"color", &topics.color},
                                                              {"camera info", &topics.camera_info},
                                                              {"tf", &topics.tf},
                                                              {"static tf", &topics.tf_static}};
  std::map<std::string, const char*> seen;
  for (const auto& [what, topic] : named) {
    if (!core::is_utf8(*topic))
      return core::invalid_input(std::string("the ") + what +
                                 " topic's name is not UTF-8: give one of letters, digits, _ and /");
    if (topic->empty()) {
      if (topic == &topics.color) continue;
      return core::invalid_input(std::string("the ") + what + " topic has no name: only colour can be left out");
    }
    const auto [other, is_new] = seen.emplace(*topic, what);
    if (!is_new)
      return core::invalid_input(std::string("the ") + what + " topic is the " + other->second + " topic, " + *topic +
                                 ": name the two that the camera has");
  }
  return core::ok_status();
}

std::string pose_topic(const std::string& object) {
  std::string name = "/prescene/pose/";
  // Object names may hold '-' and '.', and begin with digits; ROS names may not.
  if (object.empty() || std::isdigit(static_cast<unsigned char>(object.front()))) name += '_';
  for (const char c : object) name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

}  // namespace prescene::service
