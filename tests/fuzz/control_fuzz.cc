// SPDX-License-Identifier: Apache-2.0
// Any bytes as a control message: understood, or refused with a reason; what is understood can be said again.
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "prescene/belief/json.h"
#include "prescene/core/check.h"
#include "prescene/service/tracker.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace prescene;
  constexpr core::TimeNs kNow = 1'700'000'000'000'000'000;
  constexpr core::TimeNs kHour = 3'600'000'000'000;
  const auto actions = service::parse_control({reinterpret_cast<const char*>(data), size}, kNow);
  if (!actions) {
    PRESCENE_CHECK(!actions.status().message().empty());
    return 0;
  }
  for (const auto& [time_ns, action] : *actions) {
    PRESCENE_CHECK(time_ns >= -kHour && time_ns / 2 <= kNow);
    belief::Action from_then = action;
    from_then.time = 0.0;
    const nlohmann::ordered_json again = {{"stamp_ns", kNow}, {"actions", {belief::to_json(from_then)}}};
    const auto read =
        service::parse_control(again.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace), kNow);
    PRESCENE_CHECK_MSG(read.ok(), read.status().message());
    PRESCENE_CHECK(read->size() == 1 && read->front().first == kNow);
    PRESCENE_CHECK(read->front().second.what.index() == action.what.index());
  }
  return 0;
}
