// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/credible_regions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "prescene/core/check.h"
#include "prescene/core/text.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/simd/simd_likelihood.h"
#include "prescene/service/evaluate/importance_sampling.h"
#include "prescene/service/evaluate/simulated_tabletop.h"

namespace prescene::service {
namespace {

using geometry::Matrix6d;
using geometry::Pose;
using geometry::Vector6d;
using rendering::FrameTerms;

constexpr double kFewestPixels = 5.0;
constexpr int kGaussNewtonSteps = 15;

/// Share of a six-dimensional Gaussian within a Mahalanobis distance of sqrt(squared).
double gaussian_mass(double squared) {
  const double half = 0.5 * squared;
  return 1.0 - std::exp(-half) * (1.0 + half + 0.5 * half * half);
}

/// Likelihood and prior of one object in one frame.
class Posterior {
 public:
  Posterior(const FrameTerms& terms, const TabletopObject& object, const rendering::LikelihoodBatch& batch,
            rendering::LikelihoodWorkspace& workspace)
      : terms_(terms), object_(object), batch_(batch), workspace_(workspace) {}

  rendering::PoseEvidence evidence(const Pose& X_CO) const {
    const rendering::PoseHypothesis h{object_.mesh.get(), X_CO, &material_};
    rendering::PoseEvidence evidence;
    batch_.evaluate(terms_, std::span(&h, 1), workspace_, std::span(&evidence, 1));
    return evidence;
  }

  rendering::PoseLinearisation linearised(const Pose& X_CO) const {
    const rendering::PoseHypothesis h{object_.mesh.get(), X_CO, &material_};
    rendering::PoseLinearisation equations;
    batch_.linearise(terms_, std::span(&h, 1), {}, workspace_, std::span(&equations, 1));
    return equations;
  }

  /// log of prior * exp(share * log ratio) at poses about `mean`.
  LogDensity log_density(const Pose& mean, const Matrix6d& prior_information, double share) const {
    return [this, mean, prior_information, share](std::span<const Vector6d> points, std::span<double> log_densities) {
      for (std::size_t i = 0; i < points.size(); ++i)
        log_densities[i] = share * evidence(geometry::box_plus(mean, points[i])).log_ratio -
                           0.5 * points[i].dot(prior_information * points[i]);
    };
  }

  /// What Gauss-Newton makes of the frame and the prior, from the true pose on: the mass of its Gaussian that is nearer
  /// to its mean than the truth.
  double ellipsoid_mass(const Pose& mean, const Pose& truth, const Matrix6d& prior_information, double share) const {
    Pose X_CO = truth;
    Matrix6d information = prior_information;
    for (int step = 0;; ++step) {
      const rendering::PoseLinearisation equations = linearised(X_CO);
      information = prior_information + share * equations.H;
      if (step == kGaussNewtonSteps) break;
      const Vector6d gradient = share * equations.g - prior_information * geometry::box_minus(X_CO, mean);
      const Vector6d d = geometry::Cholesky6(information).solve(gradient);
      X_CO = geometry::box_plus(X_CO, d);
    }
    const Vector6d off = geometry::box_minus(truth, X_CO);
    return gaussian_mass(off.dot(information * off));
  }

 private:
  const FrameTerms& terms_;
  const TabletopObject& object_;
  const rendering::LikelihoodBatch& batch_;
  rendering::LikelihoodWorkspace& workspace_;
  rendering::SurfaceMaterial material_;
};

core::Result<FrameTerms> terms_of(const TabletopFrame& frame, int width, const CredibleRegionOptions& options) {
  rendering::FrameTermsInput input;
  input.camera = frame.camera;
  input.depth = frame.depth.view();
  input.supports = std::span(&frame.table, 1);
  rendering::FrameTermsOptions terms_options;
  terms_options.target_width = width;
  terms_options.tempering = options.tempering;
  FrameTerms terms;
  PRESCENE_RETURN_IF_ERROR(make_frame_terms(input, terms_options, rendering::SensorModel(options.sensor), &terms));
  return terms;
}

/// A Gaussian about a pose that is off by a draw from it.
struct Prior {
  Prior(const Pose& truth, const Vector6d& normals, double turn, double shift) {
    Vector6d spread;
    spread << turn, turn, turn, shift, shift, shift;
    true_point = spread.cwiseProduct(normals);
    mean.rotation = truth.rotation * geometry::exp_rotation(-true_point.head<3>());
    mean.translation = truth.translation - true_point.tail<3>();
    information = spread.cwiseAbs2().cwiseInverse().asDiagonal();
  }

