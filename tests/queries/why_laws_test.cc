// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/why.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "prescene/filter/proposals/render_scene.h"
#include "prescene/rendering/reference/reference_likelihood.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "tests/support/simple_scenes.h"

namespace prescene::queries::why_laws_test {
namespace {

using belief::WhyAgainst;
using geometry::Pose;
using geometry::Vector3d;
using ::testing::HasSubstr;

constexpr double kMiddle = 0.3;  // m, height of the mug's centre: it hangs free
constexpr core::TimeNs kBegin = 1'700'000'000'000'000'000;

/// A block with a handle on its side +x; half a turn about z brings the block onto itself and the handle to the other
/// side.
belief::ObjectModel mug() {
  return tests::model_of("mug", {belief::PrimitiveShape{geometry::BoxShape{{0.08, 0.1, 0.12}}, {}},
                                 belief::PrimitiveShape{geometry::BoxShape{{0.06, 0.03, 0.06}},
                                                        Pose::from_translation({0.07, 0.0, 0.0})}});
}

const Pose kAsItIs = Pose::from_translation({0.0, 0.0, kMiddle});
const Pose kTurned{tests::about(Vector3d::UnitZ(), std::numbers::pi), kAsItIs.translation};
const Pose kBefore = Pose::from_translation({0.0, -0.2, kMiddle});  // between the mug and the camera

/// A mug before a wall, and a board that may stand before it; a camera that looks along y.
std::shared_ptr<const belief::Scene> scene() {
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "mug";
  scene->gravity_W = Vector3d::Zero();
  tests::add_object(*scene, mug(), "mug");
  tests::add_object(*scene, tests::primitive_model("board", geometry::BoxShape{{0.4, 0.02, 0.4}}), "board");
  for (belief::SceneObject& object : scene->objects) object.pose = belief::FixedPose{kAsItIs};
  scene->supports.push_back(tests::support_of("wall",
                                              {belief::PrimitiveShape{geometry::BoxShape{{3.0, 0.02, 3.0}}, {}}},
                                              Pose::from_translation({0.0, 0.4, 0.0})));
  belief::SceneCamera camera;
  camera.intrinsics = {160, 120, 200.0, 200.0, 79.5, 59.5};
  scene->camera = camera;
  return scene;
}

Pose looking_along_y() {
  geometry::Matrix3d R;
  R.col(0) = Vector3d::UnitX();
  R.col(1) = -Vector3d::UnitZ();
  R.col(2) = Vector3d::UnitY();
  return {geometry::Quaterniond(R), Vector3d(0.0, -0.7, kMiddle)};
}

/// A mug, and a board if there is one, that are held to be there.
std::shared_ptr<belief::Belief> believed(const std::vector<std::pair<Pose, double>>& mugs, bool board = false) {
  auto belief = std::make_shared<belief::Belief>();
  belief->step = 5;
  belief->stamp_ns = kBegin;
  belief->scene = scene();
  const auto add = [&](const std::string& name, int model, const std::vector<std::pair<Pose, double>>& poses) {
    belief::ObjectBelief& object = belief->objects.emplace_back();
    object.name = name;
    object.model = model;
    for (const auto& [X_WO, weight] : poses) {
      belief::Particle& particle = object.particles.emplace_back();
      particle.X_WO = X_WO;
      particle.log_weight = std::log(weight);
      particle.mode = belief::MotionMode::kResting;
    }
  };
  add("mug", 0, mugs);
  if (board) add("board", 1, {{kBefore, 1.0}});
  return belief;
}

/// What the camera sees where the mug truly is, and the board, if there is one; without noise.
WindowFrame frame_of(const std::shared_ptr<const belief::Belief>& belief, const Pose& X_WO, bool board = false,
                     double seconds = 0.0) {
  const auto renderer = rendering::make_reference_renderer();
  filter::MeshCache meshes;
  const auto truth = believed({{X_WO, 1.0}}, board);
  const filter::BeliefView view = filter::render_scene(*truth, filter::MeshDetail::kLikelihood, meshes);
  rendering::RenderedView images;
  const geometry::PinholeCamera camera = truth->scene->camera->intrinsics;
  EXPECT_TRUE(renderer->render(view.scene, camera, looking_along_y(), {}, &images).ok());
  WindowFrame frame;
  frame.observation.stamp_ns = kBegin + core::ns_of(seconds);
  frame.observation.frame.camera = camera;
  frame.observation.frame.depth = std::make_shared<geometry::DepthImage>(images.depth);
  frame.observation.X_WC = looking_along_y();
  frame.belief = belief;
  return frame;
}

/// Answers questions.
class Asked {
 public:
  core::Result<WhyAnswer> why(const std::vector<WindowFrame>& frames, WhyQuery query) {
    if (query.object.empty()) query.object = "mug";
    WhyContext context{{}, rendering::log_ratio_map};
    context.explain.simulation = limits;
    context.explain.simulation.pool = &pool_;
    context.explain.simulation.meshes = &meshes_;
    context.explain.simulation.make_renderer = []() -> core::Result<std::unique_ptr<rendering::Renderer>> {
      return rendering::make_reference_renderer();
    };
    context.explain.likelihood = likelihood_.get();
    return queries::why(frames, query, context);
  }
  WhyAnswer answer(const std::vector<WindowFrame>& frames, const WhyQuery& query) {
    auto found = why(frames, query);
    EXPECT_TRUE(found.ok()) << found.status().message();
    return found ? *std::move(found) : WhyAnswer();
  }
  QueryContext limits;

