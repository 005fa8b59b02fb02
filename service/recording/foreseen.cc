// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/foreseen.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>
#include <variant>

#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using nlohmann::ordered_json;

// A release from about the same pose answers the question although it came later: what tracking errs by.
constexpr double kSamePlace = 0.02;                         // m
constexpr double kSameTurn = 5.0 * std::numbers::pi / 180;  // rad
constexpr std::size_t kMostReleases = 1000;

bool needs_contacts(const belief::Condition& condition) {
  return std::holds_alternative<belief::RestingOn>(condition.predicate) ||
         std::holds_alternative<belief::Touched>(condition.predicate);
}

/// Judges outcomes by a trajectory, of which contacts may not be known.
class Judge {
 public:
  Judge(const belief::Scene& scene, bool knows_contacts) : scene_(scene), knows_contacts_(knows_contacts) {}

  std::optional<bool> came(const belief::Trajectory& trajectory, const belief::Outcome& outcome) const {
    belief::Outcome seen = outcome;
    if (!knows_contacts_) {
      std::erase_if(seen.all_of, needs_contacts);
      std::erase_if(seen.any_of, needs_contacts);
    }
    bool known = seen.all_of.size() == outcome.all_of.size();
    // One of those that can be judged is enough; if none of them holds, one of the others may.
    if (seen.any_of.size() < outcome.any_of.size() &&
        (seen.any_of.empty() || !belief::holds(scene_, trajectory, {outcome.name, outcome.object, {}, seen.any_of}))) {
      seen.any_of.clear();
      known = false;
    }
    if (!belief::holds(scene_, trajectory, seen)) return false;
    if (!known) return std::nullopt;
    return true;
  }

  /// Of exclusive outcomes, the one that came; its name is empty where that can't be judged.
  CameOutcome came(const belief::Trajectory& trajectory, const belief::ExclusiveOutcomes& group) const {
    for (const belief::Outcome& outcome : group.outcomes) {
      const std::optional<bool> is = came(trajectory, outcome);
      if (!is) return {"", group.name, std::nullopt, 0};
      if (*is) return {outcome.name, group.name, true, 0};
    }
    return {"other", group.name, true, 0};
  }

  std::vector<CameOutcome> all(const belief::Trajectory& trajectory) const {
    std::vector<CameOutcome> result;
    for (const belief::ExclusiveOutcomes& group : scene_.exclusive_outcomes) result.push_back(came(trajectory, group));
    for (const belief::Outcome& outcome : scene_.outcomes) {
      result.push_back({outcome.name, "", came(trajectory, outcome), 0});
    }
    return result;
  }

 private:
  const belief::Scene& scene_;
  bool knows_contacts_;
};

OutcomeRecord judged(const Judge& judge, belief::Trajectory trajectory, core::TimeNs start_ns) {
  const auto stamp = [&] { return start_ns + core::ns_of(trajectory.final().time); };
  OutcomeRecord record;
  record.end_ns = stamp();
  record.outcomes = judge.all(trajectory);
  std::vector<bool> open;
  for (CameOutcome& outcome : record.outcomes) {
    outcome.since_ns = record.end_ns;
    open.push_back(outcome.came.value_or(false));
  }
  // Backwards, for as long as the end looks as it does.
  while (trajectory.states.size() > 1 && std::find(open.begin(), open.end(), true) != open.end()) {
    trajectory.states.pop_back();
    const double time = trajectory.final().time;
    std::erase_if(trajectory.contacts, [time](const auto& contact) { return contact.begin > time; });
    const std::vector<CameOutcome> before = judge.all(trajectory);
    for (std::size_t i = 0; i < open.size(); ++i) {
      open[i] = open[i] && before[i].came.value_or(false) && before[i].name == record.outcomes[i].name;
      if (open[i]) record.outcomes[i].since_ns = stamp();
    }
  }
  return record;
}

}  // namespace

OutcomeRecord outcomes_of(const belief::Scene& scene, const belief::Trajectory& trajectory, core::TimeNs start_ns) {
  return judged(Judge(scene, true), trajectory, start_ns);
}

