// SPDX-License-Identifier: Apache-2.0
// Counts what of a recording is not in CDR, as messages of ROS 1, protobuf or JSON of other programs are, and says so
// in one sentence.
//
//   OtherEncodings others;
//   if (others.note("/status", "json")) ...   // leave the message out
//   const std::string said = others.text();   // "1 messages that are not in CDR were left out: '/status' ('json')"
#pragma once

#include <cstdint>
#include <set>
#include <string>

namespace prescene::interfaces {

/// Not thread-safe.
class OtherEncodings {
 public:
  /// Whether a message of this topic and encoding is not in CDR; then it counts.
  bool note(const std::string& topic, const std::string& encoding);
  /// A sentence that names the first ten topics with their encodings; empty = all was in CDR.
  std::string text() const;

 private:
  std::uint64_t messages_ = 0;
  std::set<std::string> named_;
  bool has_more_ = false;
};

}  // namespace prescene::interfaces