  Pose mean;
  Vector6d true_point;  ///< box_minus(truth, mean)
  Matrix6d information;
};

/// Measures one frame at one width.
void measure(const FrameTerms& terms, const Posterior& posterior, const Pose& truth, const Vector6d& off,
             const CredibleRegionOptions& options, core::RandomStream stream, FramePosterior* record) {
  const Prior prior(truth, off, options.prior_turn, options.prior_shift);
  const Prior prediction(truth, off, options.prediction_turn, options.prediction_shift);
  const rendering::PoseLinearisation equations = posterior.linearised(truth);
  for (const double factor : options.factors) {
    const double share =
        std::min(1.0, factor * rendering::tempering(terms.tempering.weight, record->pixels, terms.step));
    const LogDensity log_density = posterior.log_density(prior.mean, prior.information, share);
    ImportanceProposal start;
    start.mean = prior.true_point;
    start.covariance = geometry::Cholesky6(prior.information + share * equations.H).inverse();
    const ImportanceSamples samples = sample_by_importance(log_density, start, options.sampling, stream);
    double log_true = 0.0;
    log_density(std::span(&prior.true_point, 1), std::span(&log_true, 1));
    record->mass_above_truth.push_back(samples.mass_above(log_true));
    record->effective_samples.push_back(samples.effective);
    if (factor == 1.0) record->position_spread = std::sqrt(samples.fitted.covariance.bottomRightCorner<3, 3>().trace());

    const double information_share =
        std::min(1.0, factor * rendering::tempering(terms.tempering.information, record->pixels, terms.step));
    record->ellipsoid_mass.push_back(
        posterior.ellipsoid_mass(prediction.mean, truth, prediction.information, information_share));
  }
}

double share_within(const std::vector<const FramePosterior*>& frames, std::size_t factor, double region,
                    std::vector<double> FramePosterior::*masses) {
  const auto inside = std::count_if(frames.begin(), frames.end(),
                                    [&](const FramePosterior* f) { return (f->*masses)[factor] <= region; });
  return frames.empty() ? 0.0 : static_cast<double>(inside) / static_cast<double>(frames.size());
}

}  // namespace

core::Result<std::vector<FramePosterior>> frame_posteriors(const CredibleRegionOptions& options, std::uint64_t seed,
                                                           core::ThreadPool& threads,
                                                           const core::ProgressSink& progress,
                                                           const core::Cancellation* cancellation) {
  const std::vector<TabletopObject> objects = tabletop_objects();
  const auto renderer = rendering::make_reference_renderer();
  const auto batch = rendering::make_simd_likelihood_batch();
  const rendering::SimulatedCamera simulated(rendering::SensorModel(options.sensor), options.camera);
  const core::RandomStream stream(seed, core::Purpose::kEvaluation);
  rendering::WorkspacePool workspaces(*batch);

  const auto one_frame = [&](std::size_t index) -> core::Result<std::vector<FramePosterior>> {
    const std::size_t object = index % objects.size();
    const double distance = options.distances[index / objects.size() % options.distances.size()];
    PRESCENE_TRY(const TabletopFrame frame,
                 simulate_tabletop(objects[object], distance, index, simulated, *renderer, stream));
    core::RandomStream draws = stream.for_purpose(core::Purpose::kStartBelief).at(index);
    Vector6d off;
    for (int i = 0; i < 6; ++i) off[i] = draws.normal();

    const rendering::WorkspacePool::Loan workspace(workspaces);
    std::vector<FramePosterior> records;
    for (const int width : options.widths) {
      PRESCENE_TRY(const FrameTerms terms, terms_of(frame, width, options));
      const Posterior posterior(terms, objects[object], *batch, *workspace);
      FramePosterior record;
      record.object = static_cast<int>(object);
      record.distance = distance;
      record.width = width;
      record.step = terms.step;
      record.pixels = posterior.evidence(frame.X_CO).measured;
      if (record.pixels < kFewestPixels) return std::vector<FramePosterior>{};
      measure(terms, posterior, frame.X_CO, off, options,
              stream.for_purpose(core::Purpose::kProposal).at(index, static_cast<std::uint32_t>(width)), &record);
      records.push_back(std::move(record));
    }
    return records;
  };

  const auto count = static_cast<std::size_t>(options.frames);
  std::vector<core::Result<std::vector<FramePosterior>>> parts(count, std::vector<FramePosterior>{});
  constexpr std::size_t kBlock = 16;  // between two looks at the cancellation
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    if (cancellation != nullptr && cancellation->requested()) return core::cancelled("stopped on request");
    threads.for_each_index(std::min(kBlock, count - begin),
                           [&](std::size_t i) { parts[begin + i] = one_frame(begin + i); });
    if (progress) progress({static_cast<double>(begin) / static_cast<double>(count), std::nullopt, "frames"});
  }
  std::vector<FramePosterior> frames;
  for (core::Result<std::vector<FramePosterior>>& part : parts) {
    PRESCENE_RETURN_IF_ERROR(part.status());
    frames.insert(frames.end(), part->begin(), part->end());
  }
  return frames;
}

