// SPDX-License-Identifier: Apache-2.0
// A writer of any bytes in place of a message, as a broken or hostile peer sends them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace prescene::tests {

class RawWriter {
 public:
  static constexpr std::size_t kBytes = 512;  ///< Of each message, behind the four that say the order of bytes.

  /// `topic` and `type` as DDS names them: "rt/tf", "tf2_msgs::msg::dds_::TFMessage_".
  RawWriter(int domain, const std::string& topic, const std::string& type);
  ~RawWriter();
  RawWriter(const RawWriter&) = delete;
  RawWriter& operator=(const RawWriter&) = delete;

  /// Whether a reader is found within half a minute.
  bool wait_for_reader();
  /// The first kBytes of the bytes, with zeros behind those that are fewer. What becomes of them nobody says.
  void write(std::span<const std::uint8_t> bytes);

 private:
  std::string type_;
  int participant_ = 0, writer_ = 0, waitset_ = 0;
};

}  // namespace prescene::tests
