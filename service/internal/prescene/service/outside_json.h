// SPDX-License-Identifier: Apache-2.0
// JSON that others sent: over the bus, in a recording, on the command line.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace prescene::service {

/// Bytes above all that is sent: the images of a view of 4 million pixels are 54 MB.
inline constexpr std::size_t kMostJsonBytes = std::size_t{256} << 20;

/// The document; discarded (is_discarded()) where it is no JSON, longer than `most_bytes` or nested too deep to be
/// copied.
nlohmann::ordered_json parse_or_discard(std::string_view text, std::size_t most_bytes = kMostJsonBytes);
/// A time in ns since 1970. Below half of what core::TimeNs holds, so that neither it nor a sum of two wraps.
bool is_stamp(const nlohmann::ordered_json& value);
/// The "id" of a question or an answer; empty where there is none, or a very long one.
std::string id_of_document(const nlohmann::ordered_json& document);
std::string id_of(std::string_view text);
/// Whether it is what is known so far of an answer that follows (docs/reference/queries.md).
bool is_so_far(const nlohmann::ordered_json& answer);
bool text_is_so_far(std::string_view answer_text);

}  // namespace prescene::service
