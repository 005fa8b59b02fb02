// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/training/train_proposals.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "imagined_frame.h"
#include "learn_model.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/pose_error.h"

namespace prescene::service {
namespace {

using filter::FitNumbers;
using geometry::Vector3d;

constexpr int kSurfacePoints = 300;       // that ADD-S is the mean of
constexpr double kRight = 0.02;           // m of ADD-S ...
constexpr double kRightShare = 0.15;      // ... and of the model's diameter, whichever is less
constexpr double kFirstShare = 0.3;       // of the scenes, searched without a judge ...
constexpr double kConfidenceShare = 0.2;  // ... and with the last judge, for the confidence alone
constexpr std::size_t kBatch = 16;        // scenes between two looks at the cancellation
constexpr int kMostViews = 100'000, kMostPlaces = 1'000, kMostScenes = 100'000;
constexpr int kConfidenceSteps = 30;      // of Newton's method
constexpr double kConfidencePrior = 2.0;  // finds' worth of belief in the mean of both log odds

/// What a model is compared with the truth by.
struct Measure {
  geometry::AddsEvaluator evaluator;
  double right = 0.0;  ///< m
};

struct JudgedFind {
  double accepted = 0.0, at_end = 0.0;
  int model = 0;
  bool right = false;
  std::size_t of = 0;  ///< Index into the frame's truth, if right.
};

/// What one imagined frame teaches.
struct Lesson {
  core::Status status;
  std::vector<FitNumbers> candidates;
  std::vector<std::uint8_t> right;
  std::vector<JudgedFind> finds;
  std::vector<std::uint8_t> expected;  ///< Of each object that is there.
};

/// Searches as the filter's first step does.
class School {
 public:
  School(const belief::Scene& scene, const TrainingOptions& options, Backends& backends,
         const rendering::LikelihoodBatch& likelihood, rendering::Renderer& renderer)
      : scene_(scene), options_(options), backends_(backends), likelihood_(likelihood), renderer_(renderer) {
    for (const belief::ObjectModel& model : scene.models) {
      const geometry::TriangleMesh mesh = model.visual ? *model.visual : belief::collision_mesh(model);
      std::vector<Vector3d> points;
      for (const geometry::SurfacePoint& point : geometry::sample_surface(mesh, kSurfacePoints, 1))
        points.push_back(point.position);
      const auto drawn = meshes_.get(model.visual, model.collision, filter::MeshDetail::kLikelihood);
      measures_.push_back({geometry::AddsEvaluator(std::move(points)),
                           std::min(kRight, 2.0 * kRightShare * static_cast<double>(drawn->radius))});
      rests_.push_back(rests_of(model));
    }
  }

  filter::MeshCache& meshes() { return meshes_; }

  Lesson lesson(int number, const filter::LearnedProposals& learned) {
    Lesson lesson;
    const core::RandomStream stream(options_.seed, core::Purpose::kScenario, static_cast<std::uint64_t>(number) + 1);
    const auto frame = imagine_frame(scene_, rests_, backends_, renderer_, stream);
    if (!frame) {
      lesson.status = frame.status();
      return lesson;
    }
    for (const ImaginedObject& object : frame->truth) lesson.expected.push_back(object.expected ? 1 : 0);
    filter::DetectionTrace trace;
    lesson.status = search(*frame, learned, stream.for_purpose(core::Purpose::kDetection), trace);
    if (!lesson.status.ok()) return lesson;
    const geometry::Pose& X_WC = frame->observation.X_WC;
    for (const auto& candidate : trace.candidates) {
      lesson.candidates.push_back(candidate.numbers);
      lesson.right.push_back(which(*frame, candidate.model, X_WC * candidate.X_CO) < frame->truth.size() ? 1 : 0);
    }
    for (const auto& find : trace.finds) {
      const std::size_t of = which(*frame, find.model, X_WC * find.X_CO);
      lesson.finds.push_back({find.accepted_log_odds, find.final_log_odds, find.model, of < frame->truth.size(), of});
    }
    return lesson;
  }

