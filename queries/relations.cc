// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/relations.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "foresee.h"
#include "kept_shapes.h"
#include "prescene/belief/body_names.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/spelling.h"
#include "prescene/core/text.h"
#include "prescene/simulation/outcomes/start_distribution.h"
#include "relation_shapes.h"
#include "seating.h"

namespace prescene::queries {
namespace {

using belief::RelationKind;
using geometry::Vector3d;

constexpr std::size_t kDrawsTogether = 8;
/// Standard deviations by which a gap may differ from none.
constexpr double kGapDeviations = 3.0;

/// A relation of two bodies, or of one (other = -1).
struct Key {
  RelationKind kind;
  int subject, other;
  auto operator<=>(const Key&) const = default;
};

/// What was judged of one draw.
struct DrawFacts {
  std::vector<Key> hold;
  std::vector<double> visible;                   ///< Share, by object.
  std::map<std::pair<int, int>, double> inside;  ///< Share, where it is not 0.
};

/// What is asked about, with all that its judging takes.
struct Asked {
  const belief::RelationsQuery& query;
  const Prior& prior;
  const RelationShapes& shapes;
  Vector3d up_W;
  std::optional<int> reach_body;  ///< Robot body of Reach::of.
  std::vector<double> tolerance;  ///< By object, m.

