// SPDX-License-Identifier: Apache-2.0
#include "recording_answers.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/service/live/query_worker.h"
#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

constexpr std::size_t kMostWaiting = 16;
constexpr std::size_t kMostQueryBytes = std::size_t{512} << 20;
constexpr double kRestSeconds = 1.5;  // for what follows the last simulated instance

std::size_t bytes_of(const belief::Belief& belief) {
  std::size_t bytes = sizeof belief;
  for (const belief::ObjectBelief& object : belief.objects)
    bytes += sizeof object + object.particles.size() * sizeof(belief::Particle);
  return bytes;
}

void bound_seconds(belief::Effort& effort, const RecordingViewOptions& options) {
  if (!effort.exact_instances)
    effort.max_seconds = std::min(effort.max_seconds.value_or(options.question_seconds), options.most_question_seconds);
}

}  // namespace

void KeptBeliefs::add(std::uint64_t index, std::shared_ptr<const belief::Belief> belief) {
  if (index % stride_ != 0) return;
  bytes_ += bytes_of(*belief);
  beliefs_.insert_or_assign(index, std::move(belief));
  while (bytes_ > most_bytes_ && beliefs_.size() > 1) {
    stride_ *= 2;
    for (auto kept = beliefs_.begin(); kept != beliefs_.end();) {
      const bool stays = kept->first % stride_ == 0;
      if (!stays) bytes_ -= bytes_of(*kept->second);
      kept = stays ? std::next(kept) : beliefs_.erase(kept);
    }
    if (stride_ > (std::uint64_t{1} << 40)) break;
  }
}

std::shared_ptr<const belief::Belief> KeptBeliefs::at(std::uint64_t index) const {
  const auto next = beliefs_.upper_bound(index);
  return next == beliefs_.begin() ? nullptr : std::prev(next)->second;
}

RecordingAnswers::RecordingAnswers(const RecordingViewOptions& options, Backends& backends, Send send)
    : options_(options), backends_(backends), send_(std::move(send)), thread_([this] { work(); }) {}

void RecordingAnswers::stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_.request();
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void RecordingAnswers::ask(const PageQuestion& asked, std::string question,
                           std::shared_ptr<const belief::Belief> belief) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() < kMostWaiting) {
      waiting_.push_back({asked, std::move(question), std::move(belief)});
      changed_.notify_one();
      return;
    }
  }
  send_(asked,
        error_answer("", core::unavailable(std::to_string(kMostWaiting) + " " + kQuestionsWait + ": ask again later")));
}

void RecordingAnswers::work() {
  for (;;) {
    Waiting next;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stop_.requested() || !waiting_.empty(); });
      if (stop_.requested()) return;
      next = std::move(waiting_.front());
      waiting_.pop_front();
    }
    try {
      send_(next.asked, answer_to(next));
    } catch (const std::exception& error) {
      send_(next.asked, error_answer("", core::unavailable(std::string("it could not be answered: ") + error.what())));
    }
  }
}

std::string RecordingAnswers::answer_to(const Waiting& waiting) {
  if (!waiting.belief) return error_answer("", core::unavailable("no frame was tracked yet: wait for the first step"));
  auto query = belief::query_from_json(waiting.question);
  if (!query) return error_answer("", query.status());
  if (auto* predict = std::get_if<belief::PredictQuery>(&query->what)) bound_seconds(predict->effort, options_);
  if (auto* stability = std::get_if<belief::StabilityQuery>(&query->what)) bound_seconds(stability->effort, options_);
  queries::QueryContext context = backends_.query_context(backends_.pool());
  const core::Cancellation end(stop_, queries::deadline_after(options_.most_question_seconds + kRestSeconds));
  context.cancellation = context.abandoned = &end;
  context.simulate_until = queries::deadline_after(options_.most_question_seconds);
  context.most_bytes = kMostQueryBytes;
  return belief::json_text(belief::to_json(queries::answer(*waiting.belief, *query, context)));
}

}  // namespace prescene::service
