// SPDX-License-Identifier: Apache-2.0
// Any bytes as a control message: understood, or refused with a reason; what is understood can be said again.
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "prescene/belief/json.h"
#include "prescene/core/check.h"
#include "prescene/service/tracking/waiting_controls.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace prescene;
  constexpr core::TimeNs kNow = 1'700'000'000'000'000'000;
  constexpr core::TimeNs kHour = 3'600'000'000'000;
  const auto control = service::parse_control({reinterpret_cast<const char*>(data), size});
  if (!control) {
    PRESCENE_CHECK(!control.status().message().empty());
    return 0;
  }
  PRESCENE_CHECK(!control->stamp_ns || (*control->stamp_ns >= 0 && *control->stamp_ns / 2 <= kNow));
  for (const auto& [after_ns, action] : control->actions) {
    PRESCENE_CHECK(after_ns >= -kHour && after_ns <= kHour);
    belief::Action from_then = action;
    from_then.time = 0.0;
    const nlohmann::ordered_json again = {{"stamp_ns", kNow}, {"actions", {belief::to_json(from_then)}}};
    const auto read =
        service::parse_control(again.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
    PRESCENE_CHECK_MSG(read.ok(), read.status().message());
    PRESCENE_CHECK(read->stamp_ns == kNow && read->actions.size() == 1 && read->actions.front().first == 0);
    PRESCENE_CHECK(read->actions.front().second.what.index() == action.what.index());
  }
  return 0;
}