OutcomeRecord outcomes_of(const belief::Scene& scene, const std::map<core::TimeNs, BeliefSummary>& summaries) {
  if (summaries.empty()) return {};
  const core::TimeNs start_ns = summaries.begin()->first;
  belief::Trajectory trajectory;
  bool all_there = false;
  for (const auto& [stamp_ns, summary] : summaries) {
    belief::WorldState state;
    state.time = core::seconds_of(stamp_ns - start_ns);
    for (const belief::SceneObject& named : scene.objects) {
      const auto object = std::find_if(summary.objects.begin(), summary.objects.end(), [&](const ObjectSummary& o) {
        return o.name == named.name && o.state != belief::TrackState::kLost;
      });
      if (object == summary.objects.end()) break;
      state.objects.push_back({object->X_WO, object->V_WO, belief::MotionMode::kMoving, {}});
    }
    all_there = state.objects.size() == scene.objects.size();
    if (all_there) trajectory.states.push_back(std::move(state));
  }
  if (!all_there) {
    OutcomeRecord unknown{summaries.rbegin()->first, {}};
    for (const auto& group : scene.exclusive_outcomes) unknown.outcomes.push_back({"", group.name, std::nullopt, 0});
    for (const auto& outcome : scene.outcomes) unknown.outcomes.push_back({outcome.name, "", std::nullopt, 0});
    return unknown;
  }
  return judged(Judge(scene, false), std::move(trajectory), start_ns);
}

ordered_json to_json(const OutcomeRecord& record) {
  ordered_json outcomes = ordered_json::array();
  for (const CameOutcome& outcome : record.outcomes) {
    ordered_json json = {{"name", outcome.name}, {"group", outcome.group}, {"came", nullptr}};
    if (outcome.came) json["came"] = *outcome.came;
    if (outcome.came.value_or(false)) json["since_ns"] = outcome.since_ns;
    outcomes.push_back(std::move(json));
  }
  return {{"end_ns", record.end_ns}, {"outcomes", outcomes}};
}

core::Result<OutcomeRecord> outcome_record_from_json(const std::string& text) {
  const core::Status bad = core::data_loss("the record of outcomes of the recording is damaged");
  const ordered_json json = parse_or_discard(text, kMostParsedJsonBytes);
  if (!json.is_object() || !json.contains("end_ns") || !is_stamp(json["end_ns"]) || !json.contains("outcomes") ||
      !json["outcomes"].is_array())
    return bad;
  OutcomeRecord record;
  record.end_ns = json["end_ns"].get<core::TimeNs>();
  for (const ordered_json& item : json["outcomes"]) {
    const auto is = [&](const char* key, bool (ordered_json::*kind)() const noexcept) {
      return item.is_object() && item.contains(key) && (item[key].*kind)();
    };
    if (!is("name", &ordered_json::is_string) || !is("group", &ordered_json::is_string)) return bad;
    CameOutcome outcome{item["name"].get<std::string>(), item["group"].get<std::string>(), std::nullopt, 0};
    if (is("came", &ordered_json::is_boolean)) outcome.came = item["came"].get<bool>();
    if (is("since_ns", &ordered_json::is_number_unsigned) && is_stamp(item["since_ns"]))
      outcome.since_ns = item["since_ns"].get<core::TimeNs>();
    record.outcomes.push_back(std::move(outcome));
  }
  return record;
}

bool is_worth_a_row(const Comparison::Row& row) { return row.probability >= 0.005 || row.came.value_or(false); }

std::string foreseen_text(const Comparison::Row& row) {
  const auto percent = [](double share) { return fixed_text(100.0 * share, 0); };
  return percent(row.probability) + " % (" + percent(row.low) + " to " + percent(row.high) + " %)";
}

std::string came_text(const Comparison::Row& row) {
  if (!row.came) return "not known";
  return *row.came ? "yes, from " + fixed_text(row.since, 2) + " s on" : "no";
}

void ForeseenAndCame::add(const RecordedEntry& entry) {
  if (!first_ns_) first_ns_ = entry.message.received_ns;
  if (entry.is_json) {
    if (entry.message.topic != kOutcomeTopic) return;
    auto record = outcome_record_from_json({entry.message.cdr.begin(), entry.message.cdr.end()});
    if (record)
      truth_ = *std::move(record);
    else if (damaged_records_++ == 0)
      first_damage_ = record.status();
    return;
  }
  if (entry.message.topic == depth_topic_) return add_frame(entry.message);
  if (entry.message.topic != kControlTopic) return;
  // What makes no sense was refused by the tracker, too, which said so.
  static_cast<void>(controls_.take_in(
      entry.message, frames_.empty() ? std::nullopt : std::optional<core::TimeNs>(frames_.back().stamp_ns)));
}

