// SPDX-License-Identifier: Apache-2.0
// Any bytes as a request to a service of ROS 2, with rmw's header before its fields: of each form, and of each service
// of parameters, whose table answers it. A parameter that was set is allowed; one that was refused stays as it was.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "prescene/core/check.h"
#include "prescene/core/utf8.h"
#include "prescene/interfaces/dds/service_request.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/live/node_parameters.h"

namespace {

using namespace prescene;              // NOLINT(google-build-using-namespace)
using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)
using service::NodeParameter;
using service::ParameterTable;

/// One of each kind.
ParameterTable table() {
  const auto apply = [](const service::ParameterValue& /*value*/) {};
  std::vector<NodeParameter> parameters = {
      {"a.number", "A number.", 0.5, apply, std::pair(0.0, 1.0)},
      {"a.whole", "A whole number.", std::int64_t{5}, apply, std::pair(0.0, 10.0)},
      {"truth", "Yes or no.", true, apply},
      {"word", "One of some.", std::string("info"), apply, std::nullopt, {"info", "error"}},
      {"text", "Any text.", std::string("x"), apply},
      {"row", "Numbers.", std::vector<double>{1.0}, apply},
      {"fixed", "Stays.", std::string("f")}};
  return ParameterTable(std::move(parameters));
}

void check_allowed(const ParameterTable& table) {
  const double number = std::get<double>(*table.value("a.number"));
  const std::int64_t whole = std::get<std::int64_t>(*table.value("a.whole"));
  const std::string word = std::get<std::string>(*table.value("word"));
  PRESCENE_CHECK(number >= 0.0 && number <= 1.0 && whole >= 0 && whole <= 10);
  PRESCENE_CHECK(word == "info" || word == "error");
  PRESCENE_CHECK(std::get<std::string>(*table.value("fixed")) == "f");
}

/// As it goes back to whoever asked.
template <class Response>
void check_sent(const Response& response) {
  const auto read = decode_cdr<Response>(encode_cdr(response));
  PRESCENE_CHECK_MSG(read.ok(), read.status().message());
}

std::size_t most_served(std::size_t names) { return names > service::kMostNamesAsked ? 0 : names; }

void serve(const RosListParametersRequest& asked) {
  const auto result = table().list(asked.prefixes, asked.depth);
  PRESCENE_CHECK(result.names.size() <= 7);
  check_sent(RosListParametersResponse{result});
}
void serve(const RosGetParametersRequest& asked) {
  const auto values = table().get(asked.names);
  PRESCENE_CHECK(values.size() == most_served(asked.names.size()));
  check_sent(RosGetParametersResponse{values});
}
void serve(const RosGetParameterTypesRequest& asked) {
  const auto types = table().types(asked.names);
  PRESCENE_CHECK(types.size() == most_served(asked.names.size()));
  check_sent(RosGetParameterTypesResponse{types});
}
void serve(const RosDescribeParametersRequest& asked) {
  const auto descriptors = table().describe(asked.names);
  PRESCENE_CHECK(descriptors.size() == most_served(asked.names.size()));
  for (const auto& descriptor : descriptors) PRESCENE_CHECK(core::is_utf8(descriptor.name));
  check_sent(RosDescribeParametersResponse{descriptors});
}
void serve(const RosSetParametersRequest& asked) {
  ParameterTable known = table();
  const auto results = known.set(asked.parameters);
  PRESCENE_CHECK(results.size() == most_served(asked.parameters.size()));
  for (const auto& result : results)
    PRESCENE_CHECK(result.successful == result.reason.empty() && core::is_utf8(result.reason));
  check_allowed(known);
  check_sent(RosSetParametersResponse{results});
}
void serve(const RosSetParametersAtomicallyRequest& asked) {
  ParameterTable known = table();
  const auto result = known.set_all(asked.parameters);
  PRESCENE_CHECK(result.successful == result.reason.empty() && core::is_utf8(result.reason));
  const std::vector<std::string> names = {"a.number", "a.whole", "truth", "word", "text", "row", "fixed"};
  if (!result.successful) PRESCENE_CHECK(known.get(names) == table().get(names));
  check_allowed(known);
  check_sent(RosSetParametersAtomicallyResponse{result});
}

template <class Request>
void ask(const ServiceRequest& request) {
  const auto asked = decode_cdr<Request>(request.fields, kSmallMessage);
  if (asked)
    serve(*asked);
  else
    PRESCENE_CHECK(!asked.status().message().empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span cdr(data + 1, size - 1);
  const auto trigger = parse_request(cdr, ServiceForm::kEmpty);
  const auto text = parse_request(cdr, ServiceForm::kText);
  const auto fields = parse_request(cdr, ServiceForm::kFields);
  // Whose request it is does not depend on its fields.
  PRESCENE_CHECK(trigger.has_value() == fields.has_value() && (!text || trigger));
  if (!fields) return 0;
  PRESCENE_CHECK(trigger->client == fields->client && trigger->sequence == fields->sequence);
  PRESCENE_CHECK(!text || text->client == fields->client);
  switch (data[0] % 6) {
    case 0:
      ask<RosListParametersRequest>(*fields);
      break;
    case 1:
      ask<RosGetParametersRequest>(*fields);
      break;
    case 2:
      ask<RosGetParameterTypesRequest>(*fields);
      break;
    case 3:
      ask<RosDescribeParametersRequest>(*fields);
      break;
    case 4:
      ask<RosSetParametersRequest>(*fields);
      break;
    default:
      ask<RosSetParametersAtomicallyRequest>(*fields);
  }
  return 0;
}