  std::size_t objects() const { return prior.scene->objects.size(); }
};

/// "did you mean 'mug'? ", or nothing.
std::string meant_by(const std::string& name, const std::vector<std::string>& known) {
  const std::string near = core::did_you_mean(name, known);
  return near.empty() ? near : near + " ";
}

/// The names of the objects that take part.
core::Result<std::vector<std::string>> present_names(const Prior& prior, const belief::RelationsQuery& query) {
  std::vector<std::string> names;
  for (const belief::SceneObject& object : prior.scene->objects) names.push_back(object.name);
  if (names.empty())
    return core::not_found("no object is there now: all are lost or were not found yet. Ask 'where' for their states");
  if (query.object && std::ranges::find(names, *query.object) == names.end())
    return no_such_object(prior, *query.object);
  return names;
}

core::Result<std::optional<int>> reach_body_of(const belief::Scene& scene, const belief::RelationsQuery& query) {
  if (!query.reach || query.reach->of.empty()) return std::optional<int>();
  if (query.reach->of == "camera") {
    if (!scene.camera)
      return core::not_found("reach.of: the scene has no camera: name a robot body, or give a point [x, y, z]");
    return std::optional<int>();
  }
  const std::optional<int> body = belief::find_robot_body(scene, query.reach->of);
  if (body) return body;
  std::vector<std::string> known{"camera"};
  for (const belief::KinematicBody& robot : scene.robot) known.push_back(robot.name);
  return core::not_found("reach.of: there is no robot body '" + query.reach->of +
                         "': " + meant_by(query.reach->of, known) + "Known are " + core::comma_list(known) +
                         ", and points [x, y, z]");
}

/// The prior, with everything stopped and let go, and nothing done.
Prior stopped(const Prior& prior) {
  auto scene = std::make_shared<belief::Scene>(*prior.scene);
  for (belief::SceneObject& object : scene->objects) object.held_by.reset();
  for (belief::KinematicBody& body : scene->robot) body.timeline = {{0.0, belief::pose_at(body, 0.0)}};
  scene->actions.clear();
  scene->outcomes.clear();
  scene->exclusive_outcomes.clear();
  scene->stop_at_rest = false;
  const auto stop = [](belief::WorldState& state) {
    for (belief::ObjectState& object : state.objects) {
      object.V_WO = {};
      object.mode = belief::MotionMode::kMoving;
    }
  };
  Prior result = prior;
  result.scene = std::move(scene);
  stop(result.likeliest);
  for (simulation::StartComponent& component : result.starts.components) {
    component.draw = [stop, draw = std::move(component.draw)](std::span<const double> uniforms) {
      belief::WorldState state = draw(uniforms);
      stop(state);
      return state;
    };
  }
  return result;
}

/// Of each object: the contact rules' touching distance and so many deviations of the height of its lowest point.
std::vector<double> tolerances(const Prior& prior, const RelationShapes& shapes, const Vector3d& up_W,
                               const std::vector<simulation::StartSampler>& samplers) {
  constexpr std::uint32_t kDraws = 64;  // deviations are good to some 10 %
  std::vector<double> result;
  const std::size_t objects = prior.scene->objects.size();
  std::vector<double> sum(objects, 0.0), squares(objects, 0.0), first(objects, 0.0);
  double mass = 0.0;
  for (std::size_t c = 0; c < samplers.size(); ++c) {
    const double weight = prior.starts.components[c].weight;
    for (std::uint32_t i = 0; i < kDraws; ++i) {
      const belief::WorldState state = samplers[c].draw(i);
      for (std::size_t o = 0; o < objects; ++o) {
        const double height = shapes.lowest(o, state.objects[o].X_WO, up_W);
        if (mass == 0.0) first[o] = height;  // sums of what is about 0 keep their digits
        sum[o] += weight * (height - first[o]);
        squares[o] += weight * (height - first[o]) * (height - first[o]);
      }
      mass += weight;
    }
  }
  for (std::size_t o = 0; o < objects; ++o) {
    const double mean = sum[o] / mass;
    const double deviation = std::sqrt(std::max(0.0, squares[o] / mass - mean * mean));
    result.push_back(
        std::min(Seating::kMostGap, simulation::MechanicsOptions{}.touching_distance + kGapDeviations * deviation));
  }
  return result;
}

/// Contacts that count: those of falls through no more than the tolerance. Of a pair that parts and meets again, the
/// last.
void judge_contacts(const Asked& asked, const simulation::InstanceRecord& record, double step, DrawFacts& facts) {
  const double g = asked.prior.scene->gravity_W.norm();
  const double start = record.final.time - record.simulated_seconds;
  const auto objects = static_cast<int>(asked.objects());
  const auto time_of = [&](int body) {
    return body < objects && g > 0.0 ? std::sqrt(2.0 * asked.tolerance[static_cast<std::size_t>(body)] / g) : 0.0;
  };
  std::map<std::pair<int, int>, const belief::ContactInterval*> last;
  for (const belief::ContactInterval& contact : record.contacts) {
    const double allowed = std::max(time_of(contact.first), time_of(contact.second)) + step;
    if (contact.begin - start <= allowed + 1e-9) last[{contact.first, contact.second}] = &contact;
  }
  for (const auto& [pair, contact] : last) {
    const auto [a, b] = pair;
    facts.hold.push_back({RelationKind::kTouches, a, b});
    for (const auto& [lower, upper] : {std::pair(a, b), std::pair(b, a)}) {
      if (upper >= objects || !belief::supports(*contact, lower, upper)) continue;
      facts.hold.push_back({RelationKind::kOn, upper, lower});
      facts.hold.push_back({RelationKind::kSupports, lower, upper});
    }
  }
}

void judge_draw(const Asked& asked, const belief::WorldState& state, collision::QueryScratch& scratch,
                DrawFacts& facts) {
  const belief::Scene& scene = *asked.prior.scene;
  const std::vector<belief::Pose> X_WB = asked.shapes.poses(scene, state);
  for (std::size_t i = 0; i < asked.objects(); ++i) {
    const auto subject = static_cast<int>(i);
    const std::optional<std::string>& hand = scene.objects[i].held_by;
    if (hand && state.objects[i].mode == belief::MotionMode::kHeld)
      facts.hold.push_back({RelationKind::kHolds, *belief::body_index(scene, *hand), subject});
    const auto tilt = asked.shapes.tilt(i, X_WB[i], asked.up_W);
    if (tilt && *tilt <= asked.query.upright_within) facts.hold.push_back({RelationKind::kUpright, subject, -1});
    if (scene.camera) {
      const double share = asked.shapes.visible_share(i, scene.camera->intrinsics, asked.prior.X_WC, X_WB, scratch);
      facts.visible.push_back(share);
      if (share >= kBarelyVisible) facts.hold.push_back({RelationKind::kVisible, subject, -1});
    }
    if (asked.query.reach) {
      const belief::Reach& reach = *asked.query.reach;
      Vector3d from = reach.point_W;
      if (asked.reach_body)
        from = belief::pose_at(scene.robot[static_cast<std::size_t>(*asked.reach_body)], 0.0).translation;
      else if (!reach.of.empty())
        from = asked.prior.X_WC.translation;
      if (asked.shapes.is_within(i, X_WB[i], from, reach.radius))
        facts.hold.push_back({RelationKind::kWithinReach, subject, -1});
    }
    for (std::size_t other = 0; other < X_WB.size(); ++other) {
      if (other == i) continue;
      const double share = asked.shapes.share_inside(i, other, X_WB, scratch);
      if (!(share > 0.0)) continue;
      facts.inside[{subject, static_cast<int>(other)}] = share;
      if (share >= kMostlyIn) facts.hold.push_back({RelationKind::kIn, subject, static_cast<int>(other)});
    }
  }
}

/// From what holds in each draw to probabilities.
class Tally {
 public:
  Tally(const Asked& asked, const Foresight& foresight, std::span<const DrawFacts> facts)
      : asked_(asked), instances_(foresight.estimate.instances), certain_(foresight.estimate.certain), facts_(facts) {
    std::map<int, double> weights;
    for (const simulation::InstanceRecord& record : instances_) weights[record.component] += record.weight;
    for (const auto& [component, weight] : weights) {
      index_[component] = components_.size();
      components_.push_back({weight, {}});
    }
  }

