// SPDX-License-Identifier: Apache-2.0
// Questions from a page travel under ids of ours, so that each answer finds its page.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "prescene/core/status.h"
#include "prescene/interfaces/web/web_server.h"

namespace prescene::service {

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
