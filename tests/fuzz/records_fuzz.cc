// SPDX-License-Identifier: Apache-2.0
// Any bytes as one of the JSON records of a recording: of a step, of the truth, of the outcomes that came. Understood,
// or refused with a reason; what is understood can be written down and read again.
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "prescene/core/check.h"
#include "prescene/service/recording/foreseen.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/recording/simulated_recording.h"

namespace {

template <class Read>
void check(const std::string& text, const Read& read) {
  const auto record = read(text);
  if (!record) {
    PRESCENE_CHECK(!record.status().message().empty());
    return;
  }
  using nlohmann::ordered_json;
  const std::string written = to_json(*record).dump(-1, ' ', false, ordered_json::error_handler_t::replace);
  const auto again = read(written);
  PRESCENE_CHECK_MSG(again.ok(), again.status().message());
  // Rotations are normalised anew, which may change their last bit.
  PRESCENE_CHECK(to_json(*again).size() == to_json(*record).size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace prescene::service;
  const std::string text(reinterpret_cast<const char*>(data), size);
  check(text, [](const std::string& json) { return step_record_from_json(json); });
  check(text, [](const std::string& json) { return truth_from_json(json); });
  check(text, [](const std::string& json) { return outcome_record_from_json(json); });
  return 0;
}