 private:
  core::ThreadPool pool_{2};
  filter::MeshCache meshes_;
  std::unique_ptr<rendering::LikelihoodBatch> likelihood_ = rendering::make_reference_likelihood_batch();
};

WhyQuery against_pose(const Pose& X_WO) {
  WhyQuery query;
  query.against = WhyAgainst::kPose;
  query.X_WO = X_WO;
  return query;
}

double sum_of(const geometry::Image<float>& nats) {
  double sum = 0.0;
  for (std::size_t i = 0; i < nats.size(); ++i)
    if (!std::isnan(nats.data()[i])) sum += static_cast<double>(nats.data()[i]);
  return sum;
}

// The likelihood multiplies ratios and takes the logarithm of products: single precision of each pixel is between.
double rounding(double log_ratio) { return 1e-3 + 1e-5 * std::abs(log_ratio); }

TEST(Why, PixelsAndTermsSumToTheFrameAndFramesToTheWhole) {
  const auto belief = believed({{kAsItIs, 0.7}, {kTurned, 0.3}});
  std::vector<WindowFrame> frames;
  for (int k = 0; k < 3; ++k) frames.push_back(frame_of(belief, k == 1 ? kTurned : kAsItIs, k == 2, 0.1 * k));
  WhyQuery query;
  query.images = 16;
  const WhyAnswer answer = Asked().answer(frames, query);
  ASSERT_EQ(answer.comparisons.size(), 2U);
  EXPECT_EQ(answer.comparisons[0].against, WhyAgainst::kAbsence);
  EXPECT_EQ(answer.comparisons[1].against, WhyAgainst::kAlternative);
  ASSERT_EQ(answer.views.size(), 3U);
  double pixels = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(answer.views[k].stamp_ns, frames[k].observation.stamp_ns);
    EXPECT_EQ(answer.comparisons[0].frames[k].log_ratio, answer.views[k].evidence.log_ratio);
    pixels = std::max(pixels, static_cast<double>(answer.views[k].evidence.measured));
  }
  for (const WhyComparison& comparison : answer.comparisons) {
    ASSERT_EQ(comparison.images.size(), 3U);
    double log_ratio = 0.0, tempered = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const WhyFrame& frame = comparison.frames[k];
      EXPECT_EQ(comparison.images[k].frame, k);
      EXPECT_NEAR(sum_of(comparison.images[k].nats), frame.log_ratio, rounding(frame.log_ratio));
      EXPECT_NEAR(frame.terms.sum(), frame.log_ratio, rounding(frame.log_ratio));
      EXPECT_NEAR(frame.speaks_for + frame.speaks_against, frame.log_ratio, rounding(frame.log_ratio));
      EXPECT_EQ(frame.tempered, answer.tempering[k] * frame.log_ratio);
      log_ratio += frame.log_ratio;
      tempered += frame.tempered;
    }
    EXPECT_NEAR(comparison.log_ratio, log_ratio, 1e-9);
    EXPECT_NEAR(comparison.tempered, tempered, 1e-9);
    EXPECT_NEAR(comparison.terms.sum(), log_ratio, 3.0 * rounding(log_ratio));
  }
  // As docs/reference/sensor_model.md and queries.md have it: 160 pixels are sampled at every second one.
  const double of_frame = 1.0 / (1.0 + 75.0 / 4.0 + pixels / 500.0);
  for (const double factor : answer.tempering) EXPECT_NEAR(factor, of_frame / (1.0 + 0.25 * 2.0), 1e-3 * of_frame);
}

