// SPDX-License-Identifier: Apache-2.0
// What weighing poses by a coarser mesh changes: the posterior over the six numbers of a pose, from a simulated frame
// and a prior, by the original surface and by a level of detail.
//
// Errors at outlines and facets make single weights jump about; what they do to the posterior is how much mass they
// move. The total variation of the distribution of each of the six coordinates, in cells of half a standard deviation,
// is held to 0.05 on average over frames. The total variation over the drawn poses themselves, where jumps between
// neighbours do not cancel, is larger, and bounded, too.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "fine_shapes.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "prescene/rendering/simd/simd_likelihood.h"

namespace prescene::rendering::detail_posterior_statistics_test {
namespace {

using geometry::Matrix6d;
using geometry::Pose;
using geometry::Vector3d;
using geometry::Vector6d;

constexpr int kRounds = 4;  // in which the proposal is fitted
constexpr int kPoses = 2500;
constexpr int kFrames = 4;
constexpr double kPriorTurn = 0.15;    // rad per axis
constexpr double kPriorShift = 0.015;  // m per axis

/// A thing before a wall, as a simulated camera sees it.
struct Frame {
  Frame(const MeshHandle& mesh, double distance, int width, std::uint64_t index) {
    core::RandomStream draws(41, core::Purpose::kTest, index);
    truth.rotation = geometry::uniform_rotation(draws);
    const Vector3d centre(0.1 * draws.uniform(-1.0, 1.0), 0.1 * draws.uniform(-1.0, 1.0), distance);
    truth.translation = centre - truth.rotation * mesh->centre.cast<double>();
    const geometry::PinholeCamera camera = {640, 480, 570.0, 570.0, 319.5, 239.5};
    RenderScene scene;
    const MeshHandle wall = make_render_mesh(geometry::make_mesh(geometry::BoxShape{{6.0, 6.0, 0.1}}));
    const double behind = distance + 0.35;
    scene.instances = {{mesh, truth, material}, {wall, Pose::from_translation({0.0, 0.0, behind + 0.05}), material}};
    RenderOptions options;
    options.normals = true;
    RenderedView view;
    EXPECT_TRUE(make_reference_renderer()->render(scene, camera, Pose::identity(), options, &view).ok());
    geometry::DepthImage depth;
    SimulatedCamera(SensorModel{}, {})
        .sample(scene, view, nullptr, camera, Pose::identity(), draws.for_purpose(core::Purpose::kSensorNoise), index,
                &depth, nullptr);
    const SupportRegion support = {{Vector3d(0.0, 0.0, -1.0), behind}, {}};
    FrameTermsInput input;
    input.camera = camera;
    input.depth = depth.view();
    input.supports = std::span(&support, 1);
    FrameTermsOptions terms_options;
    terms_options.target_width = width;
    EXPECT_TRUE(make_frame_terms(input, terms_options, SensorModel{}, &terms).ok());
  }

  SurfaceMaterial material;
  Pose truth;
  FrameTerms terms;
};

/// Poses drawn about the truth with importance weights, made by one mesh and weighed again by others.
class Posterior {
 public:
  Posterior(const Frame& frame, const RenderMesh& mesh) : frame_(frame), workspace_(batch_->make_workspace()) {
    const PoseHypothesis h{&mesh, frame.truth, &frame.material};
    PoseLinearisation equations;
    batch_->linearise(frame.terms, std::span(&h, 1), {.with_evidence = true}, *workspace_, std::span(&equations, 1));
    pixels_ = equations.evidence.measured;
    prior_.diagonal().head<3>().setConstant(1.0 / (kPriorTurn * kPriorTurn));
    prior_.diagonal().tail<3>().setConstant(1.0 / (kPriorShift * kPriorShift));
    const double share = tempering(frame.terms.tempering.weight, pixels_, frame.terms.step);
    covariance_ = (prior_ + share * equations.H).inverse();
    core::RandomStream stream(43, core::Purpose::kTest);
    for (int round = 0; round < kRounds; ++round) {
      draw(stream);
      weights_ = weights_of(mesh);
      mean_.setZero();
      for (std::size_t i = 0; i < points_.size(); ++i) mean_ += weights_[i] * points_[i];
      // The last proposal stays: its draws are what is compared.
      if (round + 1 == kRounds) break;
      Matrix6d covariance = 1e-3 * covariance_;
      for (std::size_t i = 0; i < points_.size(); ++i)
        covariance += weights_[i] * (points_[i] - mean_) * (points_[i] - mean_).transpose();
      covariance_ = covariance;
    }
  }

  double effective() const {
    double squares = 0.0;
    for (const double w : weights_) squares += w * w;
    return 1.0 / squares;
  }
  int pixels() const { return pixels_; }