void ForeseenAndCame::add_frame(const interfaces::ReceivedMessage& message) {
  // An image begins with its stamp, behind the four bytes that every message begins with; so does a clock, which is
  // nothing but that.
  constexpr std::size_t kBytesToStamp = 12;
  if (message.cdr.size() < kBytesToStamp) return;
  const auto stamp = interfaces::decode_cdr<interfaces::RosClock>({message.cdr.data(), kBytesToStamp});
  if (!stamp) return;
  const auto stamp_ns = interfaces::to_stamp_ns(stamp->clock);
  if (!stamp_ns) return;
  const bool went_back = !frames_.empty() && *stamp_ns < frames_.back().stamp_ns;
  if (went_back) controls_.begin_again();
  if (went_back || frames_.empty()) controls_.begin_at(*stamp_ns);
  frames_.push_back({message.received_ns, *stamp_ns});
  for (const auto& [time_ns, action] : controls_.all())
    if (time_ns <= *stamp_ns) note_release(time_ns, action, released_);
  controls_.forget_due(*stamp_ns);
}

void ForeseenAndCame::note_release(core::TimeNs time_ns, const belief::Action& action,
                                   std::vector<Released>& releases) {
  const auto* release = std::get_if<belief::Release>(&action.what);
  if (release != nullptr && releases.size() < kMostReleases) releases.push_back({release->object, time_ns});
}

std::vector<ForeseenAndCame::Released> ForeseenAndCame::releases() const {
  std::vector<Released> all = released_;
  for (const auto& [time_ns, action] : controls_.all()) note_release(time_ns, action, all);
  return all;
}

void ForeseenAndCame::add(double at, const std::string& question, const std::string& answer) {
  asked_.push_back({at, question, answer});
}

core::TimeNs ForeseenAndCame::stamp_at(double at) const {
  const core::TimeNs received_ns = first_ns_.value_or(0) + core::ns_of(at);
  if (frames_.empty()) return received_ns;
  const auto later = std::upper_bound(frames_.begin(), frames_.end(), received_ns,
                                      [](core::TimeNs time_ns, const Frame& f) { return time_ns < f.received_ns; });
  const Frame& frame = later == frames_.begin() ? *later : *std::prev(later);
  if (std::abs(frame.received_ns - frame.stamp_ns) <= kSameClockNs) return received_ns;
  // How fast the robot's clock goes is not known: the newest frame is what could be asked about.
  return std::min(frame.stamp_ns, frame.stamp_ns + received_ns - frame.received_ns);
}

double ForeseenAndCame::seconds(core::TimeNs stamp_ns) const {
  core::TimeNs received_ns = stamp_ns;
  const auto nearest = std::min_element(frames_.begin(), frames_.end(), [&](const Frame& a, const Frame& b) {
    return std::abs(a.stamp_ns - stamp_ns) < std::abs(b.stamp_ns - stamp_ns);
  });
  if (nearest != frames_.end() && std::abs(nearest->received_ns - nearest->stamp_ns) > kSameClockNs)
    received_ns = nearest->received_ns + (stamp_ns - nearest->stamp_ns);
  return core::seconds_of(received_ns -
                          first_ns_.value_or(summaries_.empty() ? received_ns : summaries_.begin()->first));
}

const ObjectSummary* ForeseenAndCame::object_at(const std::string& name, core::TimeNs time_ns) const {
  auto later = summaries_.upper_bound(time_ns);
  if (later == summaries_.begin()) return nullptr;
  const std::vector<ObjectSummary>& objects = std::prev(later)->second.objects;
  const auto found = std::find_if(objects.begin(), objects.end(), [&](const auto& o) { return o.name == name; });
  return found == objects.end() || found->state == belief::TrackState::kLost ? nullptr : &*found;
}

