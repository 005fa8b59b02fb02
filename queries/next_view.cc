// SPDX-License-Identifier: Apache-2.0
#include "next_view.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

#include "imagined_states.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/queries/view_information.h"
#include "prescene/rendering/sensor/pixel_grid.h"

namespace prescene::queries {
namespace {

using belief::Pose;
using belief::ViewAbout;
using geometry::Vector3d;

constexpr double kFewestTemperingPixels = 12.0;  // as of the filter's weights
// The filter takes 80 x 60 pixels of usual cameras, and at most this many of one on its side. Of longer images the
// filter would take more: they are reduced further here.
constexpr std::int64_t kMostPixels = 4 * 80 * 60;
// Pixels compared with all images, of all candidates: about two minutes of one processor. The default number of draws
// with the most candidates takes a third of it.
constexpr double kMostComparisons = 4e9;
// A reduction of this share of the entropy is all that can be told of the hypotheses.
constexpr double kAllTold = 0.99;

/// Draws what a camera would see.
class ImageMaker {
 public:
  ImageMaker(const Prior& prior, const QueryContext& context, rendering::Renderer& renderer,
             const rendering::SensorModelOptions& sensor)
      : prior_(prior), meshes_(context.meshes != nullptr ? *context.meshes : own_meshes_), renderer_(renderer) {
    options_.near_depth = sensor.min_depth;
    options_.far_depth = sensor.max_depth;
    options_.normals = true;
    for (const belief::KinematicBody& body : prior.scene->robot) X_WG_.push_back(belief::pose_at(body, 0.0));
    for (const belief::SceneObject& object : prior.scene->objects) {
      const belief::ObjectModel& model = prior.scene->model_of(object);
      materials_.push_back(filter::material_of(model.surface, model.color));
    }
  }

  const std::vector<rendering::SurfaceMaterial>& materials() const { return materials_; }

  /// `covered` gets how many pixels show the object `of`.
  core::Result<ExpectedImage> image(const Imagined& imagined, const geometry::PinholeCamera& camera, const Pose& X_WC,
                                    std::size_t of, double* covered) {
    filter::BeliefView view =
        filter::render_scene(*prior_.scene, imagined.state, X_WG_, filter::MeshDetail::kLikelihood, meshes_);
    std::vector<int> object_of;  // by label - 1; -1 = surroundings
    rendering::RenderScene scene;
    for (std::size_t i = 0; i < view.scene.instances.size(); ++i) {
      const bool is_object = view.kinds[i] == filter::InstanceKind::kObject;
      if (is_object && imagined.is_there[i] == 0) continue;
      scene.instances.push_back(view.scene.instances[i]);
      object_of.push_back(is_object ? static_cast<int>(i) : -1);
    }
    return drawn(scene, object_of, camera, X_WC, of, covered);
  }

  core::Result<ExpectedImage> surroundings(const geometry::PinholeCamera& camera, const Pose& X_WC) {
    const filter::BeliefView view =
        filter::known_surroundings(*prior_.scene, X_WG_, filter::MeshDetail::kSurroundings, meshes_);
    return drawn(view.scene, std::vector<int>(view.scene.instances.size(), -1), camera, X_WC, 0, nullptr);
  }

 private:
  core::Result<ExpectedImage> drawn(const rendering::RenderScene& scene, const std::vector<int>& object_of,
                                    const geometry::PinholeCamera& camera, const Pose& X_WC, std::size_t of,
                                    double* covered) {
    PRESCENE_RETURN_IF_ERROR(renderer_.render(scene, camera, X_WC, options_, &images_));
    ExpectedImage image(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const std::uint16_t label = images_.labels(x, y);
        if (label == 0) continue;
        ExpectedSurface& surface = image(x, y);
        const int object = object_of[label - 1U];
        surface.kind = object < 0 ? ExpectedSurface::Kind::kSurroundings : ExpectedSurface::Kind::kObject;
        surface.depth = images_.depth(x, y);
        if (object < 0) continue;
        if (covered != nullptr && static_cast<std::size_t>(object) == of) *covered += 1.0;
        surface.thing = static_cast<std::uint16_t>(object);
        const Vector3d ray = camera.unproject(x, y, 1.0).normalized();
        surface.cosine = static_cast<float>(std::abs(images_.normals(x, y).cast<double>().dot(ray)));
        const auto differs = [&](int u, int v) {
          return u >= 0 && v >= 0 && u < camera.width && v < camera.height && images_.labels(u, v) != label;
        };
        surface.outline = differs(x - 1, y) || differs(x + 1, y) || differs(x, y - 1) || differs(x, y + 1);
      }
    }
    return image;
  }

  const Prior& prior_;
  filter::MeshCache own_meshes_;
  filter::MeshCache& meshes_;
  rendering::Renderer& renderer_;
  rendering::RenderOptions options_;
  rendering::RenderedView images_;
  std::vector<Pose> X_WG_;
  std::vector<rendering::SurfaceMaterial> materials_;
};

const char* what_is_asked(ViewAbout about) {
  switch (about) {
    case ViewAbout::kPlace:
      return "where it is";
    case ViewAbout::kPose:
      return "its pose";
    case ViewAbout::kExistence:
      break;
  }
  return "whether it is there";
}

/// What is drawn of a candidate.
struct ReducedCamera {
  geometry::PinholeCamera camera;
  int step = 1;  ///< Full-image pixels between two of its pixels.

