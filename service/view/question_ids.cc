// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/question_ids.h"

#include <charconv>
#include <nlohmann/json.hpp>

#include "json_fields.h"
#include "prescene/belief/json.h"
#include "prescene/belief/scene.h"
#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

constexpr std::string_view kIdPrefix = "view-";

}  // namespace

std::optional<nlohmann::ordered_json> page_request(std::string_view text) {
  nlohmann::ordered_json request = parse_or_discard(text, kMostPageRequestBytes);
  if (!request.is_object() || !request.contains("op") || !request["op"].is_string()) return std::nullopt;
  return request;
}

std::optional<StepRequest> step_request(const nlohmann::ordered_json& request) {
  const auto index = request.find("index");
  if (index == request.end() || !index->is_number_unsigned()) return std::nullopt;
  StepRequest asked{index->get<std::uint64_t>()};
  const auto camera = request.find("camera");
  if (camera != request.end() && camera->is_number_unsigned() && camera->get<std::uint64_t>() < belief::kMostCameras)
    asked.camera = static_cast<int>(camera->get<std::uint64_t>());
  return asked;
}

core::Result<std::string> question_text(PageQuestion& asked, const nlohmann::ordered_json& request) {
  const auto number = request.find("number");
  const auto question = request.find("question");
  if (number == request.end() || !number->is_number_unsigned() || question == request.end() || !question->is_object())
    return core::invalid_input("ask: not {\"number\": n, \"question\": {...}}");
  asked.number = number->get<std::uint64_t>();
  nlohmann::ordered_json with_id =
      JsonFields()
          .text("id", std::string(kIdPrefix) + std::to_string(asked.client) + "-" + std::to_string(asked.number))
          .take();
  for (const auto& [key, value] : question->items())
    if (key != "id") with_id[key] = value;
  return belief::json_text(with_id);
}

std::optional<PageQuestion> asker_of(std::string_view answer) {
  constexpr std::string_view kBegin = R"({"id":")";
  if (!answer.starts_with(kBegin)) return std::nullopt;
  answer.remove_prefix(kBegin.size());
  if (!answer.starts_with(kIdPrefix)) return std::nullopt;
  answer.remove_prefix(kIdPrefix.size());
  PageQuestion asked;
  const char* end = answer.data() + std::min<std::size_t>(answer.size(), 64);
  const auto client = std::from_chars(answer.data(), end, asked.client);
  if (client.ec != std::errc() || client.ptr == end || *client.ptr != '-') return std::nullopt;
  const auto number = std::from_chars(client.ptr + 1, end, asked.number);
  if (number.ec != std::errc() || number.ptr == end || *number.ptr != '"') return std::nullopt;
  return asked;
}

interfaces::WebMessagePtr answer_message(const PageQuestion& asked, std::string_view answer) {
  std::string text = R"({"op":"answer","number":)" + std::to_string(asked.number) + R"(,"answer":)";
  text.append(answer);
  text += '}';
  return interfaces::make_web_message(interfaces::WebSocketKind::kText, text, interfaces::WebDelivery::kEach);
}

}  // namespace prescene::service