TEST(Why, OfATurnedMugTheHandleSpeaksAgainstIt) {
  const std::vector<WindowFrame> frames = {frame_of(believed({{kTurned, 1.0}}), kAsItIs)};
  const WhyAnswer answer = Asked().answer(frames, against_pose(kAsItIs));
  ASSERT_EQ(answer.comparisons.size(), 1U);
  const WhyComparison& comparison = answer.comparisons[0];
  EXPECT_LT(comparison.log_ratio, -100.0);
  EXPECT_THAT(comparison.text, HasSubstr("against it by"));
  EXPECT_THAT(comparison.text, HasSubstr("turned by 180 degrees"));
  // Blocks coincide: what differs is where only one of both has the handle.
  EXPECT_NEAR(comparison.terms.outline, comparison.log_ratio, 0.02 * std::abs(comparison.log_ratio));
  // Handles are 3 cm beside the block: 40 pixels of it a metre away, in the full image, twice as many as in the
  // reduced.
  ASSERT_EQ(comparison.images.size(), 1U);
  const geometry::Image<float>& nats = comparison.images[0].nats;
  const int middle = nats.width() / 2, level = nats.height() / 2;
  const int side = static_cast<int>(std::lround(0.07 / 0.7 * 200.0 / 2.0));
  EXPECT_LT(nats(middle - side, level), -1.0F) << "where it is believed to be";
  EXPECT_LT(nats(middle + side, level), -1.0F) << "where it is";
  EXPECT_NEAR(nats(middle, level), 0.0F, 1e-3F) << "the block says nothing";
  ASSERT_TRUE(comparison.place && comparison.place->p_OQ);
  EXPECT_GT(comparison.place->p_OQ->x(), 0.05) << "on the handle of the mug as it is believed to be";
  // Of the mug as it is, they speak for it by as much.
  const WhyAnswer right = Asked().answer({frame_of(believed({{kAsItIs, 1.0}}), kAsItIs)}, against_pose(kTurned));
  EXPECT_NEAR(right.comparisons[0].log_ratio, -comparison.log_ratio, rounding(comparison.log_ratio));
}

TEST(Why, WhatIsHiddenSaysNothingAndWhatHidesItIsNamed) {
  const std::vector<WindowFrame> frames = {frame_of(believed({{kAsItIs, 1.0}}, true), kAsItIs, true)};
  const WhyAnswer answer = Asked().answer(frames, {});
  EXPECT_EQ(answer.comparisons[0].log_ratio, 0.0);
  EXPECT_EQ(answer.comparisons[0].tempered, 0.0);
  EXPECT_FALSE(answer.comparisons[0].place.has_value());
  const WhyView& view = answer.views[0];
  EXPECT_GT(view.evidence.in_view, 50);
  EXPECT_EQ(view.evidence.covered, 0);
  ASSERT_EQ(view.hidden_by.size(), 1U);
  EXPECT_EQ(view.hidden_by[0].name, "board");
  EXPECT_NEAR(view.hidden_by[0].pixels, view.evidence.in_view, 0.1 * view.evidence.in_view);
  EXPECT_THAT(answer.text, HasSubstr("hidden by board"));
  EXPECT_THAT(answer.text, HasSubstr("says nothing for it or against it"));
}

TEST(Why, AMugThatIsSeenIsThereAndOneThatIsNotSeenIsNot) {
  const WhyAnswer seen = Asked().answer({frame_of(believed({{kAsItIs, 1.0}}), kAsItIs)}, {});
  EXPECT_GT(seen.comparisons[0].log_ratio, 100.0);
  EXPECT_GT(seen.comparisons[0].terms.surface, seen.comparisons[0].terms.outline);
  Pose gone = kAsItIs;
  gone.translation.x() = 5.0;
  const WhyAnswer unseen = Asked().answer({frame_of(believed({{kAsItIs, 1.0}}), gone)}, {});
  EXPECT_LT(unseen.comparisons[0].log_ratio, -100.0);
}