 private:
  core::Status search(const ImaginedFrame& imagined, const filter::LearnedProposals& learned,
                      const core::RandomStream& stream, filter::DetectionTrace& trace) {
    filter::PoseSearch search(likelihood_, backends_.pool());
    const filter::FilterTools tools{&search, &renderer_, &meshes_, &learned};
    const filter::InitialiseOptions options;
    const filter::SegmentationOptions& segmentation = options.detection.segmentation;
    const belief::Observation& observation = imagined.observation;
    const filter::SampledDepth sampled =
        filter::sample_depth(*observation.frame.depth, observation.frame.camera, segmentation);
    auto scene = std::make_shared<belief::Scene>(*imagined.scene);
    const auto found = filter::supports_from_frame(sampled, observation.X_WC, *scene, options, meshes_, stream.at(1));
    scene->supports.insert(scene->supports.end(), found.begin(), found.end());
    filter::FilterFrame frame;
    filter::FrameCache cache;
    PRESCENE_RETURN_IF_ERROR(
        filter::prepare_frame(scene, observation, {}, {}, filter::FrameOptions{}, tools, cache, &frame));
    std::vector<filter::WantedModel> wanted;
    std::vector<int> models;
    for (const belief::SceneObject& object : scene->objects) {
      const auto known = std::find(models.begin(), models.end(), object.model);
      if (known != models.end()) {
        ++wanted[static_cast<std::size_t>(known - models.begin())].count;
        continue;
      }
      models.push_back(object.model);
      wanted.push_back({filter::target_of(scene->model_of(object), frame, tools), 1});
    }
    const filter::Surroundings surroundings =
        filter::surroundings_in(frame, sampled, *scene, wanted, segmentation, stream.at(2));
    filter::detect(frame.terms, frame.robot, sampled, surroundings, wanted, options.detection, tools, stream.at(3),
                   &trace);
    for (auto& candidate : trace.candidates) candidate.model = models[static_cast<std::size_t>(candidate.model)];
    for (auto& find : trace.finds) find.model = models[static_cast<std::size_t>(find.model)];
    return core::ok_status();
  }

  /// The object that this pose is right for; truth.size() if there is none.
  std::size_t which(const ImaginedFrame& frame, int model, const geometry::Pose& X_WO) const {
    const Measure& measure = measures_[static_cast<std::size_t>(model)];
    for (std::size_t i = 0; i < frame.truth.size(); ++i)
      if (frame.truth[i].model == model && measure.evaluator.adds(X_WO, frame.truth[i].X_WO) < measure.right) return i;
    return frame.truth.size();
  }

