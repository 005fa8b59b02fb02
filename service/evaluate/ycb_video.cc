// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/ycb_video.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/core/clock.h"
#include "prescene/filter/proposals/detection.h"
#include "prescene/filter/proposals/fine_frame.h"
#include "prescene/filter/proposals/pose_search.h"
#include "prescene/geometry/pose_error.h"
#include "prescene/geometry/sampling.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/service/evaluate/pose_auc.h"
#include "prescene/service/evaluate/ycb_data.h"

namespace prescene::service {
namespace {

namespace fs = std::filesystem;
using geometry::Pose;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kGood = 0.02;         // m: the usual threshold of success
constexpr double kLabelPixels = 6.0;   // K of the tempering when poses are judged against hand-made labels
constexpr double kStartShift = 0.029;  // m per axis: 5 cm in all
constexpr double kStartTurn = 0.30;    // rad per axis: 30 degrees in all

/// A model to look for, and what its errors are measured with.
struct Model {
  filter::SearchTarget target;
  std::unique_ptr<geometry::AddsEvaluator> errors;
};

/// Frames, models and the tools of a search.
class Bench {
 public:
  Bench(std::unique_ptr<rendering::LikelihoodBatch> batch, core::ThreadPool& threads)
      : batch_(std::move(batch)),
        renderer_(rendering::make_reference_renderer()),
        search_(*batch_, threads),
        tools_{&search_, renderer_.get(), &meshes_} {}

  core::Status load(const fs::path& dir) {
    PRESCENE_TRY(frames_, read_ycb_frames(dir));
    for (const YcbFrame& frame : frames_)
      for (const YcbObject& object : frame.objects) {
        if (models_.count(object.name) != 0) continue;
        PRESCENE_TRY(geometry::TriangleMesh mesh, read_ycb_mesh(dir, object.name));
        PRESCENE_TRY(std::vector<geometry::Vector3d> points, read_ycb_points(dir, object.name));
        Model& model = models_[object.name];
        model.target.mesh = meshes_.get(std::make_shared<const geometry::TriangleMesh>(std::move(mesh)),
                                        filter::MeshDetail::kLikelihood);
        model.errors = std::make_unique<geometry::AddsEvaluator>(std::move(points));
      }
    return core::ok_status();
  }

  const std::vector<YcbFrame>& frames() const { return frames_; }
  const Model& model(const std::string& name) const { return models_.at(name); }
  filter::PoseSearch& search() { return search_; }
  const filter::FilterTools& tools() const { return tools_; }