  struct Change {
    double of_coordinates = 0.0;  ///< Total variation of the coordinate that changes most.
    double of_poses = 0.0;
  };
  Change by(const RenderMesh& mesh) {
    const std::vector<double> changed = weights_of(mesh);
    Change change;
    for (std::size_t i = 0; i < changed.size(); ++i) change.of_poses += 0.5 * std::abs(changed[i] - weights_[i]);
    for (Eigen::Index k = 0; k < 6; ++k) {
      constexpr int kCells = 20;
      std::array<double, kCells> difference{};
      const double cell = 0.5 * std::sqrt(covariance_(k, k));
      for (std::size_t i = 0; i < points_.size(); ++i) {
        const int index = static_cast<int>(std::floor((points_[i][k] - mean_[k]) / cell)) + kCells / 2;
        difference[static_cast<std::size_t>(std::clamp(index, 0, kCells - 1))] += changed[i] - weights_[i];
      }
      double variation = 0.0;
      for (const double d : difference) variation += 0.5 * std::abs(d);
      change.of_coordinates = std::max(change.of_coordinates, variation);
    }
    return change;
  }

 private:
  /// From a Gaussian somewhat wider than the posterior; log_proposal_ up to a constant.
  void draw(core::RandomStream& stream) {
    constexpr double kWider = 1.25;
    const Matrix6d root = covariance_.llt().matrixL();
    points_.clear();
    log_proposal_.clear();
    for (int i = 0; i < kPoses; ++i) {
      Vector6d z;
      for (int k = 0; k < 6; ++k) z[k] = stream.normal();
      points_.push_back(mean_ + kWider * root * z);
      log_proposal_.push_back(-0.5 * z.squaredNorm());
    }
  }

  std::vector<double> weights_of(const RenderMesh& mesh) {
    std::vector<PoseHypothesis> hypotheses;
    for (const Vector6d& d : points_)
      hypotheses.push_back({&mesh, geometry::box_plus(frame_.truth, d), &frame_.material, -1, pixels_ + 0.0});
    std::vector<PoseEvidence> evidences(hypotheses.size());
    batch_->evaluate(frame_.terms, hypotheses, *workspace_, evidences);
    std::vector<double> weights;
    for (std::size_t i = 0; i < points_.size(); ++i)
      weights.push_back(evidences[i].tempered - 0.5 * points_[i].dot(prior_ * points_[i]) - log_proposal_[i]);
    const double most = *std::max_element(weights.begin(), weights.end());
    double sum = 0.0;
    for (double& w : weights) sum += w = std::exp(w - most);
    for (double& w : weights) w /= sum;
    return weights;
  }

  const Frame& frame_;
  std::unique_ptr<LikelihoodBatch> batch_ = make_simd_likelihood_batch();
  std::unique_ptr<LikelihoodWorkspace> workspace_;
  int pixels_ = 0;
  Matrix6d prior_ = Matrix6d::Zero();
  Vector6d mean_ = Vector6d::Zero();
  Matrix6d covariance_;
  std::vector<Vector6d> points_;
  std::vector<double> log_proposal_;
  std::vector<double> weights_;
};

TEST(DetailPosterior, TheLevelThatIsChosenMovesLittleOfIt) {
  double worst = 0.0, sum_of_poses = 0.0, chosen = 0.0;
  int cases = 0;
  for (const tests::FineShape& shape : tests::fine_shapes()) {
    const RenderMesh& original = *shape.levels.levels().front().mesh;
    for (const int width : {80, 160}) {
      for (const double distance : {0.6, 1.0, 1.5}) {
        double mean = 0.0, of_poses = 0.0, triangles = 0.0, fewest = 1e9, pixels = 0.0;
        for (std::uint64_t f = 0; f < kFrames; ++f) {
          const Frame frame(shape.levels.levels().front().mesh, distance, width, f);
          const RenderMesh& level = *shape.levels.at_pose(frame.terms, frame.truth).mesh;
          triangles += static_cast<double>(level.triangles.size()) / kFrames;
          EXPECT_LT(level.triangles.size(), distance < 1.0 ? 11'000U : 2000U) << shape.name;
          if (&level == &original) continue;
          Posterior posterior(frame, original);
          const Posterior::Change change = posterior.by(level);
          mean += change.of_coordinates / kFrames;
          of_poses += change.of_poses / kFrames;
          pixels += posterior.pixels() / double{kFrames};
          fewest = std::min(fewest, posterior.effective());
        }
        std::printf("%-7s %3d wide %.1f m: %4.0f pixels, %4.0f triangles, total variation %.3f, of poses %.3f (%.0f)\n",
                    shape.name.c_str(), width, distance, pixels, triangles, mean, of_poses, fewest);
        EXPECT_LE(mean, 0.05) << shape.name << " " << width << " " << distance;
        EXPECT_LE(of_poses, 0.25) << shape.name << " " << width << " " << distance;
        EXPECT_GE(fewest, 150.0);
        worst = std::max(worst, mean);
        sum_of_poses += of_poses;
        chosen += triangles;
        ++cases;
      }
    }
  }
  std::printf("worst of %d cases %.3f; of poses %.3f, %.0f triangles on average\n", cases, worst, sum_of_poses / cases,
              chosen / cases);
  // A level that is far too coarse is told from one that is not.
  const tests::FineShape& vase = tests::fine_shapes().front();
  const Frame frame(vase.levels.levels().front().mesh, 0.6, 160, 0);
  Posterior posterior(frame, *vase.levels.levels().front().mesh);
  EXPECT_GT(posterior.by(*vase.levels.levels().back().mesh).of_coordinates, 0.3);
  EXPECT_EQ(posterior.by(*vase.levels.levels().front().mesh).of_poses, 0.0);
}

}  // namespace
}  // namespace prescene::rendering::detail_posterior_statistics_test