  const belief::Scene& scene_;
  const TrainingOptions& options_;
  Backends& backends_;
  const rendering::LikelihoodBatch& likelihood_;
  rendering::Renderer& renderer_;
  filter::MeshCache meshes_;
  std::vector<Measure> measures_;
  std::vector<std::vector<filter::LearnedRest>> rests_;
};

filter::BoostedTrees judge_from(const std::vector<Lesson>& lessons) {
  std::vector<float> values;
  std::vector<std::uint8_t> right;
  for (const Lesson& lesson : lessons)
    for (std::size_t i = 0; i < lesson.candidates.size(); ++i) {
      values.insert(values.end(), lesson.candidates[i].begin(), lesson.candidates[i].end());
      right.push_back(lesson.right[i]);
    }
  return filter::fit_boosted_trees(values, filter::kFitNumbers, right, {}, {});
}

/// Logistic regression of whether finds are right on their two log odds; a prior holds what few finds don't determine.
std::array<double, 3> confidence_from(const std::vector<Lesson>& lessons) {
  const Vector3d prior(0.0, 0.5, 0.5);
  Vector3d c = prior;
  for (int step = 0; step < kConfidenceSteps; ++step) {
    geometry::Matrix3d H = kConfidencePrior * geometry::Matrix3d::Identity();
    Vector3d g = -kConfidencePrior * (c - prior);
    for (const Lesson& lesson : lessons)
      for (const JudgedFind& find : lesson.finds) {
        const Vector3d x(1.0, find.at_end, find.accepted);
        const double p = 1.0 / (1.0 + std::exp(-c.dot(x)));
        g += ((find.right ? 1.0 : 0.0) - p) * x;
        H += p * (1.0 - p) * x * x.transpose();
      }
    const Vector3d d = geometry::solve_symmetric_3(H, g);
    if (!d.allFinite()) break;
    c += d;
  }
  return {c.x(), c.y(), c.z()};
}

TrainingCheck check_of(const std::vector<Lesson>& lessons, const std::array<double, 3>& c) {
  TrainingCheck check;
  for (const Lesson& lesson : lessons) {
    std::vector<std::uint8_t> found(lesson.expected.size(), 0);
    for (const JudgedFind& find : lesson.finds) {
      const double odds = c[0] + c[1] * find.at_end + c[2] * find.accepted;
      if (odds < 0.0) continue;
      ++check.reported;
      check.right += find.right ? 1 : 0;
      check.confidence += 1.0 / (1.0 + std::exp(-odds));
      if (find.right) found[find.of] = 1;
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
      check.expected += lesson.expected[i];
      check.found += lesson.expected[i] & found[i];
    }
  }
  check.confidence /= std::max(1, check.reported);
  return check;
}

core::Status check_options(const belief::Scene& scene, const TrainingOptions& options) {
  if (scene.models.empty())
    return core::invalid_input("the scene has no models to learn: list them under `models`, with their meshes");
  const auto in_range = [](const char* name, int value, int low, int high) {
    return value >= low && value <= high
               ? core::ok_status()
               : core::invalid_input(std::string(name) + " must be from " + std::to_string(low) + " to " +
                                     std::to_string(high) + ", not " + std::to_string(value));
  };
  PRESCENE_RETURN_IF_ERROR(in_range("views", options.views, 1, kMostViews));
  PRESCENE_RETURN_IF_ERROR(in_range("places", options.places, 1, kMostPlaces));
  return in_range("scenes", options.scenes, 0, kMostScenes);
}

}  // namespace

core::Result<TrainedProposals> train_proposals(const belief::Scene& scene, const TrainingOptions& options,
                                               Backends& backends, const core::ProgressSink& progress,
                                               const core::Cancellation* cancellation) {
  PRESCENE_RETURN_IF_ERROR(check_options(scene, options));
  PRESCENE_TRY(const auto likelihood, backends.make_likelihood());
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  const auto stopped = [&] { return cancellation != nullptr && cancellation->requested(); };
  core::Status stop = core::cancelled("stopped on request before the training was complete: nothing was learned");
  TrainedProposals trained;
  School school(scene, options, backends, *likelihood, *renderer);

  if (progress) progress({0.0, std::nullopt, "views of " + std::to_string(scene.models.size()) + " models"});
  std::vector<core::Result<filter::LearnedModel>> learned(scene.models.size(), core::cancelled(""));
  backends.pool().for_each_index(scene.models.size(), [&](std::size_t i) {
    const belief::ObjectModel& model = scene.models[i];
    const auto mesh = school.meshes().get(model.visual, model.collision, filter::MeshDetail::kLikelihood);
    learned[i] = learn_model(model, mesh, options.views, options.places, *renderer,
                             core::RandomStream(options.seed, core::Purpose::kSurface, i));
  });
  for (const auto& model : learned) {
    if (!model) return model.status();
    trained.patches += static_cast<int>(model->patches.size());
    trained.proposals.models.push_back(*model);
  }
  if (stopped()) return stop;

  const int first_end = static_cast<int>(std::lround(kFirstShare * options.scenes));
  const int judge_end = options.scenes - static_cast<int>(std::lround(kConfidenceShare * options.scenes));
  std::vector<Lesson> lessons;
  int next = 0;
  const auto learn_until = [&](int end, std::vector<Lesson>& into) -> core::Status {
    for (; next < end;) {
      if (stopped()) return stop;
      if (progress) progress({0.05 + 0.95 * next / options.scenes, std::nullopt, "imagined scenes"});
      const auto count = std::min(kBatch, static_cast<std::size_t>(end - next));
      std::vector<Lesson> batch(count);
      backends.pool().for_each_index(
          count, [&](std::size_t i) { batch[i] = school.lesson(next + static_cast<int>(i), trained.proposals); });
      for (Lesson& lesson : batch) {
        PRESCENE_RETURN_IF_ERROR(lesson.status);
        into.push_back(std::move(lesson));
      }
      next += static_cast<int>(count);
    }
    return core::ok_status();
  };
  if (options.scenes == 0) return trained;
  PRESCENE_RETURN_IF_ERROR(learn_until(first_end, lessons));
  trained.proposals.fit = judge_from(lessons);
  PRESCENE_RETURN_IF_ERROR(learn_until(judge_end, lessons));
  trained.proposals.fit = judge_from(lessons);
  for (const Lesson& lesson : lessons) {
    trained.candidates += static_cast<int>(lesson.candidates.size());
    trained.right_candidates += static_cast<int>(std::count(lesson.right.begin(), lesson.right.end(), 1));
  }
  std::vector<Lesson> last;
  PRESCENE_RETURN_IF_ERROR(learn_until(options.scenes, last));
  trained.proposals.confidence = confidence_from(last);
  trained.check = check_of(last, trained.proposals.confidence);
  return trained;
}

nlohmann::ordered_json to_json(const TrainedProposals& trained) {
  nlohmann::ordered_json json;
  json["models"] = nlohmann::ordered_json::array();
  for (const filter::LearnedModel& model : trained.proposals.models)
    json["models"].push_back({{"name", model.name}, {"places", model.patches.size()}, {"rests", model.rests.size()}});
  json["places"] = trained.patches;
  json["candidates"] = trained.candidates;
  json["right_candidates"] = trained.right_candidates;
  json["judged"] = !trained.proposals.fit.empty();
  const TrainingCheck& check = trained.check;
  json["check"] = {{"expected", check.expected},
                   {"found", check.found},
                   {"reported", check.reported},
                   {"right", check.right},
                   {"confidence", check.confidence}};
  return json;
}

}  // namespace prescene::service
