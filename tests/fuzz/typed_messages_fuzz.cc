// SPDX-License-Identifier: Apache-2.0
// Any bytes as a question or a request to cancel in the form of a message, up to the JSON that the service reads, and
// as an answer in JSON up to the message that is made of it.
#include <cstddef>
#include <cstdint>
#include <string>

#include "prescene/belief/json.h"
#include "prescene/core/check.h"
#include "prescene/core/utf8.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/live/typed_messages.h"

namespace {

using namespace prescene;  // NOLINT(google-build-using-namespace)

void check_text(const core::Result<std::string>& json) {
  if (!json)
    PRESCENE_CHECK(!json.status().message().empty());
  else
    PRESCENE_CHECK(core::is_utf8(*json));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const interfaces::CdrLimits limits{.max_string_bytes = 1 << 16};
  if (const auto query = interfaces::decode_cdr<interfaces::RosQuery>({data, size}, limits)) {
    const auto json = service::question_json(*query);
    check_text(json);
    if (json) static_cast<void>(belief::query_from_json(*json));
  }
  if (const auto cancel = interfaces::decode_cdr<interfaces::RosCancel>({data, size}, limits))
    check_text(service::cancel_json(*cancel));
  const std::string text(reinterpret_cast<const char*>(data), size);
  const interfaces::RosAnswer answer = service::answer_message(text);
  PRESCENE_CHECK(answer.json == text);
  const auto again = interfaces::decode_cdr<interfaces::RosAnswer>(interfaces::encode_cdr(answer));
  PRESCENE_CHECK(again.ok());
  static_cast<void>(service::progress_message(text));
  return 0;
}