  void fill(belief::RelationsAnswer& answer) const {
    std::map<Key, std::vector<int>> classes;
    for (std::size_t n = 0; n < facts_.size(); ++n)
      for (const Key& key : facts_[n].hold) {
        std::vector<int>& of_key = classes[key];
        of_key.resize(facts_.size(), 1);
        of_key[n] = 0;
      }
    const auto always = [&](RelationKind kind, std::size_t object) {
      classes[{kind, static_cast<int>(object), -1}].resize(facts_.size(), 1);
    };
    for (std::size_t i = 0; i < asked_.objects(); ++i) {
      const belief::SceneObject& object = asked_.prior.scene->objects[i];
      if (!asked_.prior.scene->model_of(object).symmetry.ball) always(RelationKind::kUpright, i);
      if (asked_.prior.scene->camera) always(RelationKind::kVisible, i);
      if (asked_.query.reach) always(RelationKind::kWithinReach, i);
    }
    for (const auto& [key, of_key] : classes)
      if (is_asked(key)) answer.relations.push_back(probability_of(key, of_key));
    std::ranges::stable_sort(answer.relations, [](const auto& a, const auto& b) {
      return a.relation != b.relation ? a.relation < b.relation : a.probability > b.probability;
    });
  }

 private:
  bool is_asked(const Key& key) const {
    if (!asked_.query.object) return true;
    const belief::Scene& scene = *asked_.prior.scene;
    return belief::body_name(scene, key.subject) == *asked_.query.object ||
           (key.other >= 0 && belief::body_name(scene, key.other) == *asked_.query.object);
  }

  belief::RelationProbability probability_of(const Key& key, const std::vector<int>& of_key) const {
    std::vector<simulation::ComponentClasses> components = components_;
    double share = 0.0, mass = 0.0;
    for (std::size_t n = 0; n < instances_.size(); ++n) {
      const simulation::InstanceRecord& record = instances_[n];
      components[index_.at(record.component)].classes.push_back(record.failed ? -1 : of_key[n]);
      if (record.failed) continue;
      mass += record.weight;
      if (key.kind == RelationKind::kVisible)
        share += record.weight * facts_[n].visible[static_cast<std::size_t>(key.subject)];
      if (const auto inside = facts_[n].inside.find({key.subject, key.other}); inside != facts_[n].inside.end())
        share += record.weight * inside->second;
    }
    const simulation::ClassEstimate estimate = simulation::class_estimate(components, 0, asked_.query.confidence);
    belief::RelationProbability result;
    result.relation = key.kind;
    result.subject = belief::body_name(*asked_.prior.scene, key.subject);
    if (key.other >= 0) result.other = belief::body_name(*asked_.prior.scene, key.other);
    result.probability = estimate.probability;
    result.low = certain_ ? estimate.probability : estimate.low;
    result.high = certain_ ? estimate.probability : estimate.high;
    if (key.kind == RelationKind::kVisible || key.kind == RelationKind::kIn) result.share = share / mass;
    return result;
  }

