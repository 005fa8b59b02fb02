// SPDX-License-Identifier: Apache-2.0
// The part of a filter's step that weighs its particles by the frame.
#include <algorithm>
#include <cmath>
#include <map>

#include "frame_step.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/rivals.h"
#include "prescene/filter/operators/standing.h"
#include "prescene/filter/operators/world_terms.h"

namespace prescene::filter {

using belief::Belief;
using belief::ObjectBelief;
using belief::Particle;

namespace {

/// How far above where the scene has them the frame shows the supports about an object, m. 0 where the pose is clear
/// of them as the scene has them: it does not matter there.
double support_offset(const FilterFrame& frame, const SearchTarget& target, const Pose& X_WO, double tolerance) {
  if (frame.supports.empty() || !(frame.surfaces->overlap(*target.mesh, X_WO, tolerance) > 0.0)) return 0.0;
  const auto radius = static_cast<double>(target.mesh->radius);
  const Vector3d above = X_WO * target.centre() + 2.0 * radius * frame.up_W;
  const auto hit = frame.surfaces->first_along(above, -frame.up_W, 4.0 * radius);
  if (!hit) return 0.0;
  return support_height(frame.terms, frame.supports, frame.X_CW, above - hit->distance * frame.up_W, frame.up_W, radius,
                        kSupportAround * radius)
      .offset;
}

}  // namespace

SearchTarget ParticleFilter::target_in(const FrameStep& step, std::size_t object) const {
  return target_of(step.belief().objects[object], *step.belief().scene, step.frame, tools_);
}

geometry::DepthImage ParticleFilter::depth_in(const FrameStep& step, std::size_t object) const {
  return depth_of(target_in(step, object), step.frame.X_CW * step.heaviest(object).X_WO, step.frame.terms.camera,
                  *tools_.renderer);
}

rendering::FrameTerms ParticleFilter::terms_in(const FrameStep& step, std::size_t object,
                                               const SearchTarget& target) const {
  std::vector<const geometry::DepthImage*> others;
  for (std::size_t j = 0; j < step.depths.size(); ++j)
    if (j != object && hides_others(step.belief().objects[j])) others.push_back(&step.depths[j]);
  const Pose X_CO = step.frame.X_CW * step.heaviest(object).X_WO;
  return terms_for_object(step.frame, others, X_CO * target.centre(), static_cast<double>(target.mesh->radius));
}

void ParticleFilter::weigh_one(FrameStep& step, std::size_t object, double dt, const WorldTerms* worlds) {
  const FilterFrame& frame = step.frame;
  Belief& belief = step.belief();
  ObjectBelief& seen = belief.objects[object];
  const core::RandomStream stream(belief.seed, core::Purpose::kProposal);
  const SearchTarget target = target_in(step, object);
  const rendering::FrameTerms terms = terms_in(step, object, target);
  WeightReport& report = step.reports[object];
  std::vector<double> before;
  for (const Particle& particle : seen.particles) before.push_back(particle.log_weight);
  const std::shared_ptr<const RestingShape> shape = tools_.meshes->resting_shape(*target.mesh);
  const bool falls = belief.scene->gravity_W.norm() > 0.0;
  WeightContext context{.supports = frame.surfaces.get(),
                        .solids = &frame.solids,
                        .shape = falls ? shape.get() : nullptr,
                        .up_W = frame.up_W,
                        .support_depth = &frame.supports,
                        .support_offset = support_offset(frame, target, belief::heaviest(seen.particles).X_WO,
                                                         settings_.weight.support_tolerance),
                        .was_unseen = was_unseen_by(seen, step.observation.camera),
                        .depth = step.observation.frame.depth.get(),
                        .camera = step.observation.frame.camera};
  const auto& color = step.observation.frame.color;
  if (color && color->width() == context.camera.width && color->height() == context.camera.height)
    context.color = color.get();
  if (worlds != nullptr) {
    context.terms_of = worlds->terms_of;
    context.weight_pixels = worlds->pixels;
  }
  report = weight(terms, target, frame.X_WC, dt, settings_.weight, tools_,
                  stream.at(belief.step, static_cast<std::uint32_t>(object)), seen.particles, context);
  if (report.all_impossible) step.result.degraded |= kImpossibleWeights;
  // What looks like the top of something inside a support is the support.
  const Pose followed = clear_of_support(belief::heaviest(seen.particles).X_WO, context.support_offset, frame.up_W);
  if (frame.surfaces->overlap(*target.mesh, followed, settings_.weight.support_tolerance) > kMostInSupport)
    report.evidence_per_pixel = std::min(0.0, report.evidence_per_pixel);
  // What is hidden is not distinguished by its turn.
  if (report.hidden_weight < 0.5 && report.visible_share >= settings_.weight.hidden_share) {
    const bool is_looked_at = is_sharp(step.observation.camera) && report.visible_share >= kMostlySeen;
    share_among_turns(before, model_of(belief, object).symmetry, seen.particles, seeing_cameras(step.by(), seen),
                      turned_log_odds(belief.scene->objects[object]), is_looked_at ? 0.0 : kTurnMemory);
  }
}

void ParticleFilter::weigh_worlds(FrameStep& step, const Island& island, double dt) {
  Belief& belief = step.belief();
  const std::vector<double> before = world_weights(belief, island);
  double pixels = 0.0;
  for (const std::size_t member : island) {
    const SearchTarget target = target_in(step, member);
    pixels +=
        tempering_pixels(terms_in(step, member, target), target, step.frame.X_CW * step.heaviest(member).X_WO, tools_) /
        static_cast<double>(island.size());
  }
  for (const std::size_t member : island) {
    std::vector<WorldMember> others;
    for (const std::size_t other : island)
      if (other != member && hides_others(belief.objects[other]))
        others.push_back({target_in(step, other), &belief.objects[other].particles});
    std::vector<const geometry::DepthImage*> outside;
    for (std::size_t j = 0; j < step.depths.size(); ++j)
      if (std::find(island.begin(), island.end(), j) == island.end() && hides_others(belief.objects[j]))
        outside.push_back(&step.depths[j]);
    WorldTerms terms =
        world_terms(step.frame, {target_in(step, member), &belief.objects[member].particles}, others, outside, tools_);
    terms.pixels = pixels;
    weigh_one(step, member, dt, &terms);
    step.depths[member] = depth_in(step, member);
  }
  if (!combine_weights(island, before, belief)) step.result.degraded |= kImpossibleWeights;
  for (const std::size_t member : island) step.depths[member] = depth_in(step, member);
  // Which pose is published, and what speaks for it, is known now.
  for (const std::size_t member : island) {
    const SearchTarget target = target_in(step, member);
    evidence_of_heaviest(terms_in(step, member, target), target, step.frame.X_WC, settings_.weight, tools_,
                         belief.objects[member].particles, step.reports[member]);
  }
  ++step.result.counters.joint_islands;
}

void ParticleFilter::weigh_all(FrameStep& step, double dt) {
  Belief& belief = step.belief();
  step.depths.clear();
  for (std::size_t i = 0; i < belief.objects.size(); ++i) step.depths.push_back(depth_in(step, i));
  step.reports.resize(belief.objects.size());
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    const auto island = std::find_if(step.islands.begin(), step.islands.end(), [&](const Island& members) {
      return std::find(members.begin(), members.end(), i) != members.end();
    });
    if (island != step.islands.end()) {
      if (island->front() != i) continue;
      weigh_worlds(step, *island, dt);
      for (const std::size_t member : *island)
        update_track(step.reports[member], step.by(), settings_.track, belief.objects[member]);
      continue;
    }
    weigh_one(step, i, dt, nullptr);
    update_track(step.reports[i], step.by(), settings_.track, belief.objects[i]);
    step.depths[i] = depth_in(step, i);
  }
}