void ForeseenAndCame::relate(const Asked& asked, std::uint64_t step, Comparison* comparison) const {
  const auto query = belief::query_from_json(asked.question);
  const auto* predict = query ? std::get_if<belief::PredictQuery>(&query->what) : nullptr;
  const std::vector<belief::Action> actions = predict != nullptr ? predict->actions : std::vector<belief::Action>{};
  const auto* release = actions.size() == 1 ? std::get_if<belief::Release>(&actions.front().what) : nullptr;
  if (release == nullptr) {
    std::string done;
    for (const belief::Action& action : actions) {
      done += (done.empty() ? "" : ", ") + belief::kind_of(action) + " " + belief::object_of(action);
    }
    comparison->question = done.empty() ? "What happens if nothing is done?" : "What if: " + done + "?";
    comparison->note = "Whether the robot did just that is not judged.";
    return;
  }
  // Times of a question count from the belief that it was answered from.
  const auto from =
      std::find_if(summaries_.begin(), summaries_.end(), [&](const auto& entry) { return entry.second.step == step; });
  const core::TimeNs asked_ns = stamp_at(asked.at);
  const core::TimeNs meant_ns = (from != summaries_.end() ? from->first : asked_ns) + core::ns_of(actions.front().time);
  const std::string& name = release->object;
  comparison->question = "What if " + name + " is let go at " + fixed_text(seconds(meant_ns), 2) + " s?";
  const std::vector<Released> released = releases();
  const auto real = std::find_if(released.begin(), released.end(),
                                 [&](const Released& r) { return r.object == name && r.time_ns >= asked_ns; });
  if (real == released.end()) {
    comparison->note = "The robot did not let " + name + " go after that: what came says nothing about this answer.";
    return;
  }
  const double later = core::seconds_of(real->time_ns - meant_ns);
  comparison->note = "The robot let " + name + " go at " + fixed_text(seconds(real->time_ns), 2) + " s, " +
                     fixed_text(std::abs(later), 2) + " s " + (later < 0.0 ? "earlier" : "later");
  const ObjectSummary* meant = object_at(name, meant_ns);
  const ObjectSummary* then = object_at(name, real->time_ns);
  if (meant == nullptr || then == nullptr) {
    comparison->note += "; where it was is not known, so that the two can't be compared.";
    return;
  }
  const double moved = (then->X_WO.translation - meant->X_WO.translation).norm();
  const double turned = geometry::angle_between(then->X_WO.rotation, meant->X_WO.rotation);
  comparison->comparable = moved <= kSamePlace && turned <= kSameTurn;
  comparison->note += comparison->comparable
                          ? " and from the same place: what happened can be compared with this answer."
                          : ", when it was " + fixed_text(100.0 * moved, 0) + " cm further and turned by " +
                                fixed_text(turned * 180.0 / std::numbers::pi, 0) +
                                " degrees: this answer was about letting go at another time and place, and what came "
                                "does not test it.";
}

Comparison ForeseenAndCame::compared(const Asked& asked, const OutcomeRecord& came) const {
  const ordered_json answer = parse_or_discard(asked.answer);
  Comparison comparison;
  comparison.at = asked.at;
  if (!answer.is_object() || !answer.contains("predict")) return comparison;
  for (const ordered_json& outcome : answer["predict"].value("outcomes", ordered_json::array())) {
    Comparison::Row row;
    row.outcome = outcome.value("name", "");
    row.group = outcome.value("group", "");
    row.probability = outcome.value("probability", 0.0);
    const auto limits = outcome.value("interval", std::vector<double>{0.0, 1.0});
    row.low = limits.at(0);
    row.high = limits.at(1);
    const auto found = std::find_if(came.outcomes.begin(), came.outcomes.end(), [&](const CameOutcome& c) {
      return c.group == row.group && (!row.group.empty() || c.name == row.outcome);
    });
    if (found != came.outcomes.end() && found->came) {
      row.came = *found->came && found->name == row.outcome;
      row.since = seconds(found->since_ns);
    }
    comparison.rows.push_back(std::move(row));
  }
  relate(asked, answer.value("step", std::uint64_t{0}), &comparison);
  return comparison;
}

std::vector<Comparison> ForeseenAndCame::comparisons() const {
  const OutcomeRecord came = truth_ ? *truth_ : outcomes_of(*scene_, summaries_);
  std::vector<Comparison> result;
  for (const Asked& asked : asked_) {
    try {
      Comparison comparison = compared(asked, came);
      if (!comparison.rows.empty()) result.push_back(std::move(comparison));
    } catch (const ordered_json::exception&) {  // somebody else's answer, of another form
    } catch (const std::out_of_range&) {
    }
  }
  return result;
}

}  // namespace prescene::service
