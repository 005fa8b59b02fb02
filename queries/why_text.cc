// SPDX-License-Identifier: Apache-2.0
#include "why_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::queries {
namespace {

using belief::WhyAgainst;
using core::fixed_text;

// nats; what is less is called nothing.
constexpr double kNothing = 0.05;
constexpr double kNamedShare = 0.005;  // of the pixels, that is named

std::string frames_text(std::size_t count) { return std::to_string(count) + (count == 1 ? " frame" : " frames"); }

std::string from_to_text(double from, double to) {
  const std::string first = fixed_text(from, 2), last = fixed_text(to, 2);
  return first == last ? "at " + first + " s" : "from " + first + " to " + last + " s";
}

/// "2.1 cm away and turned by 180 degrees".
std::string off_text(const geometry::Pose& X_WQ, const geometry::Pose& X_WO, const geometry::SymmetryGroup& symmetry) {
  const double turn = geometry::symmetric_angle(X_WQ, X_WO, symmetry) * geometry::kDegreesPerRadian;
  return fixed_text(100.0 * (X_WQ.translation - X_WO.translation).norm(), 1) + " cm away and turned by " +
         fixed_text(turn, 0) + " degrees";
}

std::string claim_of(const WhyComparison& c, const WhyAnswer& answer, const geometry::SymmetryGroup& symmetry) {
  if (c.against == WhyAgainst::kAbsence || !c.X_WO)
    return "That " + answer.object + " is where it is believed to be, and not absent: ";
  const std::string off = off_text(*c.X_WO, answer.X_WO, symmetry);
  if (c.against == WhyAgainst::kAlternative)
    return "That " + answer.object + " is as it is believed to be, and not at the likeliest alternative (" + off +
           ", of probability " + fixed_text(c.probability.value_or(0.0), 2) + "): ";
  return "That " + answer.object + " is as it is believed to be, and not at the given pose (" + off + "): ";
}

/// "depth on its surface 40.2, its outline 12.0", the largest first.
std::string terms_text(const WhyComparison& c) {
  const bool absence = c.against == WhyAgainst::kAbsence;
  std::vector<std::pair<double, std::string>> terms = {
      {c.tempered_terms.surface, absence ? "depth within its outline" : "depth where both have it"},
      {c.tempered_terms.outline, absence ? "depth at its outline" : "the outline, where only one of both has it"},
      {c.tempered_terms.color, "colour"},
      {c.tempered_terms.missing, "pixels without depth"}};
  std::erase_if(terms, [](const auto& term) { return std::abs(term.first) < kNothing; });
  std::stable_sort(terms.begin(), terms.end(),
                   [](const auto& a, const auto& b) { return std::abs(a.first) > std::abs(b.first); });
  std::string text;
  for (const auto& [nats, name] : terms)
    text += (text.empty() ? "" : ", ") + name + " " + (nats > 0.0 ? "+" : "") + fixed_text(nats, 1);
  return text;
}

std::string percent_of(int pixels, int all) { return fixed_text(100.0 * pixels / all, 0) + " %"; }

std::string name_of(const HiddenBy& by) {
  switch (by.kind) {
    case HiddenBy::Kind::kObject:
      return by.name;
    case HiddenBy::Kind::kRobot:
      return "the robot";
    case HiddenBy::Kind::kSupport:
      break;
  }
  return "a support";
}

}  // namespace

std::string text_of(const WhyComparison& c, const WhyAnswer& answer, const geometry::SymmetryGroup& symmetry,
                    core::TimeNs begin_ns) {
  const auto seconds = [&](std::size_t k) { return core::seconds_of(answer.views[k].stamp_ns - begin_ns); };
  std::string text = claim_of(c, answer, symmetry) + frames_text(c.frames.size()) + " " +
                     from_to_text(seconds(0), seconds(answer.views.size() - 1)) + " ";
  if (std::abs(c.tempered) < kNothing)
    text += std::string(c.frames.size() == 1 ? "says" : "say") + " nothing for it or against it";
  else
    text += std::string(c.frames.size() == 1 ? "speaks " : "speak ") + (c.tempered > 0.0 ? "for" : "against") +
            " it by " + fixed_text(std::abs(c.tempered), 1) + " nats (" + fixed_text(std::abs(c.log_ratio), 0) +
            " before tempering)";
  const std::string terms = terms_text(c);
  text += terms.empty() ? ". " : ": " + terms + ". ";
  if (std::abs(c.tempered) < kNothing) return text;
  if (!c.deciding.empty() && c.deciding.size() < c.frames.size()) {
    double sum = 0.0;
    for (const std::size_t k : c.deciding) sum += c.frames[k].tempered;
    text +=
        frames_text(c.deciding.size()) + " " + from_to_text(seconds(c.deciding.front()), seconds(c.deciding.back())) +
        (c.deciding.size() == 1 ? " decides: " : " decide: ") + (sum > 0.0 ? "+" : "") + fixed_text(sum, 1) + " nats. ";
  }
  if (c.place && !c.place->in_image.empty())
    text += "In the frame that says most, the pixels that say it lie " + c.place->in_image + " of the object. ";
  double against = 0.0;
  for (std::size_t k = 0; k < c.frames.size(); ++k)
    against += answer.tempering[k] * (c.tempered > 0.0 ? c.frames[k].speaks_against : c.frames[k].speaks_for);
  if (std::abs(against) >= kNothing)
    text += std::string("The pixels that say otherwise sum to ") + (against > 0.0 ? "+" : "") + fixed_text(against, 1) +
            ". ";
  return text;
}

std::string seen_text(const WhyAnswer& answer) {
  int in_view = 0, covered = 0, measured = 0, visible = 0;
  std::map<std::string, int> hiding;  // by name
  for (const WhyView& view : answer.views) {
    in_view += view.evidence.in_view;
    covered += view.evidence.covered;
    measured += view.evidence.measured;
    visible += view.evidence.visible;
    for (const HiddenBy& by : view.hidden_by) hiding[name_of(by)] += by.pixels;
  }
  if (in_view == 0) return answer.object + " is out of view: nothing is said of it.";
  std::vector<std::pair<int, std::string>> by;
  for (const auto& [name, pixels] : hiding)
    if (pixels >= kNamedShare * in_view) by.emplace_back(pixels, name);
  std::stable_sort(by.begin(), by.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string hidden;
  for (const auto& [pixels, name] : by)
    hidden += (hidden.empty() ? "" : ", ") + percent_of(pixels, in_view) + " hidden by " + name;
  if (covered == 0)
    return answer.object + " is hidden" + (hidden.empty() ? "" : " (" + hidden + ")") + ": nothing is said of it.";
  std::string text = "Of its pixels, " + percent_of(visible, in_view) + " are seen";
  if (!hidden.empty()) text += ", " + hidden;
  if (measured - visible >= kNamedShare * in_view)
    text += ", " + percent_of(measured - visible, in_view) + " behind something that is not known";
  if (covered - measured >= kNamedShare * in_view)
    text += ", " + percent_of(covered - measured, in_view) + " without depth";
  return text + ".";
}

}  // namespace prescene::queries
