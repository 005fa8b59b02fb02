// SPDX-License-Identifier: Apache-2.0
// Observation anticipation: Z*_t+1 ~ P(Z_t+1 | X_t+1), as the noise-free view of the predicted belief.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "basis.h"
#include "foresee.h"
#include "prescene/belief/robot_motion.h"
#include "prescene/rendering/surface_color.h"
#include "prescene/simulation/rules/action_draws.h"
#include "view.h"

namespace prescene::queries {
namespace {

/// Bytes of an answer: what clients take over the bus, with some room.
constexpr double kMostAnswerBytes = 48.0 * (1 << 20);
/// A mean is given of a pixel that shows something in at least this share of the states.
constexpr double kMostlyShown = 0.5;
/// What the duration of standing still is called, s.
constexpr double kNow = 1e-3;

/// Where the robot's bodies are `time` (s) after the start of one instance. Hands hold what they hold at this start as
/// it is there, and go with it where this instance's actions take it. What a hand grasps later it takes where the start
/// left it: only the ends of instances are kept.
std::vector<belief::Pose> robot_at(const Foresight& foresight, const belief::WorldState& start, std::uint32_t instance,
                                   const core::RandomStream& stream, double time) {
  const belief::Scene& scene = *foresight.scene;
  std::vector<belief::Action> actions = foresight.request.actions;
  const auto drawn = simulation::draw_actions(actions, stream.at(0, instance));
  for (std::size_t i = 0; i < actions.size(); ++i) simulation::fix_draws(drawn[i], actions[i]);
  std::vector<belief::Pose> X_WG;
  for (std::size_t i = 0; i < scene.robot.size(); ++i)
    X_WG.push_back(belief::robot_pose_at(scene, actions, {&start, {}}, static_cast<int>(i), start.time + time));
  return X_WG;
}

/// The view of now: nothing moves.
class StandingStill final : public simulation::Simulator {
 public:
  void run(std::span<const belief::WorldState> starts, const simulation::RunRequest&, const core::RandomStream&,
           simulation::InstanceNumbers, core::ThreadPool&, std::span<belief::Trajectory> trajectories,
           const core::Cancellation*) const override {
    for (std::size_t i = 0; i < starts.size(); ++i) {
      trajectories[i] = {};
      trajectories[i].states = {starts[i]};
    }
  }
  std::unique_ptr<simulation::Instance> make_instance(const std::vector<belief::Action>&,
                                                      const core::RandomStream&) const override {
    return nullptr;  // nothing here steps
  }
};

/// Of the answer in JSON, roughly.
double answer_bytes(const belief::ViewQuery& query, const geometry::PinholeCamera& camera, std::size_t objects) {
  const double length = query.compact ? 2.0 : 4.0, probability = query.compact ? 1.0 : 4.0;
  double a_pixel = length + probability + 2.0;
  if (query.detail.spread) a_pixel += 2.0 * length;
  if (query.detail.objects) a_pixel += probability * static_cast<double>(objects);
  if (query.detail.color) a_pixel += 3.0;
  return a_pixel * camera.width * camera.height * 4.0 / 3.0;
}

core::Status check_size(const belief::ViewQuery& query, const geometry::PinholeCamera& camera, std::size_t objects) {
  const double bytes = answer_bytes(query, camera, objects);
  if (bytes <= kMostAnswerBytes) return {};
  return core::resource_exhausted("the images would take " + std::to_string(std::lround(bytes / (1 << 20))) +
                                  " MiB, more than clients take: give smaller 'intrinsics', less 'detail', or "
                                  "\"compact\": true");
}

/// What a thing looks like, where that is known.
struct Look {
  std::string from;                      ///< As ViewAnswer::ColorSource.
  std::optional<geometry::Rgb> learned;  ///< Then in place of the model's.
};

/// The mean of what frames showed of it.
std::optional<geometry::Rgb> mean_color(const std::vector<belief::ColorShare>& shares) {
  constexpr int kBins = 16, kBinWidth = 16;
  rendering::LinearRgb sum = rendering::LinearRgb::Zero();
  double all = 0.0;
  for (const belief::ColorShare& share : shares) {
    const auto middle = [](int bin) { return static_cast<std::uint8_t>(bin * kBinWidth + kBinWidth / 2); };
    sum += share.object * rendering::linear({middle(share.bin / (kBins * kBins)), middle(share.bin / kBins % kBins),
                                             middle(share.bin % kBins)});
    all += share.object;
  }
  if (!(all > 0.0)) return std::nullopt;
  return rendering::srgb(sum / all);
}

/// A model whose colour is the default has none.
Look look_of(bool has_look, const belief::Color& color, const std::vector<belief::ColorShare>* learned) {
  if (has_look) return {"texture", {}};
  if (learned != nullptr)
    if (const auto mean = mean_color(*learned)) return {"learned", mean};
  return {color == belief::Color{} ? "" : "model", {}};
}

/// In the order of the instances of render_scene().
std::vector<Look> looks_of(const belief::Scene& scene, const Prior& prior) {
  std::vector<Look> looks;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const belief::ObjectModel& model = scene.model_of(scene.objects[i]);
    looks.push_back(look_of(model.look != nullptr, model.color, prior.colors[i].get()));
  }
  for (const belief::Support& support : scene.supports) looks.push_back(look_of(false, support.color, nullptr));
  for (const belief::KinematicBody& body : scene.robot) looks.push_back(look_of(false, body.color, nullptr));
  return looks;
}

/// Sums over states, pixel by pixel.
class ViewSums {
 public:
  ViewSums(const geometry::PinholeCamera& camera, const belief::ViewDetail& detail, std::size_t objects)
      : detail_(detail), width_(camera.width), height_(camera.height) {
    const std::size_t size = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    if (detail.spread) shown_.assign(size, 0.0), mean_ = squares_ = shown_;
    if (detail.color) colored_.assign(size, 0.0), colors_.assign(size, rendering::LinearRgb::Zero());
    if (detail.objects) objects_.assign(objects, geometry::Image<float>(width_, height_, 0.0F));
  }

