// SPDX-License-Identifier: Apache-2.0
// What `prescene train` learns, keeps and refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "prescene/interfaces/bytes/file.h"
#include "prescene/service/training/proposals_file.h"
#include "prescene/service/training/train_proposals.h"
#include "tests/support/paths.h"

namespace prescene::service::training_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

belief::ObjectModel model_of(const std::string& name, const geometry::Primitive& shape) {
  belief::ObjectModel model;
  model.name = name;
  model.collision.push_back(belief::PrimitiveShape{shape, geometry::Pose::identity()});
  auto derived = belief::with_derived_properties(model);
  PRESCENE_CHECK(derived.ok());
  return *derived;
}

belief::Scene two_models() {
  belief::Scene scene;
  scene.models = {model_of("box", geometry::BoxShape{{0.06, 0.10, 0.16}}),
                  model_of("can", geometry::Cylinder{0.035, 0.1})};
  return scene;
}

core::Result<TrainedProposals> train(const belief::Scene& scene, const TrainingOptions& options, int threads = 2) {
  core::ThreadPool pool(threads);
  Backends backends(pool);
  return train_proposals(scene, options, backends);
}

/// Small, yet with all parts.
const TrainedProposals& small_training() {
  static const core::Result<TrainedProposals> kTrained =
      train(two_models(), {.seed = 3, .views = 12, .places = 2, .scenes = 6});
  PRESCENE_CHECK_MSG(kTrained.ok(), kTrained.status().message());
  return *kTrained;
}

TEST(Training, LearnsPlacesOfEachModelAndJudgesFits) {
  const TrainedProposals& trained = small_training();
  ASSERT_EQ(trained.proposals.models.size(), 2u);
  EXPECT_EQ(trained.patches, 2 * 12 * 2);
  EXPECT_GT(trained.candidates, trained.right_candidates);
  EXPECT_GT(trained.right_candidates, 0);
  EXPECT_FALSE(trained.proposals.fit.empty());
  // A box lies on three pairs of faces, each of which is up in two ways.
  EXPECT_EQ(trained.proposals.models[0].rests.size(), 6u);
}

TEST(Training, HasTheSameBitsForAnyNumberOfThreads) {
  const auto alone = train(two_models(), {.seed = 3, .views = 12, .places = 2, .scenes = 6}, 1);
  ASSERT_TRUE(alone.ok());
  EXPECT_EQ(encode_proposals(alone->proposals), encode_proposals(small_training().proposals));
}

TEST(Training, WithoutScenesLearnsPlacesAlone) {
  const auto trained = train(two_models(), {.views = 3, .places = 2, .scenes = 0});
  ASSERT_TRUE(trained.ok());
  EXPECT_EQ(trained->patches, 12);
  EXPECT_TRUE(trained->proposals.fit.empty());
}

TEST(Training, OfASceneWithoutModelsSaysSo) {
  const auto trained = train({}, {});
  EXPECT_EQ(trained.status().code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(trained.status().message(), HasSubstr("no models"));
}

TEST(Training, NumbersOutOfRangeAreNamed) {
  const auto trained = train(two_models(), {.views = 0});
  EXPECT_EQ(trained.status().code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(trained.status().message(), HasSubstr("views"));
}

TEST(Training, StopsOnRequest) {
  core::ThreadPool pool(2);
  Backends backends(pool);
  core::Cancellation cancellation;
  cancellation.request();
  const auto trained = train_proposals(two_models(), {.views = 2, .places = 1}, backends, {}, &cancellation);
  EXPECT_EQ(trained.status().code(), core::StatusCode::kCancelled);
}

TEST(ProposalsFile, HoldsWhatWasWritten) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "proposals.bin";
  ASSERT_TRUE(write_proposals(path, small_training().proposals).ok());
  const auto loaded = load_proposals(path, two_models());
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(**loaded, small_training().proposals);
}

TEST(ProposalsFile, IsRefusedWhereverItIsCut) {
  const std::vector<std::uint8_t> bytes = encode_proposals(small_training().proposals);
  for (std::size_t size = 0; size < bytes.size(); size += size < 200 ? 1 : 977) {
    const auto decoded = decode_proposals(std::span(bytes).first(size));
    ASSERT_FALSE(decoded.ok()) << size;
    EXPECT_THAT(decoded.status().message(), HasSubstr("prescene train"));
  }
}

TEST(ProposalsFile, IsRefusedWhereverABitIsFlipped) {
  const std::vector<std::uint8_t> bytes = encode_proposals(small_training().proposals);
  for (std::size_t at = 0; at < bytes.size(); at += at < 200 ? 1 : 1301) {
    std::vector<std::uint8_t> other = bytes;
    other[at] ^= 0x10;
    EXPECT_FALSE(decode_proposals(other).ok()) << at;
  }
}

TEST(ProposalsFile, OfANewerVersionIsRefused) {
  std::vector<std::uint8_t> bytes = encode_proposals(small_training().proposals);
  bytes[8] = 2;
  const auto decoded = decode_proposals(bytes);
  EXPECT_EQ(decoded.status().code(), core::StatusCode::kUnsupported);
  EXPECT_THAT(decoded.status().message(), AllOf(HasSubstr("version 2"), HasSubstr("prescene train")));
}

TEST(ProposalsFile, OfOtherModelsIsRefusedByName) {
  belief::Scene other = two_models();
  other.models.push_back(model_of("ball", geometry::Sphere{0.04}));
  const core::Status unknown = check_proposals(small_training().proposals, other);
  EXPECT_EQ(unknown.code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(unknown.message(), HasSubstr("knows nothing of model 'ball'"));
  other = two_models();
  other.models[1] = model_of("can", geometry::Cylinder{0.035, 0.11});
  const core::Status changed = check_proposals(small_training().proposals, other);
  EXPECT_THAT(changed.message(), HasSubstr("another mesh of model 'can'"));
  // A scene with fewer models is no other scene.
  other.models.pop_back();
  EXPECT_TRUE(check_proposals(small_training().proposals, other).ok());
}

TEST(ProposalsFile, ThatIsNoneIsNamedWithItsPath) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "other.bin";
  ASSERT_TRUE(interfaces::write_file(path, std::string_view("ply\nformat ascii 1.0\n")).ok());
  const auto loaded = load_proposals(path, two_models());
  EXPECT_EQ(loaded.status().code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(loaded.status().message(), AllOf(HasSubstr(path.string()), HasSubstr("bad signature")));
  EXPECT_EQ(load_proposals(folder.path() / "none.bin", two_models()).status().code(), core::StatusCode::kNotFound);
}

}  // namespace
}  // namespace prescene::service::training_test
