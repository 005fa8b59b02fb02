// SPDX-License-Identifier: Apache-2.0
#include "explain_text.h"

#include <cmath>
#include <numbers>

#include "prescene/core/text.h"
#include "prescene/queries/camera_name.h"

namespace prescene::queries {
namespace {

using belief::EventKind;
using core::fixed_text;
using geometry::Vector3d;

std::string at_time(const Explanation& e) {
  return e.time ? " " + fixed_text(e.time->mean, 2) + " s after the window's start (" + fixed_text(e.time->low, 2) +
                      " to " + fixed_text(e.time->high, 2) + " s)"
                : "";
}

/// As the camera sees it at the window's end; of several cameras the scene's first one that took a frame.
std::string towards_text(double degrees, const ExplainWindow& window) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const Vector3d d(std::cos(angle), std::sin(angle), 0.0);
  const belief::Observation* seen = &window.frames.back().observation;
  for (std::size_t i = window.frames.size(); i-- > 0;)
    if (window.frames[i].observation.camera < seen->camera) seen = &window.frames[i].observation;
  const std::string name = camera_name(*window.start->scene, seen->camera);
  const Vector3d d_C = seen->X_WC.rotation.conjugate() * d;
  if (std::abs(d_C.x()) >= Vector3d(0.0, d_C.y(), d_C.z()).norm())
    return std::string(d_C.x() > 0.0 ? "to the right" : "to the left") +
           (name.empty() ? "" : ", as camera " + name + " sees it,");
  return (d_C.z() > 0.0 ? "away from " : "towards ") + (name.empty() ? "the camera" : "camera " + name);
}

std::string effects_text(const Explanation& e) {
  std::string text;
  if (e.tips >= 0.5) text += " and tipped over";
  if (e.falls >= 0.5) text += e.tips >= 0.5 ? " and fell" : " and fell down";
  return text;
}

std::string probability_text(double probability) {
  return fixed_text(100.0 * probability, probability < 0.995 ? 0 : 1) + " %";
}

}  // namespace

std::string sentence_of(const Explanation& e, const ExplainWindow& window) {
  switch (e.kind) {
    case EventKind::kNothing:
      if (e.present_at_start)
        return "Nothing happened in the window but what is known to have been done: " + e.object + " was " +
               (*e.present_at_start ? "there already" : "gone already") + " when it began.";
      return "Nothing happened but what is known to have been done.";
    case EventKind::kPushed:
      return e.object + " was pushed" + (e.towards ? " " + towards_text(e.towards->mean, window) : "") + at_time(e) +
             (e.speed ? ", at " + fixed_text(e.speed->mean, 2) + " m/s" : "") + effects_text(e) + ".";
    case EventKind::kBumped:
      return e.object + " was bumped" + (e.towards ? " " + towards_text(e.towards->mean, window) : "") + at_time(e) +
             (e.impulse ? ", by " + fixed_text(e.impulse->mean, 3) + " N s" : "") + effects_text(e) + ".";
    case EventKind::kSlipped:
      return e.object + " slipped from the hand that held it, or was let go," + at_time(e) + effects_text(e) + ".";
    case EventKind::kMoved:
      return e.object + " was taken" + at_time(e) + " and put down elsewhere.";
    case EventKind::kTakenAway:
      return e.object + " was taken away" + at_time(e) + ".";
    case EventKind::kPutIn:
      return e.object + " was put in" + at_time(e) + ".";
    case EventKind::kExchanged:
      return e.object + " and " + e.partner + " changed places" + at_time(e) + ".";
    case EventKind::kOther:
      return e.object + " moved in a way that none of the known events explains.";
  }
  return {};
}

std::string sentence_of(const SmallestChange& change) {
  const std::string interval = probability_text(change.probability) + " (" + probability_text(change.low) + " to " +
                               probability_text(change.high) + ", " + std::to_string(change.instances) +
                               " fresh instances)";
  const std::string outcome = "'" + change.wanted + "'";
  if (change.instances == 0) return "Whether a change would have led to " + outcome + " was not worked out.";
  if (change.size == 0.0)
    return change.found
               ? "Nothing would have to change: " + outcome + " comes about in " + interval + "."
               : "No change of up to 4 standard deviations was found that surely leads to " + outcome + " with " +
                     probability_text(change.wanted_probability) + "; without one it comes about in " + interval + ".";
  std::string parts;
  for (const ChangedPart& part : change.parts) {
    parts += parts.empty() ? "" : ", ";
    parts += part.name + " " + core::rounded_text(std::round(1e3 * part.to) / 1e3) + " instead of " +
             core::rounded_text(std::round(1e3 * part.from) / 1e3) + " " + part.unit;
  }
  const std::string how = parts + " (" + fixed_text(change.size, 1) + " standard deviations)";
  if (!change.found)
    return "No change was found that surely leads to " + outcome + " with " +
           probability_text(change.wanted_probability) + "; the nearest is " + how + ", with " + interval + ".";
  return "The smallest change that was found to lead to " + outcome + ": " + how + "; it then comes about in " +
         interval + ", without the change in " + probability_text(change.unchanged_probability) + ".";
}

std::string paragraph_of(const ExplainAnswer& answer) {
  if (answer.explanations.empty()) return {};
  const Explanation& best = answer.explanations.front();
  std::string text = best.sentence + " This is " + probability_text(best.probability) + " probable (" +
                     probability_text(best.low) + " to " + probability_text(best.high) + ")";
  if (answer.explanations.size() > 1 && answer.explanations[1].probability >= 0.01) {
    const Explanation& second = answer.explanations[1];
    text += "; the next best explanation has " + probability_text(second.probability) + ": " + second.sentence;
  } else {
    text += ".";
  }
  if (best.kind != EventKind::kNothing) {
    const DecidingFrame* most = nullptr;
    for (const DecidingFrame& frame : answer.frames)
      if (most == nullptr || frame.against_nothing > most->against_nothing) most = &frame;
    if (most != nullptr && most->against_nothing > 0.0)
      text += " The frame " + fixed_text(most->time, 2) +
              " s after the start speaks most against nothing having happened (" +
              fixed_text(most->against_nothing, 1) + " nats).";
  }
  for (const WhereItIs& object : answer.objects) {
    if (!object.out_of_sight) continue;
    text += " " + object.object + " is out of sight, with 90 % within " + fixed_text(100.0 * object.radius_90, 1) +
            " cm of (" + fixed_text(object.mean.x(), 3) + ", " + fixed_text(object.mean.y(), 3) + ", " +
            fixed_text(object.mean.z(), 3) + ") m.";
  }
  return text;
}

}  // namespace prescene::queries