 private:
  std::vector<YcbFrame> frames_;
  std::map<std::string, Model> models_;
  filter::MeshCache meshes_;
  std::unique_ptr<rendering::LikelihoodBatch> batch_;
  std::unique_ptr<rendering::Renderer> renderer_;
  filter::PoseSearch search_;
  filter::FilterTools tools_;
};

/// What is known of a frame before any object is looked for: its support plane, found in the depth image.
struct PreparedFrame {
  filter::SampledDepth sampled;
  filter::Surroundings surroundings;
  rendering::FrameTerms terms;
  filter::FineFrame fine;
};

/// `least_area` of a support, m^2.
core::Status prepare(const YcbFrame& frame, double least_area, const core::RandomStream& stream,
                     PreparedFrame* prepared) {
  const filter::SegmentationOptions segmentation;
  prepared->sampled = filter::sample_depth(frame.depth, frame.camera, segmentation);
  const auto plane = filter::find_support_plane(prepared->sampled, segmentation, stream);
  if (!plane) return core::data_loss(frame.name + ": no support plane in the depth image");
  const geometry::Vector3d up = plane->region.plane_C.normal;
  const auto patches = filter::find_flat_patches(prepared->sampled, up, {}, least_area, segmentation, stream);
  std::vector<rendering::SupportRegion> supports = {plane->region};
  for (const filter::FlatPatch& patch : patches)
    if (patch.level && patch.large) supports.push_back(patch.region);
  prepared->surroundings =
      filter::surroundings_of(prepared->sampled, Pose::identity(), up, {}, {}, {}, patches, segmentation);
  rendering::FrameTermsInput input;
  input.camera = frame.camera;
  input.depth = frame.depth.view();
  input.supports = supports;
  rendering::FrameTermsOptions options;
  options.tempering.weight.effective_pixels = kLabelPixels;
  PRESCENE_RETURN_IF_ERROR(make_frame_terms(input, options, rendering::SensorModel(), &prepared->terms));
  prepared->fine.smear = filter::measure_edge_smear(frame.depth, &frame.color);
  options.target_width = filter::kFineWidth;
  return make_frame_terms(input, options, rendering::SensorModel(), &prepared->fine.terms);
}

std::vector<filter::WantedModel> wanted_in(const YcbFrame& frame, const Bench& bench) {
  std::vector<filter::WantedModel> wanted;
  for (const YcbObject& object : frame.objects) wanted.push_back({bench.model(object.name).target, 1});
  return wanted;
}

void report_progress(const core::ProgressSink& sink, double fraction, const std::string& text) {
  if (sink) sink({fraction, std::nullopt, text});
}

core::Status check_going_on(const core::Cancellation* cancellation) {
  return cancellation != nullptr && cancellation->requested() ? core::cancelled("stopped on request")
                                                              : core::ok_status();
}

/// Medians and shares over all runs and per object.
void summarise(const std::vector<double>& adds, const std::vector<double>& add, YcbSection& section) {
  section.n = static_cast<int>(adds.size());
  section.share_adds_below_2cm = share_below(adds, kGood);
  section.share_add_below_2cm = share_below(add, kGood);
  section.median_adds_m = median_of(adds);
  section.median_add_m = median_of(add);
}

/// The pose turned about its object's centre and shifted by exactly so much.
Pose disturbed(const Pose& X_CO, const geometry::Vector3d& p_OQ, const YcbOptions& options,
               core::RandomStream& stream) {
  geometry::Vector6d d;
  d.tail<3>() = options.shift * geometry::uniform_direction(stream);
  d.head<3>() = options.turn * geometry::uniform_direction(stream);
  return filter::moved_about(X_CO, p_OQ, d);
}

}  // namespace

core::Result<YcbSection> evaluate_disturbed(const fs::path& dir, std::uint64_t seed, core::ThreadPool& threads,
                                            const YcbOptions& options, const core::ProgressSink& progress,
                                            const core::Cancellation* cancellation) {
  PRESCENE_TRY(auto batch, rendering::make_likelihood_batch(options.likelihood));
  Bench bench(std::move(batch), threads);
  PRESCENE_RETURN_IF_ERROR(bench.load(dir));
  const core::RandomStream stream(seed, core::Purpose::kEvaluation);
  YcbSection section;
  std::vector<double> all_adds, all_add;
  double seconds = 0.0;
  std::uint64_t instance = 0;
  for (std::size_t f = 0; f < bench.frames().size(); ++f) {
    const YcbFrame& frame = bench.frames()[f];
    PreparedFrame prepared;
    PRESCENE_RETURN_IF_ERROR(prepare(frame, filter::least_support_area(wanted_in(frame, bench)),
                                     stream.for_purpose(core::Purpose::kDetection).at(f), &prepared));
    for (const YcbObject& object : frame.objects) {
      const Model& model = bench.model(object.name);
      std::vector<double> adds, add;
      for (int draw = 0; draw < options.draws; ++draw) {
        PRESCENE_RETURN_IF_ERROR(check_going_on(cancellation));
        core::RandomStream mine = stream.at(instance, static_cast<std::uint32_t>(draw));
        const Pose start = disturbed(object.X_CO, model.target.centre(), options, mine);
        const core::Stopwatch watch;
        const core::RandomStream proposals = mine.for_purpose(core::Purpose::kProposal);
        const auto starts =
            filter::disturbed_starts(start, model.target.centre(), kStartShift, kStartTurn, options.starts, proposals);
        const auto found = bench.search().run(prepared.terms, model.target, starts, {}, proposals);
        seconds += watch.seconds();
        adds.push_back(model.errors->adds(found.front().X_CO, object.X_CO));
        add.push_back(model.errors->add(found.front().X_CO, object.X_CO));
      }
      section.objects.push_back(
          {frame.name, object.name, options.draws, share_below(adds, kGood), median_of(adds), median_of(add), false});
      all_adds.insert(all_adds.end(), adds.begin(), adds.end());
      all_add.insert(all_add.end(), add.begin(), add.end());
      ++instance;
      report_progress(progress, static_cast<double>(f) / static_cast<double>(bench.frames().size()), object.name);
    }
  }
  summarise(all_adds, all_add, section);
  section.ms_per_object = 1e3 * seconds / std::max(1, section.n);
  return section;
}

core::Result<YcbSection> evaluate_amortised(const fs::path& dir, std::uint64_t seed, core::ThreadPool& threads,
                                            const YcbOptions& options, const core::ProgressSink& progress,
                                            const core::Cancellation* cancellation) {
  PRESCENE_TRY(auto batch, rendering::make_likelihood_batch(options.likelihood));
  Bench bench(std::move(batch), threads);
  PRESCENE_RETURN_IF_ERROR(bench.load(dir));
  const core::RandomStream stream(seed, core::Purpose::kEvaluation);
  YcbSection section;
  std::vector<double> all_adds, all_add;
  double seconds = 0.0;
  for (std::size_t f = 0; f < bench.frames().size(); ++f) {
    const YcbFrame& frame = bench.frames()[f];
    PRESCENE_RETURN_IF_ERROR(check_going_on(cancellation));
    report_progress(progress, static_cast<double>(f) / static_cast<double>(bench.frames().size()), frame.name);
    const core::Stopwatch watch;
    PreparedFrame prepared;
    const core::RandomStream mine = stream.for_purpose(core::Purpose::kDetection).at(f);
    const std::vector<filter::WantedModel> wanted = wanted_in(frame, bench);
    PRESCENE_RETURN_IF_ERROR(prepare(frame, filter::least_support_area(wanted), mine, &prepared));
    const std::vector<filter::Detection> found = filter::detect(prepared.terms, prepared.fine, {}, prepared.sampled,
                                                                prepared.surroundings, wanted, {}, bench.tools(), mine);
    seconds += watch.seconds();
    for (std::size_t i = 0; i < frame.objects.size(); ++i) {
      const YcbObject& object = frame.objects[i];
      const Model& model = bench.model(object.name);
      double adds = kInfinity, add = kInfinity;
      for (const filter::Detection& detection : found) {
        if (detection.model != static_cast<int>(i)) continue;
        adds = model.errors->adds(detection.X_CO, object.X_CO);
        add = model.errors->add(detection.X_CO, object.X_CO);
        if (adds >= kGood) ++section.false_detections;
      }
      const bool right = adds < kGood;
      section.found += right;
      section.objects.push_back({frame.name, object.name, 1, right ? 1.0 : 0.0, adds, add, right});
      all_adds.push_back(adds);
      all_add.push_back(add);
    }
  }
  summarise(all_adds, all_add, section);
  section.ms_per_object = 1e3 * seconds / std::max(1, section.n);
  return section;
}

core::Result<std::vector<YcbAucRow>> evaluate_auc(const fs::path& dir, core::ThreadPool& threads,
                                                  const core::ProgressSink& progress,
                                                  const core::Cancellation* cancellation) {
  PRESCENE_TRY(const std::vector<YcbExpectedAuc> expected, read_expected_auc(dir));
  PRESCENE_TRY(const std::vector<std::string> tracks, list_ycb_tracks(dir));
  std::map<std::string, std::unique_ptr<geometry::AddsEvaluator>> evaluators;
  std::map<std::string, YcbTrack> truths;
  for (const std::string& track : tracks) {
    PRESCENE_TRY(truths[track], read_ycb_track(dir / "eval" / "ground_truth" / track));
    auto& evaluator = evaluators[object_of_track(track)];
    if (evaluator) continue;
    PRESCENE_TRY(std::vector<geometry::Vector3d> points, read_ycb_points(dir, object_of_track(track)));
    evaluator = std::make_unique<geometry::AddsEvaluator>(std::move(points));
  }
  /// Errors of one method and object (or of all).
  struct Errors {
    std::vector<double> add, adds;
  };
  std::map<std::pair<std::string, std::string>, Errors> errors;
  std::vector<std::string> methods;
  for (const YcbExpectedAuc& row : expected)
    if (std::find(methods.begin(), methods.end(), row.method) == methods.end()) methods.push_back(row.method);
  double done = 0.0;
  for (const std::string& method : methods)
    for (const std::string& track : tracks) {
      PRESCENE_RETURN_IF_ERROR(check_going_on(cancellation));
      report_progress(progress, done++ / static_cast<double>(methods.size() * tracks.size()), method + " " + track);
      const fs::path file = dir / "eval" / method / track;
      PRESCENE_TRY(const YcbTrack estimates, read_ycb_track(file));
      const YcbTrack& truth = truths.at(track);
      if (estimates.size() != truth.size())
        return core::invalid_input(file.string() + ": " + std::to_string(estimates.size()) +
                                   " poses, the ground truth has " + std::to_string(truth.size()));
      const geometry::AddsEvaluator& evaluator = *evaluators.at(object_of_track(track));
      Errors mine{std::vector<double>(truth.size(), kInfinity), std::vector<double>(truth.size(), kInfinity)};
      threads.for_blocks(truth.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          if (!estimates[i] || !truth[i]) continue;
          mine.add[i] = evaluator.add(*estimates[i], *truth[i]);
          mine.adds[i] = evaluator.adds(*estimates[i], *truth[i]);
        }
      });
      for (const std::string& object : {object_of_track(track), std::string("ALL")}) {
        Errors& sum = errors[{method, object}];
        sum.add.insert(sum.add.end(), mine.add.begin(), mine.add.end());
        sum.adds.insert(sum.adds.end(), mine.adds.begin(), mine.adds.end());
      }
    }
  std::vector<YcbAucRow> rows;
  for (const YcbExpectedAuc& row : expected) {
    const auto found = errors.find({row.method, row.object});
    if (found == errors.end())
      return core::invalid_input("eval/expected_auc.csv: no poses of " + row.method + ", " + row.object);
    rows.push_back({row.method, row.object, 100.0 * stepwise_auc(found->second.add),
                    100.0 * stepwise_auc(found->second.adds), row.add, row.adds});
  }
  return rows;
}

