// SPDX-License-Identifier: Apache-2.0
// Bytes of the messages in messages.h, in the encoding that ROS 2 puts on the wire and into recordings: a four-byte
// header and plain CDR, version 1 (XCDR1), without any DDS library.
//
//   std::vector<std::uint8_t> bytes = encode_cdr(image);
//   PRESCENE_TRY(RosImage image, decode_cdr<RosImage>(bytes));
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/interfaces/ros_messages/messages.h"

namespace prescene::interfaces {

/// What a sender may make us allocate. Every sequence is checked against the bytes that remain as well.
struct CdrLimits {
  std::size_t max_message_bytes = std::size_t{256} << 20;
  std::size_t max_string_bytes = std::size_t{64} << 20;
};

/// For messages that are not images: transforms, camera infos and texts are small, and may take ten times their bytes.
inline constexpr CdrLimits kSmallMessage{std::size_t{4} << 20, std::size_t{4} << 20};

/// Little endian, header 00 01 00 00.
template <class Message>
std::vector<std::uint8_t> encode_cdr(const Message& message);

/// Accepts both byte orders. Fails with kDataLoss when the bytes end too early or a length runs past their end, with
/// kInvalidInput for a wrong header, a string without its final NUL, a bool other than 0 or 1, more than 8 bytes left
/// over or a limit exceeded; the text names the message type, the byte and, for a field, its name.
/// Memory: at most about ten times the size of the bytes.
template <class Message>
core::Result<Message> decode_cdr(std::span<const std::uint8_t> bytes, const CdrLimits& limits = {});

}  // namespace prescene::interfaces