  const Asked& asked_;
  const std::vector<simulation::InstanceRecord>& instances_;
  bool certain_;
  std::span<const DrawFacts> facts_;
  std::map<int, std::size_t> index_;
  std::vector<simulation::ComponentClasses> components_;
};

core::Result<belief::RelationsAnswer> relations_of(const Prior& prior, const RelationShapes& shapes,
                                                   const belief::RelationsQuery& query, const QueryContext& context) {
  PRESCENE_TRY(const std::vector<std::string> names, present_names(prior, query));
  PRESCENE_TRY(const std::optional<int> reach_body, reach_body_of(*prior.scene, query));
  const std::vector<simulation::StartSampler> samplers = simulation::samplers_of(prior.starts, prior.stream);
  const Vector3d up_W = belief::up_of(*prior.scene);
  const Asked asked{query, prior, shapes, up_W, reach_body, tolerances(prior, shapes, up_W, samplers)};

  // Long enough for every fall that counts, and some steps more.
  constexpr double kSteps = 0.02;
  const double g = prior.scene->gravity_W.norm();
  const double farthest = *std::ranges::max_element(asked.tolerance);
  const double window = kSteps + (g > 0.0 ? std::sqrt(2.0 * farthest / g) : 0.0);
  belief::Effort effort;
  effort.exact_instances = query.draws;
  const Prior still = stopped(prior);
  PRESCENE_TRY(const Foresight foresight,
               foresee(still, still.scene, window, effort, context, {.to_rest = true, .keep_contacts = true}));
  const std::vector<simulation::InstanceRecord>& instances = foresight.estimate.instances;
  if (!foresight.estimate.certain && static_cast<int>(instances.size()) < query.draws)
    return core::cancelled("stopped after " + std::to_string(instances.size()) + " of " + std::to_string(query.draws) +
                           " draws: ask for fewer");

  std::vector<DrawFacts> facts(instances.size());
  const double step = foresight.simulator->step_size();
  context.pool->for_blocks(instances.size(), kDrawsTogether, [&](std::size_t begin, std::size_t end) {
    collision::QueryScratch scratch;
    for (std::size_t n = begin; n < end; ++n) {
      const simulation::InstanceRecord& record = instances[n];
      if (record.failed || (context.abandoned && context.abandoned->requested())) continue;
      judge_contacts(asked, record, step, facts[n]);
      judge_draw(asked, samplers[static_cast<std::size_t>(record.component)].draw(record.point), scratch, facts[n]);
    }
  });
  if (context.abandoned && context.abandoned->requested())
    return core::cancelled("stopped before all draws were judged: ask for fewer");

  belief::RelationsAnswer answer;
  answer.draws = static_cast<int>(instances.size());
  answer.failed_draws = foresight.estimate.failed;
  for (std::size_t i = 0; i < names.size(); ++i)
    if (!query.object || *query.object == names[i])
      answer.objects.push_back({names[i], belief::TrackState::kUnseen, 1.0, std::nullopt, asked.tolerance[i]});
  Tally(asked, foresight, facts).fill(answer);
  if (!prior.scene->camera) answer.remarks.push_back("The scene has no camera: what is visible is not judged.");
  if (!(g > 0.0)) answer.remarks.push_back("The scene has no gravity: nothing is said to be on anything by weight.");
  if (answer.failed_draws > 0)
    answer.remarks.push_back(std::to_string(answer.failed_draws) + " of " + std::to_string(answer.draws) +
                             " draws failed in the simulator; the probabilities are those of the others.");
  if (foresight.estimate.certain)
    answer.remarks.push_back("Nothing in the scene is uncertain: one state of the world is enough.");
  return answer;
}

}  // namespace

core::Result<belief::RelationsAnswer> relations(const belief::Belief& snapshot, const belief::RelationsQuery& query,
                                                const QueryContext& context, KeptShapes& kept) {
  PRESCENE_RETURN_IF_ERROR(belief::validate({"", query}));
  const Prior prior = prior_of(snapshot);
  std::vector<std::pair<std::string, int>> objects;
  for (const belief::SceneObject& object : prior.scene->objects) objects.emplace_back(object.name, object.model);
  if (!kept.shapes || kept.scene != snapshot.scene || kept.objects != objects) {
    PRESCENE_TRY(kept.shapes, RelationShapes::make(*prior.scene, *context.pool));
    kept.scene = snapshot.scene;
    kept.objects = std::move(objects);
  }
  PRESCENE_TRY(belief::RelationsAnswer answer, relations_of(prior, *kept.shapes, query, context));
  for (belief::RelationsAnswer::Item& item : answer.objects) {
    const belief::ObjectBelief& object =
        snapshot.objects[static_cast<std::size_t>(*belief::find_object(snapshot, item.object))];
    item.state = object.state;
    item.existence = object.existence;
    item.effective_sample_size = belief::effective_sample_size(object.particles);
  }
  return answer;
}

core::Result<belief::RelationsAnswer> relations(const belief::Belief& snapshot, const belief::RelationsQuery& query,
                                                const QueryContext& context) {
  KeptShapes kept;
  return relations(snapshot, query, context, kept);
}

core::Result<belief::RelationsAnswer> relations(const std::shared_ptr<const belief::Scene>& scene, std::uint64_t seed,
                                                const belief::RelationsQuery& query, const QueryContext& context) {
  PRESCENE_RETURN_IF_ERROR(belief::validate({"", query}));
  const Prior prior = prior_of(scene, seed);
  PRESCENE_TRY(const RelationShapes shapes, RelationShapes::make(*prior.scene, *context.pool));
  return relations_of(prior, shapes, query, context);
}

}  // namespace prescene::queries
