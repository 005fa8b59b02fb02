// SPDX-License-Identifier: Apache-2.0
// The part of a filter's step that questions how objects are turned.
#include <algorithm>
#include <cstdint>

#include "frame_step.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/rivals.h"
#include "prescene/filter/operators/turn_looks.h"
#include "prescene/filter/proposals/fine_frame.h"

namespace prescene::filter {
namespace {

using belief::Belief;
using belief::ObjectBelief;

// So often, in frames, rivals of an object that is followed are looked for ...
constexpr std::uint64_t kRivalsEvery = 5;
// ... and so often those of one whose turn the scene leaves open, once the fine image has left no other turn.
constexpr std::uint64_t kDecidedEvery = 10;
// A camera that was found to be sharp is measured again in each frame whose number is a multiple of this.
constexpr std::uint64_t kSmearEvery = 25;
// Of what the scene leaves open, turns are weighed in each of so many frames, which count alike; after them a look has
// this weight, and as many frames count as in the coarse image.
constexpr std::uint64_t kFirstLooks = 5;
constexpr double kLookGain = 0.25;

/// Share of the object's pixels that the frame shows; with one camera, of the newest frame that showed any.
double share_in(const Belief& belief, std::size_t object, int camera) {
  const ObjectBelief& seen = belief.objects[object];
  const auto number = static_cast<std::size_t>(camera);
  return number < seen.views.size() ? seen.views[number].visible_share : seen.visible_share;
}

}  // namespace

void ParticleFilter::weigh_turns(FrameStep& step, std::size_t object) {
  const Belief& belief = step.belief();
  const double share = share_in(belief, object, step.observation.camera);
  if (!(share >= settings_.weight.hidden_share)) return;
  const double turned = turned_log_odds(belief.scene->objects[object]);
  const RivalPrior prior = turned < 0.0 ? RivalPrior::kTracked : RivalPrior::kFound;
  const bool is_open = turned > kFoundLogOdds;
  const std::uint64_t number = step.frame_number();
  if (is_open && number <= kFirstLooks) {
    if (belief.step == 1 || share >= kMostlySeen)
      look_at_turns_of(step, object, prior, 1.0 / static_cast<double>(number));
    return;
  }
  const bool is_decided = is_open && is_sharp(step.observation.camera) &&
                          !holds_turns(belief.objects[object].particles, model_of(belief, object).symmetry);
  if (share >= kMostlySeen && (number + object) % (is_decided ? kDecidedEvery : kRivalsEvery) == 0)
    look_at_turns_of(step, object, prior, kLookGain);
}

void ParticleFilter::look_at_turns_of(FrameStep& step, std::size_t object, RivalPrior prior, double gain) {
  const FilterFrame& frame = step.frame;
  Belief& belief = step.belief();
  ObjectBelief& seen = belief.objects[object];
  const belief::SceneObject& named = belief.scene->objects[object];
  const belief::ObjectModel& model = model_of(belief, object);
  const SearchTarget target = target_in(step, object);
  const rendering::FrameTerms terms = terms_in(step, object, target);
  const auto propose = [&] {
    return propose_rivals(frame, terms, target, model.symmetry, prior, settings_.weight, settings_.initialise, tools_,
                          seen);
  };
  const bool is_known = prior == RivalPrior::kTracked && !(turned_log_odds(named) > kSlipLogOdds);
  // A turn that was known and is held alone is only questioned where the coarse image speaks for another one.
  const bool is_in_question = !is_known || holds_turns(seen.particles, model.symmetry);
  if (!is_in_question && propose() == 0) return;
  EdgeSmear& smear = smears_[static_cast<std::size_t>(step.observation.camera)];
  if (!step.fine && smear.is_sharp() && step.frame_number() % kSmearEvery != 0)
    step.fine = fine_frame(frame, *belief.scene, step.observation, tools_, smear);
  if (!step.fine) step.fine = fine_frame_if_sharp(frame, *belief.scene, step.observation, tools_);
  smear = step.fine->smear;
  if (!step.fine->smear.is_sharp()) {
    if (is_in_question) propose();
    return;
  }
  rendering::FrameTerms fine_terms = step.fine->terms;
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    if (i == object || !hides_others(belief.objects[i])) continue;
    const Pose X_CO = frame.X_CW * step.heaviest(i).X_WO;
    with_known_surfaces(fine_terms, depth_of(target_in(step, i), X_CO, fine_terms.camera, *tools_.renderer),
                        &fine_terms);
  }
  const SearchTarget fine_target = in_fine(target, model, tools_);
  const TurnPrior said(named, model.symmetry);
  look_at_turns({.frame = frame,
                 .terms = terms,
                 .target = target,
                 .fine_terms = fine_terms,
                 .fine_target = fine_target,
                 .prior = said,
                 .gain = gain,
                 .cameras = seeing_cameras(step.by(), seen)},
                model.symmetry, settings_.weight, settings_.initialise, tools_, seen);
}

}  // namespace prescene::filter
