// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bags/other_encodings.h"

#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {

bool OtherEncodings::note(const std::string& topic, const std::string& encoding) {
  constexpr std::size_t kMostNamed = 10;
  constexpr std::size_t kShownOfTopic = 256, kShownOfEncoding = 40;  // characters; ROS allows 255 for a topic
  if (encoding == "cdr") return false;
  ++messages_;
  if (has_more_) return true;
  const std::string name = quote(topic, kShownOfTopic) + " (" + quote(encoding, kShownOfEncoding) + ")";
  if (named_.contains(name)) return true;
  if (named_.size() < kMostNamed)
    named_.insert(name);
  else
    has_more_ = true;
  return true;
}

std::string OtherEncodings::text() const {
  if (messages_ == 0) return "";
  std::string names;
  for (const std::string& name : named_) names += (names.empty() ? "" : ", ") + name;
  return std::to_string(messages_) + " messages that are not in CDR were left out: " + names +
         (has_more_ ? " and others" : "");
}

}  // namespace prescene::interfaces
