// SPDX-License-Identifier: Apache-2.0
// The bytes are lines, each a text that a page or a client of Foxglove's protocol sends to the live view. A page's
// question comes back to it under its own number; a client's subscriptions stay those of channels that there are, and
// what it is sent is JSON.
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "prescene/belief/json.h"
#include "prescene/belief/scene.h"
#include "prescene/core/check.h"
#include "prescene/service/view/foxglove_server.h"
#include "prescene/service/view/question_ids.h"

namespace {

using namespace prescene;  // NOLINT(google-build-using-namespace)

constexpr interfaces::WebClient kClient = 3;

void take_as_page(std::string_view text) {
  const auto request = service::page_request(text);
  if (!request) return;
  PRESCENE_CHECK(request->at("op").is_string());
  if (const auto step = service::step_request(*request))
    PRESCENE_CHECK(step->camera >= 0 && step->camera < static_cast<int>(belief::kMostCameras));
  service::PageQuestion asked{kClient, 0};
  const auto question = service::question_text(asked, *request);
  if (!question) {
    PRESCENE_CHECK(!question.status().message().empty());
    return;
  }
  // An answer begins with the question's id, as the query worker writes it.
  const auto document = belief::parse_json(*question, std::size_t{1} << 20);
  PRESCENE_CHECK_MSG(document.ok(), document.status().message());
  const std::string answer = belief::json_text({{"id", document->at("id")}, {"where", nullptr}});
  const auto asker = service::asker_of(answer);
  PRESCENE_CHECK(asker && asker->client == kClient && asker->number == asked.number);
  static_cast<void>(service::asker_of(text));  // an answer to somebody else, of any form
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  service::FoxgloveServer server({"left", "right"});
  std::size_t sent = 0;
  const service::FoxgloveServer::Send send = [&sent](interfaces::WebClient client, const auto& message) {
    PRESCENE_CHECK(client == kClient && message != nullptr);
    ++sent;
  };
  server.open(kClient, send);
  PRESCENE_CHECK(sent == 2);
  for (std::size_t lines = 0; !rest.empty() && lines < 200; ++lines) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string line(rest.substr(0, end));
    rest.remove_prefix(std::min(rest.size(), end + 1));
    take_as_page(line);
    const std::size_t before = sent;
    server.take(kClient, line, send);
    PRESCENE_CHECK(sent - before <= 1);  // a text never costs more than one in return
  }
  server.close(kClient);
  return 0;
}