// What it is compared with is as far off in frames before, in which the mug stood elsewhere.
TEST(Why, FollowsTheObjectBackInTime) {
  std::vector<WindowFrame> frames;
  for (int k = 0; k < 3; ++k) {
    Pose X_WO = kAsItIs;
    X_WO.translation.x() += 0.03 * k;
    frames.push_back(frame_of(believed({{X_WO, 1.0}}), X_WO, false, 0.1 * k));
  }
  Pose turned_now = kTurned;
  turned_now.translation.x() += 0.06;
  const WhyAnswer answer = Asked().answer(frames, against_pose(turned_now));
  ASSERT_EQ(answer.views.size(), 3U);
  EXPECT_NEAR(answer.views[0].X_WO.translation.x(), 0.0, 1e-12);
  for (const WhyFrame& frame : answer.comparisons[0].frames) EXPECT_GT(frame.log_ratio, 100.0);
}

// A belief that held it to be turned otherwise does not exchange the two that are compared.
TEST(Why, JudgesFramesBeforeATurnByThePoseThatIsBelievedNow) {
  const std::vector<WindowFrame> frames = {frame_of(believed({{kTurned, 1.0}}), kAsItIs, false, 0.0),
                                           frame_of(believed({{kAsItIs, 1.0}}), kAsItIs, false, 0.1)};
  const WhyAnswer answer = Asked().answer(frames, against_pose(kTurned));
  for (const WhyFrame& frame : answer.comparisons[0].frames) EXPECT_GT(frame.log_ratio, 100.0);
  EXPECT_THAT(answer.remarks, ::testing::Contains(HasSubstr("1 frame of when the belief had it turned otherwise")));
}

TEST(Why, SaysWhatIsWrong) {
  const auto belief = believed({{kAsItIs, 1.0}});
  const std::vector<WindowFrame> frames = {frame_of(belief, kAsItIs)};
  const auto refusal = [&](const std::vector<WindowFrame>& of, const WhyQuery& query) {
    const auto answer = Asked().why(of, query);
    return answer ? core::ok_status() : answer.status();
  };
  WhyQuery query;
  query.object = "mgu";
  EXPECT_EQ(refusal(frames, query).code(), core::StatusCode::kNotFound);
  EXPECT_THAT(refusal(frames, query).message(), HasSubstr("did you mean 'mug'?"));
  EXPECT_EQ(refusal({}, {}).code(), core::StatusCode::kInvalidInput);
  query = {};
  query.against = WhyAgainst::kAlternative;
  EXPECT_THAT(refusal(frames, query).message(), HasSubstr("no alternative"));
  query = {};
  query.against = WhyAgainst::kPose;
  EXPECT_THAT(refusal(frames, query).message(), HasSubstr("a pose is needed"));
  query = {};
  query.images = 17;
  EXPECT_THAT(refusal(frames, query).message(), HasSubstr("images: give 0 to 16"));
  auto lost = believed({{kAsItIs, 1.0}});
  lost->objects[0].state = belief::TrackState::kLost;
  EXPECT_THAT(refusal({frame_of(lost, kAsItIs)}, {}).message(), HasSubstr("is lost"));
  auto unborn = believed({{kAsItIs, 1.0}});
  unborn->step = 0;
  EXPECT_EQ(refusal({frame_of(unborn, kAsItIs)}, {}).code(), core::StatusCode::kInvalidInput);
}

TEST(Why, EndsWhenItIsToldToOrHasNoTimeOrMemoryLeft) {
  const auto belief = believed({{kAsItIs, 1.0}});
  const std::vector<WindowFrame> frames = {frame_of(belief, kAsItIs), frame_of(belief, kAsItIs, false, 0.1)};
  Asked cancelled;
  core::Cancellation request;
  request.request();
  cancelled.limits.cancellation = &request;
  EXPECT_EQ(cancelled.why(frames, {}).status().code(), core::StatusCode::kCancelled);
  Asked hasty;
  hasty.limits.simulate_until = core::Cancellation::Clock::now();
  const WhyAnswer answer = hasty.answer(frames, {});
  EXPECT_TRUE(answer.cut_short);
  ASSERT_EQ(answer.views.size(), 1U);
  EXPECT_EQ(answer.views[0].stamp_ns, frames[1].observation.stamp_ns) << "the newest";
  Asked small;
  small.limits.most_bytes = 1000;
  EXPECT_EQ(small.why(frames, {}).status().code(), core::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace prescene::queries::why_laws_test
