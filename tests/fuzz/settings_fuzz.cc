// SPDX-License-Identifier: Apache-2.0
// Any bytes as the settings that a recording holds, and as those that were set while it was made: understood, or
// refused with a reason; what is understood can be written down and read again.
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "prescene/core/check.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/tracker_settings.h"

namespace {

void check_running(const std::string& text) {
  using namespace prescene::service;
  const auto running = with_running({}, text);
  if (!running) {
    PRESCENE_CHECK(!running.status().message().empty());
    return;
  }
  const auto again = with_running({}, running_settings_text(*running));
  PRESCENE_CHECK_MSG(again.ok(), again.status().message());
  PRESCENE_CHECK(running_settings_text(*again) == running_settings_text(*running));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace prescene::service;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  check_running(std::string(text));
  const auto settings = with_recorded({}, parse_or_discard(text));
  if (!settings) {
    PRESCENE_CHECK(!settings.status().message().empty());
    return 0;
  }
  const auto again = with_recorded({}, to_json(*settings));
  PRESCENE_CHECK_MSG(again.ok(), again.status().message());
  PRESCENE_CHECK(again->topics == settings->topics && to_json(*again).size() == to_json(*settings).size());
  return 0;
}