  /// `thing_of`: of a label - 1, its index in `looks`, objects first.
  void add(const rendering::RenderedView& images, const std::vector<std::size_t>& thing_of,
           const std::vector<Look>& looks, double weight) {
    for (std::size_t p = 0; p < images.labels.size(); ++p) {
      const std::uint16_t label = images.labels.data()[p];
      if (label == 0) continue;
      const std::size_t thing = thing_of[label - 1U];
      if (detail_.spread) {  // West's weighted update
        shown_[p] += weight;
        const double off = images.depth.data()[p] - mean_[p];
        mean_[p] += weight / shown_[p] * off;
        squares_[p] += weight * off * (images.depth.data()[p] - mean_[p]);
      }
      if (detail_.objects && thing < objects_.size()) objects_[thing].data()[p] += static_cast<float>(weight);
      if (detail_.color && !looks[thing].from.empty()) {
        colored_[p] += weight;
        colors_[p] += weight * rendering::linear(images.color.data()[p]);
      }
    }
  }

  void put(const belief::Scene& scene, const Prior& prior, belief::ViewAnswer& answer) const {
    if (detail_.spread) {
      answer.mean_depth.emplace(width_, height_, 0.0F);
      answer.depth_deviation.emplace(width_, height_, 0.0F);
      for (std::size_t p = 0; p < shown_.size(); ++p) {
        if (shown_[p] < kMostlyShown) continue;
        answer.mean_depth->data()[p] = static_cast<float>(mean_[p]);
        answer.depth_deviation->data()[p] = static_cast<float>(std::sqrt(std::max(0.0, squares_[p] / shown_[p])));
      }
    }
    for (std::size_t i = 0; i < objects_.size(); ++i)
      answer.objects.push_back({scene.objects[i].name, prior.existence[i], objects_[i]});
    if (!detail_.color) return;
    geometry::ColorImage color(width_, height_);
    for (std::size_t p = 0; p < colored_.size(); ++p)
      if (colored_[p] >= kMostlyShown) color.data()[p] = rendering::srgb(colors_[p] / colored_[p]);
    answer.color = std::move(color);
  }

