// SPDX-License-Identifier: Apache-2.0
// What a page sends. Its questions travel under ids of ours, so that each answer finds its page.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "prescene/core/status.h"
#include "prescene/interfaces/web/web_server.h"

namespace prescene::service {

/// A longer text of a page is none of its messages.
inline constexpr std::size_t kMostPageRequestBytes = std::size_t{64} << 10;
/// A page's message: an object with a text "op"; nothing for what is none.
std::optional<nlohmann::ordered_json> page_request(std::string_view text);

/// Which step of a recording, and whose picture.
struct StepRequest {
  std::uint64_t index = 0;
  int camera = 0;  ///< Below belief::kMostCameras; 0 where none such is named.
};
/// Of {"op": "show", "index": i, "camera": c}; nothing without an index.
std::optional<StepRequest> step_request(const nlohmann::ordered_json& request);

struct PageQuestion {
  interfaces::WebClient client = 0;
  std::uint64_t number = 0;  ///< The page's own.
};

/// The question of {"op": "ask", "number": n, "question": {...}} with an id that says whose it is.
core::Result<std::string> question_text(PageQuestion& asked, const nlohmann::ordered_json& request);
/// Whose question an answer is to; empty for somebody else's. Looks at its first bytes only: it may be long.
std::optional<PageQuestion> asker_of(std::string_view answer);
/// {"op": "answer", "number", "answer"}, without reading the answer.
interfaces::WebMessagePtr answer_message(const PageQuestion& asked, std::string_view answer);

}  // namespace prescene::service