  std::int64_t pixels() const { return std::int64_t{camera.width} * camera.height; }
};

/// As the filter's, unless its area is larger than that of any usual camera.
ReducedCamera reduced(const geometry::PinholeCamera& full) {
  ReducedCamera result;
  result.step = rendering::pixel_step(full.width, rendering::FrameTermsOptions{}.target_width);
  const auto at_step = [&] {
    result.camera = full.subsampled(result.step, rendering::pixel_offset(result.step, full.width, full.height));
    return result.pixels();
  };
  while (at_step() > kMostPixels) ++result.step;
  return result;
}

/// Memory of the largest candidate's images, and work for all candidates.
core::Status check_effort(const std::vector<ReducedCamera>& cameras, std::size_t images, std::size_t most_bytes) {
  std::int64_t most = 0, all = 0;
  for (const ReducedCamera& camera : cameras) {
    most = std::max(most, camera.pixels());
    all += camera.pixels();
  }
  const double count = static_cast<double>(images);
  const double bytes = count * (static_cast<double>(most) * sizeof(ExpectedSurface) + count * sizeof(double));
  if (bytes > static_cast<double>(most_bytes))
    return core::resource_exhausted(std::to_string(images) + " simulated images of " + std::to_string(most) +
                                    " pixels would take " + std::to_string(std::lround(bytes / (1 << 20))) +
                                    " MiB, and a question may take " + std::to_string(most_bytes >> 20) +
                                    ": ask for fewer 'draws', or give smaller 'intrinsics'");
  const double comparisons = static_cast<double>(all) * count * count;
  if (comparisons > kMostComparisons)
    return core::resource_exhausted(std::to_string(cameras.size()) + " candidates with " + std::to_string(images) +
                                    " simulated images each would take up to " +
                                    std::to_string(std::llround(comparisons / 1e6)) +
                                    " million comparisons of pixels, and a question may take " +
                                    std::to_string(std::llround(kMostComparisons / 1e6)) +
                                    " million: give fewer 'views', or ask for fewer 'draws'");
  return core::ok_status();
}

core::Status stopped_looking() {
  return core::cancelled("stopped before all candidates were looked at: give fewer, or fewer draws");
}

/// Sets any_tells and best_is_clear, each of which is wrong with probability `error` at most, and remarks on them.
void compare(const std::vector<ViewInformation>& informations, double error, belief::NextViewAnswer& answer) {
  const auto information = [&](std::size_t rank) -> const ViewInformation& {
    return informations[static_cast<std::size_t>(answer.views[rank].index)];
  };
  const auto clearly_above_zero = [&](std::span<const double> values, std::span<const double> weights, double range) {
    const MeanInterval mean = mean_interval(values, weights, error / static_cast<double>(informations.size()), range);
    return mean.mean - mean.half_width > 0.0;
  };
  const auto tells = [&](const ViewInformation& one) {
    return one.different_pixels > 0 && clearly_above_zero(one.values, one.weights, answer.entropy);
  };
  answer.any_tells = std::ranges::any_of(informations, tells);
  answer.best_is_clear = tells(information(0));
  if (answer.best_is_clear && answer.views.size() > 1) {
    // The same hypotheses and circumstances in both: differences scatter less than either.
    std::vector<double> differences;
    for (std::size_t i = 0; i < information(0).values.size(); ++i)
      differences.push_back(information(0).values[i] - information(1).values[i]);
    answer.best_is_clear = clearly_above_zero(differences, information(0).weights, 2.0 * answer.entropy);
  }
  if (!(answer.entropy > 0.0)) return;
  const std::string asked = what_is_asked(answer.about);
  if (std::ranges::all_of(informations, [](const ViewInformation& one) { return one.different_pixels == 0; }))
    answer.remarks.push_back("No candidate tells anything about " + asked + ".");
  else if (!answer.any_tells)
    answer.remarks.push_back("No candidate clearly tells anything about " + asked +
                             ": more draws may show whether one does.");
  const auto all_told = std::ranges::count_if(
      answer.views, [&](const auto& view) { return view.reduction >= kAllTold * answer.entropy; });
  if (answer.about == ViewAbout::kPose && all_told > 0)
    answer.remarks.push_back(
        "The first candidate tells all drawn poses apart, so that its reduction is bounded by their number: ask with "
        "more draws, or a coarser question, such as about place.");
  else if (all_told > 1)
    answer.remarks.push_back("The first " + std::to_string(all_told) + " candidates tell all there is to know about " +
                             asked + ": their order means nothing.");
}

}  // namespace