 private:
  belief::ViewDetail detail_;
  int width_, height_;
  std::vector<double> shown_, mean_, squares_, colored_;
  std::vector<rendering::LinearRgb> colors_;
  std::vector<geometry::Image<float>> objects_;
};

}  // namespace

core::Result<belief::ViewAnswer> view(const Prior& prior, const belief::ViewQuery& query, const QueryContext& context) {
  if (!prior.scene->camera && !(query.X_WC && query.intrinsics))
    return core::not_found(
        "the scene has no camera: give its intrinsics and pose in the scene file or in the question");
  if (!(query.time >= 0.0 && query.time <= 3600.0))
    return core::invalid_input("a time of " + std::to_string(query.time) + " s: give between 0 and 3600");
  if (!context.make_renderer) return core::unavailable("no renderer: this service was set up without one");
  const geometry::PinholeCamera camera = query.intrinsics ? *query.intrinsics : prior.scene->camera->intrinsics;
  const belief::Pose X_WC = query.X_WC.value_or(prior.X_WC);
  PRESCENE_RETURN_IF_ERROR(check_size(query, camera, prior.scene->objects.size()));
  PRESCENE_TRY(
      auto scene,
      with_question(*prior.scene, query.actions.empty() && !prior.seen ? prior.scene->actions : query.actions, {}, {}));
  // The robot goes on moving when everything else is at rest.
  auto moving = std::make_shared<belief::Scene>(*scene);
  moving->stop_at_rest = false;
  belief::Effort effort;
  effort.exact_instances = query.draws;
  QueryContext foreseen = context;
  if (query.time == 0.0) {
    foreseen.make_simulator = [](const belief::Scene&, double) -> core::Result<std::unique_ptr<simulation::Simulator>> {
      return std::unique_ptr<simulation::Simulator>(std::make_unique<StandingStill>());
    };
  }
  PRESCENE_TRY(const Foresight foresight,
               foresee(prior, std::move(moving), std::max(query.time, kNow), effort, foreseen));

  if (foresight.estimate.instances.size() < static_cast<std::size_t>(query.draws) && !foresight.estimate.certain)
    return core::cancelled("stopped when " + std::to_string(foresight.estimate.instances.size()) + " of " +
                           std::to_string(query.draws) + " views were foreseen: ask for an earlier time");
  belief::Trajectory likeliest;
  foresight.simulator->run(std::span(&prior.likeliest, 1), foresight.request, prior.stream, 0, *context.pool,
                           std::span(&likeliest, 1), context.cancellation);
  if (likeliest.end == belief::TrajectoryEnd::kCancelled)
    return core::cancelled("stopped before the view was foreseen");
  if (likeliest.end == belief::TrajectoryEnd::kDiverged)
    return core::invalid_input(
        "the likeliest start failed in the simulator: look at the scene's shapes, masses and speeds");

  PRESCENE_TRY(const std::unique_ptr<rendering::Renderer> renderer, context.make_renderer());
  filter::MeshCache own_meshes;
  filter::MeshCache& meshes = context.meshes != nullptr ? *context.meshes : own_meshes;
  const std::vector<Look> looks = looks_of(*foresight.scene, prior);
  rendering::RenderOptions options;
  options.color = query.detail.color;
  std::vector<std::size_t> thing_of;  // by label - 1
  /// `is_there`: by object; null = all are.
  const auto draw = [&](const belief::WorldState& state, const std::vector<belief::Pose>& X_WG,
                        const std::vector<char>* is_there, rendering::RenderedView* images) {
    filter::BeliefView drawn =
        filter::render_scene(*foresight.scene, state, X_WG, filter::MeshDetail::kDisplay, meshes);
    filter::BeliefView shown;
    thing_of.clear();
    for (std::size_t i = 0; i < drawn.names.size(); ++i) {
      if (is_there != nullptr && i < is_there->size() && (*is_there)[i] == 0) continue;
      if (looks[i].learned) drawn.scene.instances[i].material.color = *looks[i].learned;
      shown.scene.instances.push_back(drawn.scene.instances[i]);
      shown.names.push_back(drawn.names[i]);
      shown.kinds.push_back(drawn.kinds[i]);
      thing_of.push_back(i);
    }
    const core::Status status = renderer->render(shown.scene, camera, X_WC, options, images);
    return std::make_pair(std::move(shown), status);
  };

  belief::ViewAnswer answer;
  answer.presence = geometry::Image<float>(camera.width, camera.height, 0.0f);
  answer.compact = query.compact;
  answer.failed_instances = foresight.estimate.failed;
  if (answer.failed_instances > 0)
    answer.remarks.push_back(std::to_string(answer.failed_instances) + " of " +
                             std::to_string(foresight.estimate.instances.size()) +
                             " foreseen states failed in the simulator; presence is that of the others. Look at the "
                             "scene's shapes, masses and speeds.");
  remark_on_leaving(foresight.estimate, foresight.request.stop.world_radius, answer.remarks);
  double followed = 0.0;  // of the weights
  for (const simulation::InstanceRecord& record : foresight.estimate.instances)
    if (!record.failed) followed += record.weight;
  rendering::RenderedView images;
  ViewSums sums(camera, query.detail, foresight.scene->objects.size());
  std::vector<char> is_there(foresight.scene->objects.size(), 1);
  // What moves in one way only is one instance; whether things are there is still drawn as often as was asked.
  const bool may_be_absent = std::ranges::any_of(prior.existence, [](double existence) { return existence < 1.0; });
  const std::vector<simulation::StartSampler> samplers = simulation::samplers_of(prior.starts, prior.stream);
  const std::size_t instances = foresight.estimate.instances.size();
  const std::size_t asked = static_cast<std::size_t>(query.draws);
  const std::size_t rounds = may_be_absent && instances < asked ? asked / instances : 1;
  for (std::size_t n = 0; n < rounds * instances; ++n) {
    const simulation::InstanceRecord& record = foresight.estimate.instances[n % instances];
    if (record.failed) continue;
    if (context.cancellation && context.cancellation->requested())
      return core::cancelled("stopped before all views were drawn: give more time, or a smaller camera image");
    core::RandomStream chance = prior.stream.for_purpose(core::Purpose::kScenario).at(n);
    for (std::size_t i = 0; i < is_there.size(); ++i) is_there[i] = chance.uniform() < prior.existence[i] ? 1 : 0;
    const belief::WorldState start = samplers[static_cast<std::size_t>(record.component)].draw(record.point);
    const auto instance = static_cast<std::uint32_t>(n % instances);
    const std::vector<belief::Pose> X_WG = robot_at(foresight, start, instance, prior.stream, query.time);
    const auto [drawn, status] = draw(record.final, X_WG, &is_there, &images);
    PRESCENE_RETURN_IF_ERROR(status);
    const double share =
        (foresight.estimate.failed > 0 ? record.weight / followed : record.weight) / static_cast<double>(rounds);
    sums.add(images, thing_of, looks, share);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const std::uint16_t label = images.labels(x, y);
        if (label != 0 && drawn.kinds[label - 1u] == filter::InstanceKind::kObject)
          answer.presence(x, y) += static_cast<float>(share);
      }
    }
  }
  sums.put(*foresight.scene, prior, answer);
  options.color = false;
  const std::vector<belief::Pose> X_WG = robot_at(foresight, prior.likeliest, 0, prior.stream, query.time);
  const auto [drawn, status] = draw(likeliest.final(), X_WG, nullptr, &images);
  PRESCENE_RETURN_IF_ERROR(status);
  if (query.detail.color) {
    for (std::size_t i = 0; i < drawn.names.size(); ++i)
      answer.color_sources.push_back({drawn.names[i], looks[i].from});
    const bool any = std::ranges::any_of(looks, [](const Look& look) { return !look.from.empty(); });
    if (!any) {
      answer.color.reset();
      answer.remarks.push_back("No colour is known of anything here: give models a texture or a colour.");
    }
  }
  answer.label_names = drawn.names;
  answer.depth = std::move(images.depth);
  answer.labels = std::move(images.labels);
  return answer;
}

}  // namespace prescene::queries
