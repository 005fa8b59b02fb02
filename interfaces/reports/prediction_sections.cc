// SPDX-License-Identifier: Apache-2.0
#include "prediction_sections.h"

#include <algorithm>
#include <cmath>

#include "html_text.h"

namespace prescene::interfaces {
namespace {

/// Tilt and heading of the body's z and x axes, as a person would say them.
std::string orientation_text(const geometry::Quaterniond& rotation) {
  const geometry::Vector3d z = rotation * geometry::Vector3d::UnitZ(), x = rotation * geometry::Vector3d::UnitX();
  return in_degrees(std::acos(std::clamp(z.z(), -1.0, 1.0))) + ", " + in_degrees(std::atan2(x.y(), x.x()));
}

TableBlock final_poses_table(const belief::FinalPoses& poses) {
  constexpr std::size_t kShown = 8;
  TableBlock table;
  table.caption = "Where " + poses.object + " ends: the heaviest of " + std::to_string(poses.components.size()) +
                  " Gaussian components";
  table.columns = {"share", "outcome", "x, y, z (m)", "spread x, y (mm)", "tilt, heading (°)"};
  for (std::size_t i = 0; i < std::min(kShown, poses.components.size()); ++i) {
    const belief::PoseComponent& c = poses.components[i];
    table.rows.push_back(
        {percent(c.weight), c.outcome, position_text(c.mean.translation),
         in_millimetres(std::sqrt(c.covariance(3, 3))) + ", " + in_millimetres(std::sqrt(c.covariance(4, 4))),
         orientation_text(c.mean.rotation)});
  }
  return table;
}

std::string full_name(const std::string& group, const std::string& outcome) {
  return group.empty() ? outcome : group + " = " + outcome;
}

/// Groups by their name, single outcomes by theirs, in the answer's order.
std::vector<std::string> questions_of(const belief::PredictAnswer& answer) {
  std::vector<std::string> names;
  for (const belief::OutcomeProbability& outcome : answer.outcomes) {
    const std::string& name = outcome.group.empty() ? outcome.name : outcome.group;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

bool belongs(const belief::OutcomeProbability& outcome, const std::string& question) {
  return (outcome.group.empty() ? outcome.name : outcome.group) == question;
}

std::string cost_text(const belief::PredictAnswer& answer) {
  std::string text = "From " + std::to_string(answer.instances) +
                     (answer.instances == 1 ? " simulated instance" : " simulated instances");
  if (answer.step > 0.0) {
    text += " of together " + decimal(answer.simulated_seconds / answer.step, 0) + " steps of " +
            decimal(1000.0 * answer.step, 2) + " ms";
    if (answer.flown_seconds > 0.0)
      text += " (" + percent(answer.flown_seconds / std::max(1e-9, answer.simulated_seconds)) +
              " in free flight, without looking for contacts)";
  }
  text += "; " + decimal(answer.simulated_seconds, 0) + " simulated seconds in " + decimal(answer.cpu_seconds, 1) +
          " s of processor time and " + decimal(answer.wall_seconds, 1) + " s.";
  const belief::CertificateSummary& use = answer.certificates;
  if (use.used)
    text += " " + percent(static_cast<double>(use.certified) / std::max(1, answer.instances)) +
            " of the instances ended when their outcome was decided; " + std::to_string(use.audited) +
            " of them were run on to rest, " + std::to_string(use.mismatches) + " came out otherwise.";
  else
    text += " Every instance ran to rest: where it ends is shown here.";
  return text;
}

/// How the probabilities of one question settled.
std::optional<ChartBlock> settling_chart(const belief::PredictAnswer& answer, const std::string& question) {
  constexpr std::size_t kMostCurves = 6;
  if (answer.history.size() < 2) return std::nullopt;
  ChartBlock chart;
  chart.caption = question + ": probability against instances, with its interval";
  chart.x_label = "instances";
  chart.y_label = "probability";
  for (std::size_t i = 0; i < answer.outcomes.size() && chart.curves.size() < kMostCurves; ++i) {
    const belief::OutcomeProbability& outcome = answer.outcomes[i];
    if (!belongs(outcome, question) || outcome.probability <= 0.0) continue;
    ChartBlock::Curve& curve = chart.curves.emplace_back();
    curve.name = outcome.name;
    for (const belief::ProbabilityStage& stage : answer.history) {
      if (i >= stage.outcomes.size()) continue;
      curve.points.emplace_back(stage.instances, stage.outcomes[i].probability);
      curve.band.emplace_back(stage.outcomes[i].low, stage.outcomes[i].high);
    }
  }
  if (chart.curves.empty()) return std::nullopt;
  return chart;
}

std::string rest_text(const belief::DecidingInputs& inputs, int instances) {
  if (inputs.by_several)
    return "several together, or differences too fine for these instances, decide about " + percent(*inputs.by_several);
  return std::to_string(instances) + " instances are too few to say what decides the rest";
}

void add_deciding(const belief::PredictAnswer& answer, std::vector<ReportSection>& sections) {
  constexpr std::size_t kMostRows = 8;
  if (answer.inputs.empty()) return;
  ReportSection& section = sections.emplace_back();
  section.title = "What decides";
  for (const belief::DecidingInputs& one : answer.inputs) {
    // Shown for the likeliest of its outcomes; where that is almost sure there is nothing to decide.
    const belief::OutcomeProbability* shown = nullptr;
    for (const belief::OutcomeProbability& outcome : answer.outcomes)
      if (belongs(outcome, one.about) && (!shown || outcome.probability > shown->probability)) shown = &outcome;
    if (!shown || shown->probability > 0.98 || shown->probability < 0.02) continue;
    TornadoBlock tornado;
    tornado.caption = full_name(shown->group, shown->name) + " (" + percent(shown->probability) +
                      "): what one uncertain input makes of it; " + rest_text(one, answer.instances) + " of " +
                      one.about;
    tornado.overall = shown->probability;
    for (const belief::InputShare& input : one.inputs) {
      if (tornado.rows.size() == kMostRows) break;
      const auto effect = std::find_if(input.effects.begin(), input.effects.end(),
                                       [&](const belief::InputShare::Effect& e) { return e.outcome == shown->name; });
      if (effect == input.effects.end()) continue;
      tornado.rows.push_back({input.input, effect->low_fifth, effect->high_fifth, input.share, input.standard_error});
    }
    section.blocks.push_back(std::move(tornado));
  }
  if (section.blocks.empty()) {
    sections.pop_back();
    return;
  }
  section.blocks.push_back(
      TextBlock{"On the right: the share of the outcomes' variance that the input explains alone (first order), with "
                "its standard "
                "error."});
}

void add_contacts(const belief::PredictAnswer& answer, std::vector<ReportSection>& sections) {
  constexpr std::size_t kMostRows = 12, kMostCurves = 5;
  if (answer.contacts.empty()) return;
  ReportSection& section = sections.emplace_back();
  section.title = "Who touches whom";
  TableBlock table;
  table.caption = "Hardest knock: the largest impulse within one step, where they touch; 5 to 95 % of the instances";
  table.columns = {"pair", "probability", "interval", "first at, s (10 to 90 %)", "hardest knock, N s"};
  ChartBlock chart;
  chart.caption = "Probability that they touch at a time";
  chart.x_label = "time, s";
  chart.y_label = "probability";
  for (const belief::ContactForecast& contact : answer.contacts) {
    const std::string pair = contact.first + " and " + contact.second;
    if (table.rows.size() < kMostRows)
      table.rows.push_back({pair, percent(contact.probability), percent(contact.low) + " to " + percent(contact.high),
                            decimal(contact.first_touch[0], 2) + " to " + decimal(contact.first_touch[2], 2),
                            significant(contact.impulse[0], 2) + " to " + significant(contact.impulse[2], 2)});
    if (chart.curves.size() == kMostCurves) continue;
    ChartBlock::Curve& curve = chart.curves.emplace_back();
    curve.name = pair;
    for (std::size_t i = 0; i < std::min(answer.contact_times.size(), contact.touching.size()); ++i)
      curve.points.emplace_back(answer.contact_times[i], contact.touching[i]);
  }
  if (answer.flight && answer.flight->apart_until > 0.0 && !answer.flight->may_touch.empty()) {
    const belief::FlightForecast::Pair& next = answer.flight->may_touch.front();
    section.blocks.push_back(TextBlock{"Surely nothing touches anything before " +
                                       decimal(answer.flight->apart_until, 2) + " s; then " + next.first + " and " +
                                       next.second + " may."});
  }
  section.blocks.push_back(std::move(table));
  section.blocks.push_back(std::move(chart));
}

void add_shifts(const belief::ModelError& error, belief::ModelError::Kind kind, const std::string& caption,
                const std::vector<const belief::OutcomeProbability*>& shown, ReportSection& section) {
  TableBlock table;
  table.caption = caption + " (" + std::to_string(error.instances) + " instances each)";
  table.columns = {"model"};
  for (const auto* outcome : shown) table.columns.push_back(full_name(outcome->group, outcome->name));
  for (const belief::ModelError::Variant& variant : error.variants) {
    if (variant.kind != kind) continue;
    std::vector<std::string>& row = table.rows.emplace_back(std::vector<std::string>{variant.what});
    for (const auto* outcome : shown) {
      const auto found =
          std::find_if(variant.shifts.begin(), variant.shifts.end(), [&](const belief::ModelError::Shift& shift) {
            return shift.outcome == outcome->name && shift.group == outcome->group;
          });
      row.push_back(found == variant.shifts.end()
                        ? ""
                        : decimal(100.0 * found->shift, 1) + " (" + decimal(100.0 * found->low, 1) + " to " +
                              decimal(100.0 * found->high, 1) + ")");
    }
  }
  if (!table.rows.empty()) section.blocks.push_back(std::move(table));
}

void add_doubts(const belief::PredictAnswer& answer, std::vector<ReportSection>& sections) {
  constexpr std::size_t kMostOutcomes = 6;
  if (answer.chaos.empty() && !answer.model_error) return;
  ReportSection& section = sections.emplace_back();
  section.title = "How far the model carries";
  if (!answer.chaos.empty()) {
    TableBlock table;
    table.caption = "Pairs of starts " + decimal(answer.chaos.front().displacement, 1) +
                    " standard deviations apart: how many end differently";
    table.columns = {"about", "pairs", "end differently", "interval", "chaotic"};
    for (const belief::ChaosCheck& check : answer.chaos)
      table.rows.push_back({check.about, std::to_string(check.pairs), percent(check.changed),
                            percent(check.low) + " to " + percent(check.high), check.chaotic ? "yes" : "no"});
    section.blocks.push_back(std::move(table));
  }
  if (!answer.model_error) return;
  // The likeliest outcomes as columns.
  std::vector<const belief::OutcomeProbability*> shown;
  for (const belief::OutcomeProbability& outcome : answer.outcomes) shown.push_back(&outcome);
  std::stable_sort(shown.begin(), shown.end(),
                   [](const auto* a, const auto* b) { return a->probability > b->probability; });
  if (shown.size() > kMostOutcomes) shown.resize(kMostOutcomes);
  add_shifts(
      *answer.model_error, belief::ModelError::Kind::kStep,
      "The simulator's own error, which the intervals do not contain: shift of the probability, percentage points "
      "with its interval",
      shown, section);
  add_shifts(
      *answer.model_error, belief::ModelError::Kind::kPrior,
      "What the scene says is not known, which the probabilities are taken over: their shift with one value known",
      shown, section);
}

}  // namespace

std::string in_millimetres(double metres) { return decimal(1000.0 * metres, 1); }
std::string in_degrees(double radians) { return decimal(radians * 180.0 / M_PI, 1); }
std::string position_text(const geometry::Vector3d& p) {
  return decimal(p.x(), 3) + ", " + decimal(p.y(), 3) + ", " + decimal(p.z(), 3);
}

std::vector<ReportSection> prediction_sections(const belief::PredictAnswer& answer, const belief::Scene& scene) {
  std::vector<ReportSection> sections;
  ReportSection& outcomes = sections.emplace_back();
  outcomes.title = "What will happen";
  if (!answer.outcomes.empty()) outcomes.blocks.push_back(OutcomeBlock{"", answer.outcomes});
  for (const std::string& remark : answer.remarks) outcomes.blocks.push_back(TextBlock{remark});
  outcomes.blocks.push_back(TextBlock{cost_text(answer)});
  for (const std::string& question : questions_of(answer))
    if (auto chart = settling_chart(answer, question)) {
      outcomes.blocks.push_back(*std::move(chart));
      break;  // the first question's is enough to see how it settles
    }
  for (const belief::FinalPoses& poses : answer.final_poses) {
    ReportSection& section = sections.emplace_back();
    section.title = "Where " + poses.object + " ends";
    section.blocks.push_back(HeatMapBlock{
        "Probability per " + decimal(100.0 * poses.heat_map.cell, 0) + " cm cell, seen from above; lines: supports",
        poses.heat_map, support_outlines(scene)});
    section.blocks.push_back(final_poses_table(poses));
  }
  if (!answer.typical_runs.empty()) {
    ReportSection& section = sections.emplace_back();
    section.title = "Typical runs";
    for (const belief::TypicalRun& run : answer.typical_runs) {
      TimelineBlock block;
      block.caption = (run.group.empty() ? "" : run.group + ": ") + run.outcome + " (" + percent(run.share) + ")";
      block.timeline = run.timeline;
      if (!run.trajectory.states.empty()) {
        block.begin = run.trajectory.start().time;
        block.end = run.trajectory.final().time;
      }
      section.blocks.push_back(std::move(block));
    }
  }
  add_deciding(answer, sections);
  add_contacts(answer, sections);
  add_doubts(answer, sections);
  return sections;
}

}  // namespace prescene::interfaces