core::Result<belief::NextViewAnswer> next_view(const Prior& prior, const belief::NextViewQuery& query,
                                               const QueryContext& context,
                                               std::span<const belief::Particle> particles) {
  const std::optional<int> found = belief::find_object(*prior.scene, query.object);
  if (!found) return no_such_object(prior, query.object);
  const auto object = static_cast<std::size_t>(*found);
  if (!context.make_renderer) return core::unavailable("no renderer: this service was set up without one");
  for (std::size_t v = 0; v < query.views.size(); ++v)
    if (!query.views[v].intrinsics && !prior.scene->camera)
      return core::not_found("views[" + std::to_string(v) +
                             "]: the scene has no camera whose intrinsics could be taken: give 'intrinsics'");
  PRESCENE_TRY(const std::unique_ptr<rendering::Renderer> renderer, context.make_renderer());

  const rendering::SensorModel model(filter::with_settings({}, belief::depth_noise_of(*prior.scene, 0)));
  const Imagining imagining = imagine(prior, object, query, particles);
  belief::NextViewAnswer answer;
  answer.object = query.object;
  answer.about = query.about;
  answer.hypotheses = imagining.hypotheses;
  answer.entropy = entropy_of(imagining.probabilities);
  answer.draws = static_cast<int>(imagining.states.size());
  if (!(answer.entropy > 0.0))
    answer.remarks.push_back(std::string("The belief has no doubt about ") + what_is_asked(query.about) +
                             ": no view can tell more.");
  std::vector<ReducedCamera> cameras;
  for (const belief::CandidateView& view : query.views)
    cameras.push_back(reduced(view.intrinsics ? *view.intrinsics : prior.scene->camera->intrinsics));
  PRESCENE_RETURN_IF_ERROR(check_effort(cameras, imagining.states.size(), context.most_bytes));
  ImageMaker maker(prior, context, *renderer, model.options());
  std::vector<ViewInformation> informations;
  for (std::size_t v = 0; v < query.views.size(); ++v) {
    const belief::CandidateView& view = query.views[v];
    const auto& [camera, step] = cameras[v];
    std::vector<ExpectedImage> images;
    double visible = 0.0, there = 0.0;
    for (std::size_t i = 0; i < imagining.states.size(); ++i) {
      if (context.cancellation && context.cancellation->requested()) return stopped_looking();
      double covered = 0.0;
      PRESCENE_TRY(ExpectedImage image, maker.image(imagining.states[i], camera, view.X_WC, object, &covered));
      images.push_back(std::move(image));
      if (imagining.states[i].is_there[object] == 0) continue;
      const double weight = imagining.probabilities[i / imagining.circumstances];
      visible += weight * covered;
      there += weight;
    }
    if (there > 0.0) visible /= there;
    PRESCENE_TRY(const ExpectedImage surroundings, maker.surroundings(camera, view.X_WC));
    const double tempering =
        rendering::tempering(rendering::TemperingOptions{}.weight, std::max(kFewestTemperingPixels, visible), step);
    std::optional<ViewInformation> told =
        information_of({imagining.probabilities, static_cast<int>(imagining.circumstances), images, maker.materials(),
                        &surroundings, tempering, step},
                       model, prior.stream.for_purpose(core::Purpose::kSensorNoise), 1.0 - query.confidence,
                       *context.pool, context.cancellation);
    if (!told) return stopped_looking();
    informations.push_back(*std::move(told));
    const ViewInformation& information = informations.back();
    answer.views.push_back({view.name, static_cast<int>(v), information.reduction, information.low, information.high,
                            static_cast<int>(std::lround(visible)), information.different_pixels});
    if (context.progress)
      context.progress({static_cast<double>(v + 1) / static_cast<double>(query.views.size()), std::nullopt,
                        std::to_string(v + 1) + " of " + std::to_string(query.views.size()) + " candidates looked at"});
  }
  std::ranges::stable_sort(answer.views, std::ranges::greater(), &belief::NextViewAnswer::View::reduction);
  compare(informations, 1.0 - query.confidence, answer);
  return answer;
}

core::Result<belief::NextViewAnswer> next_view(const belief::Belief& belief, const belief::NextViewQuery& query,
                                               const QueryContext& context) {
  const std::optional<int> index = belief::find_object(belief, query.object);
  if (!index || belief.objects[static_cast<std::size_t>(*index)].particles.empty())
    return next_view(prior_of(belief), query, context);
  // What is lost or probably not there takes no part otherwise; where to look for it is a question all the same.
  belief::Belief asked = belief;
  belief::ObjectBelief& object = asked.objects[static_cast<std::size_t>(*index)];
  const double existence = object.existence;
  const bool was_lost = object.state == belief::TrackState::kLost;
  if (!filter::is_present(object)) {
    object.existence = 1.0;
    object.state = belief::TrackState::kTracked;
  }
  Prior prior = prior_of(asked);
  if (const auto found = belief::find_object(*prior.scene, query.object))
    prior.existence[static_cast<std::size_t>(*found)] = existence;
  core::Result<belief::NextViewAnswer> answer = next_view(prior, query, context, object.particles);
  if (answer && was_lost)
    answer->remarks.push_back("'" + query.object + "' is lost: the poses are those where it was seen last.");
  return answer;
}

}  // namespace prescene::queries
