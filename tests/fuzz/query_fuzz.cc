// SPDX-License-Identifier: Apache-2.0
// Any bytes as a question, as it comes over the bus: understood, or refused with a reason; what is understood can be
// written down and read again.
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>

#include "prescene/belief/json.h"
#include "prescene/core/check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace prescene;
  const auto query = belief::query_from_json({reinterpret_cast<const char*>(data), size});
  if (!query) {
    PRESCENE_CHECK(!query.status().message().empty());
    return 0;
  }
  const auto again = belief::query_from_json(belief::to_json(*query).dump());
  PRESCENE_CHECK_MSG(again.ok(), again.status().message());
  PRESCENE_CHECK(again->id == query->id && again->what.index() == query->what.index());
  return 0;
}