void ParticleFilter::weigh_print_of(FrameStep& step, std::size_t object, bool found) {
  if (!settings_.print.use || !step.shows(object)) return;
  ObjectBelief& seen = step.belief().objects[object];
  const PrintedModel* printed = prints_.get(model_of(step.belief(), object), meshes_);
  if (printed == nullptr) return;
  const RivalLook look = rival_look(settings_.print, seen, step.frame_number() + object, found);
  const PrintReport report = weigh_print(*printed, step.frame, step.observation, settings_.print, look, seen);
  step.result.counters.turned_by_print += report.turned ? 1 : 0;
}

void ParticleFilter::exchange_all(FrameStep& step) {
  const FilterFrame& frame = step.frame;
  Belief& belief = step.belief();
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    const SearchTarget target = target_in(step, i);
    if (target.color_model < 0) continue;
    for (std::size_t j = i + 1; j < belief.objects.size(); ++j) {
      const SearchTarget other = target_in(step, j);
      if (other.color_model < 0 || other.color_model == target.color_model || other.mesh != target.mesh) continue;
      const Particle& first = step.heaviest(i);
      const Particle& second = step.heaviest(j);
      if (first.mode == belief::MotionMode::kHeld || second.mode == belief::MotionMode::kHeld) continue;
      const rendering::FrameTerms terms = terms_in(step, i, target);
      const rendering::FrameTerms other_terms = terms_in(step, j, other);
      if (!are_exchanged({&terms, &other_terms}, {&target, &other}, {frame.X_CW * first.X_WO, frame.X_CW * second.X_WO},
                         settings_.augment, tools_))
        continue;
      exchange(belief.objects[i], belief.objects[j]);
      std::swap(step.depths[i], step.depths[j]);
      std::swap(step.reports[i], step.reports[j]);
    }
  }
}

}  // namespace prescene::filter
