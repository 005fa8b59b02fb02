// SPDX-License-Identifier: Apache-2.0
#include "service_calls.h"

#include <algorithm>
#include <exception>
#include <map>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/service/live/query_worker.h"
#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

constexpr const char* kTrigger = "std_srvs/srv/Trigger";
constexpr std::size_t kMostWaiting = 256;
constexpr std::size_t kMostOfOne = 64;  // so that one caller does not have the calls of others given up
constexpr std::size_t kMostSaves = 64;

std::string id_of_call(const interfaces::ServiceRequest& request) {
  return "call-" + std::to_string(request.service) + "-" + std::to_string(request.client) + "-" +
         std::to_string(request.sequence);
}

}  // namespace

core::Status ServiceCalls::offer() {
  using interfaces::ServiceRequest;
  const auto offered = [this](const char* name, const char* type, std::function<void(ServiceRequest &&)> take) {
    return node_.offer_service(name, type, [this, name, take = std::move(take)](ServiceRequest&& request) {
      {
        const std::lock_guard lock(mutex_);
        ++calls_;
      }
      try {
        take(std::move(request));
      } catch (const std::exception& error) {
        core::log(log_, core::LogLevel::kError, std::string(name) + ": a call was left out: " + error.what());
      }
    });
  };
  PRESCENE_RETURN_IF_ERROR(
      offered(kWhereService, kTrigger, [this](ServiceRequest&& request) { ask(request, R"({"where": {}})"); }));
  PRESCENE_RETURN_IF_ERROR(
      offered(kRelationsService, kTrigger, [this](ServiceRequest&& request) { ask(request, R"({"relations": {}})"); }));
  PRESCENE_RETURN_IF_ERROR(offered(kRestartService, kTrigger, [this](ServiceRequest&& request) {
    hooks_.restart();
    reply(request, true, "the belief begins anew with the next frame");
  }));
  PRESCENE_RETURN_IF_ERROR(offered(kSaveService, kTrigger, [this](ServiceRequest&& request) {
    if (!hooks_.keeps_learned) {
      reply(request, false, "nothing is kept: start the service with --learned FILE");
      return;
    }
    {
      const std::lock_guard lock(mutex_);
      if (saves_.size() < kMostSaves) {
        saves_.push_back(std::move(request));
        return;
      }
    }
    reply(request, false, "not saved: too many calls came, call again later");
  }));
  return offered(kAskService, "prescene_msgs/srv/Ask",
                 [this](ServiceRequest&& request) { ask(request, request.text); });
}

void ServiceCalls::ask(const interfaces::ServiceRequest& request, const std::string& question) {
  nlohmann::ordered_json json = parse_or_discard(question);
  if (!json.is_object()) {
    reply(request, false,
          error_answer("", core::invalid_input("a question is a JSON object such as {\"where\": {}}: this is none")));
    return;
  }
  const std::string id = id_of_call(request);
  json["id"] = id;
  std::vector<interfaces::ServiceRequest> dropped;
  {
    const std::lock_guard lock(mutex_);
    waiting_.emplace_back(id, request);
    dropped = give_up_old(request.client);
  }
  for (const interfaces::ServiceRequest& old : dropped)
    reply(old, false,
          error_answer("", core::unavailable("too many calls wait for answers (at most " + std::to_string(kMostOfOne) +
                                             " of one caller and " + std::to_string(kMostWaiting) +
                                             " in all): ask again later")));
  hooks_.ask(belief::json_text(json), "caller " + std::to_string(request.client));
}

std::vector<interfaces::ServiceRequest> ServiceCalls::give_up_old(std::uint64_t client) {
  std::vector<interfaces::ServiceRequest> dropped;
  const auto is_own = [client](const auto& call) { return call.second.client == client; };
  const bool own_are_too_many =
      static_cast<std::size_t>(std::count_if(waiting_.begin(), waiting_.end(), is_own)) > kMostOfOne;
  if (!own_are_too_many && waiting_.size() <= kMostWaiting) return dropped;
  // Where all together are too many, whoever has most gives way.
  std::map<std::uint64_t, std::size_t> calls;
  for (const auto& call : waiting_) ++calls[call.second.client];
  const auto fewer = [](const auto& a, const auto& b) { return a.second < b.second; };
  const std::uint64_t most = std::max_element(calls.begin(), calls.end(), fewer)->first;
  const auto old = std::find_if(waiting_.begin(), waiting_.end(), [&](const auto& call) {
    return call.second.client == (own_are_too_many ? client : most);
  });
  dropped.push_back(old->second);
  waiting_.erase(old);
  ++given_up_;
  return dropped;
}

void ServiceCalls::note_answer(const std::string& answer_json) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.empty()) return;
  }
  nlohmann::ordered_json answer = parse_or_discard(answer_json);
  const std::string id = id_of_document(answer);
  interfaces::ServiceRequest request;
  {
    const std::lock_guard lock(mutex_);
    const auto called =
        std::find_if(waiting_.begin(), waiting_.end(), [&](const auto& call) { return call.first == id; });
    if (called == waiting_.end()) return;
    request = called->second;
    waiting_.erase(called);
  }
  answer.erase("id");  // of our own making
  reply(request, !answer.contains("error"), belief::json_text(answer));
}

std::vector<interfaces::ServiceRequest> ServiceCalls::take_saves() {
  const std::lock_guard lock(mutex_);
  return std::exchange(saves_, {});
}

void ServiceCalls::reply(const interfaces::ServiceRequest& request, bool success, const std::string& text) {
  const core::Status sent = node_.reply(request, success, text);
  if (!sent.ok()) core::log(log_, core::LogLevel::kWarning, sent.message());
}

std::uint64_t ServiceCalls::calls() const {
  const std::lock_guard lock(mutex_);
  return calls_;
}

std::uint64_t ServiceCalls::given_up() const {
  const std::lock_guard lock(mutex_);
  return given_up_;
}

}  // namespace prescene::service