core::Result<YcbReport> evaluate_ycb_video(const fs::path& dir, std::uint64_t seed, core::ThreadPool& threads,
                                           const core::ProgressSink& progress, const core::Cancellation* cancellation,
                                           const YcbOptions& options) {
  YcbReport report;
  const auto part = [&](double begin, double end, const char* name) -> core::ProgressSink {
    if (!progress) return {};
    return [&progress, begin, end, name](const core::Progress& p) {
      progress({begin + (end - begin) * p.fraction, std::nullopt, std::string(name) + ": " + p.text});
    };
  };
  PRESCENE_TRY(report.disturbed,
               evaluate_disturbed(dir, seed, threads, options, part(0.0, 0.2, "disturbed"), cancellation));
  PRESCENE_TRY(report.amortised,
               evaluate_amortised(dir, seed, threads, options, part(0.2, 0.3, "amortised"), cancellation));
  if (options.auc) {
    PRESCENE_TRY(report.auc, evaluate_auc(dir, threads, part(0.3, 1.0, "evaluator"), cancellation));
  }
  report_progress(progress, 1.0, "done");
  return report;
}

namespace {

nlohmann::ordered_json finite_or_null(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

nlohmann::ordered_json section_json(const YcbSection& section, bool amortised) {
  nlohmann::ordered_json json;
  json["n"] = section.n;
  json["share_adds_below_2cm"] = section.share_adds_below_2cm;
  json["share_add_below_2cm"] = section.share_add_below_2cm;
  json["median_adds_m"] = finite_or_null(section.median_adds_m);
  json["median_add_m"] = finite_or_null(section.median_add_m);
  json["ms_per_object"] = section.ms_per_object;
  if (amortised) {
    json["found"] = section.found;
    json["false"] = section.false_detections;
  }
  json["objects"] = nlohmann::ordered_json::array();
  for (const YcbObjectScore& object : section.objects)
    json["objects"].push_back({{"frame", object.frame},
                               {"object", object.object},
                               {"n", object.n},
                               {"share_adds_below_2cm", object.share_adds_below_2cm},
                               {"median_adds_m", finite_or_null(object.median_adds_m)},
                               {"median_add_m", finite_or_null(object.median_add_m)}});
  return json;
}

}  // namespace

nlohmann::ordered_json to_json(const YcbReport& report) {
  nlohmann::ordered_json json = section_json(report.disturbed, false);
  json["disturbed"] = section_json(report.disturbed, false);
  json["amortised"] = section_json(report.amortised, true);
  json["auc"] = nlohmann::ordered_json::array();
  for (const YcbAucRow& row : report.auc)
    json["auc"].push_back({{"method", row.method},
                           {"object", row.object},
                           {"add", row.add},
                           {"adds", row.adds},
                           {"expected_add", row.expected_add},
                           {"expected_adds", row.expected_adds}});
  return json;
}

}  // namespace prescene::service
