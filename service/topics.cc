// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/topics.h"

#include <cctype>

namespace prescene::service {

std::string pose_topic(const std::string& object) {
  std::string name = "/prescene/pose/";
  // Object names may hold '-' and '.', and begin with digits; ROS names may not.
  if (object.empty() || std::isdigit(static_cast<unsigned char>(object.front()))) name += '_';
  for (const char c : object) name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

}  // namespace prescene::service