CredibleRegionReport coverage(const std::vector<FramePosterior>& frames, const std::vector<double>& factors) {
  CredibleRegionReport report;
  report.factors = factors;
  report.fewest_effective_samples = std::numeric_limits<double>::infinity();
  std::vector<std::string> order = {"all"};
  std::map<std::string, std::vector<const FramePosterior*>> groups;
  const auto add = [&](const std::string& group, const FramePosterior& frame) {
    if (std::find(order.begin(), order.end(), group) == order.end()) order.push_back(group);
    groups[group].push_back(&frame);
  };
  const std::vector<TabletopObject> objects = tabletop_objects();
  for (const FramePosterior& frame : frames) {
    add("all", frame);
    for (const double effective : frame.effective_samples)
      report.fewest_effective_samples = std::min(report.fewest_effective_samples, effective);
  }
  for (const FramePosterior& frame : frames) add(std::to_string(frame.width) + " px", frame);
  for (const FramePosterior& frame : frames) add(core::fixed_text(frame.distance, 1) + " m", frame);
  for (const FramePosterior& frame : frames) add(objects[static_cast<std::size_t>(frame.object)].name, frame);
  for (const std::string& group : order) {
    const std::vector<const FramePosterior*>& mine = groups[group];
    CoverageRow row;
    row.group = group;
    row.n = static_cast<int>(mine.size());
    for (const FramePosterior* frame : mine) row.pixels += frame->pixels / static_cast<double>(mine.size());
    for (std::size_t k = 0; k < factors.size(); ++k) {
      row.weights_90.push_back(share_within(mine, k, 0.9, &FramePosterior::mass_above_truth));
      row.weights_50.push_back(share_within(mine, k, 0.5, &FramePosterior::mass_above_truth));
      row.information_90.push_back(share_within(mine, k, 0.9, &FramePosterior::ellipsoid_mass));
      row.information_50.push_back(share_within(mine, k, 0.5, &FramePosterior::ellipsoid_mass));
    }
    report.rows.push_back(std::move(row));
  }
  return report;
}

nlohmann::ordered_json to_json(const CredibleRegionReport& report) {
  nlohmann::ordered_json json;
  json["factors"] = report.factors;
  json["fewest_effective_samples"] = report.fewest_effective_samples;
  json["rows"] = nlohmann::ordered_json::array();
  for (const CoverageRow& row : report.rows)
    json["rows"].push_back({{"group", row.group},
                            {"n", row.n},
                            {"pixels", row.pixels},
                            {"weights_90", row.weights_90},
                            {"weights_50", row.weights_50},
                            {"information_90", row.information_90},
                            {"information_50", row.information_50}});
  return json;
}

}  // namespace prescene::service
