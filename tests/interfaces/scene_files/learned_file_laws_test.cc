// SPDX-License-Identifier: Apache-2.0
// Learned files: what is read back is what was written, to the bit; nothing learned is the priors; and what was learned
// from other priors is refused with its line.
#include "prescene/interfaces/scene_files/learned_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "tests/belief/random_values.h"
#include "tests/interfaces/scene_files/scene_texts.h"
#include "tests/support/laws.h"

namespace prescene::interfaces::learned_file_test {
namespace {

using core::RandomStream;
using testing::HasSubstr;

constexpr const char* kScene = R"(models:
  mug: {box: [0.08, 0.08, 0.1], mass: {normal: [0.3, 0.05]}, friction: {uniform: [0.1, 0.9]}, restitution: 0.2,
        center_of_mass: [0, 0, {normal: [0.01, 0.004]}]}
  can: {box: [0.06, 0.06, 0.1], mass: 0.4, friction: {normal: [0.4, 0.1]}, impact_friction: {uniform: [0.1, 0.3]}}
  brick: {box: [0.1, 0.05, 0.05], mass: 1}
objects:
  mug: {model: mug, pose: {position: [0, 0, 0.1]}}
  can: {model: can, pose: {position: [0.2, 0, 0.1]}}
  other_can: {model: can, pose: {position: [0.4, 0, 0.1]}}
  brick: {model: brick, pose: {position: [0.6, 0, 0.1]}}
)";

belief::Scene scene() {
  const auto read = parse_scene(kScene, "scene.yaml", {});
  EXPECT_TRUE(read.ok()) << read.status().message();
  return *read;
}

belief::PhysicalBelief random_physics(RandomStream& stream, int dimensions) {
  belief::PhysicalBelief physics;
  if (dimensions == 0) return physics;
  std::vector<belief::PhysicalDraw> draws(static_cast<std::size_t>(1 + tests::random_below(stream, 20)));
  double sum = 0.0;
  for (belief::PhysicalDraw& draw : draws) {
    for (int i = 0; i < dimensions; ++i) draw.uniforms.push_back(stream.uniform());
    // The last is sure to have a weight.
    const bool impossible = &draw != &draws.back() && tests::random_below(stream, 4) == 0;
    draw.log_weight = impossible ? -std::numeric_limits<double>::infinity() : std::log(stream.uniform());
    sum += std::exp(draw.log_weight);
  }
  for (belief::PhysicalDraw& draw : draws) draw.log_weight -= std::log(sum);
  physics.draws = std::make_shared<const std::vector<belief::PhysicalDraw>>(std::move(draws));
  physics.cell = tests::random_below(stream, 2);
  physics.cell *= stream.uniform();
  physics.lessons = 1 + tests::random_below(stream, 9);
  physics.learned_ns = static_cast<core::TimeNs>(stream.next_u64() >> 1);
  return physics;
}

std::vector<belief::ObjectBelief> beliefs_of(const belief::Scene& scene) {
  std::vector<belief::ObjectBelief> objects;
  for (const belief::SceneObject& object : scene.objects) {
    belief::ObjectBelief& belief = objects.emplace_back();
    belief.name = object.name;
    belief.model = object.model;
  }
  return objects;
}

TEST(LearnedFileLaws, PriorsReadBackEqualWhatWasWritten) {
  const belief::Scene known = scene();
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    RandomStream stream(seed, core::Purpose::kTest);
    std::vector<belief::ObjectBelief> objects = beliefs_of(known);
    for (belief::ObjectBelief& object : objects)
      if (tests::random_below(stream, 3) > 0)
        object.physics =
            random_physics(stream, belief::physical_dimensions(known.models[static_cast<std::size_t>(object.model)]));
    const std::string text = learned_yaml(with_learned({}, known, objects));
    const auto read = parse_learned(text, "learned.yaml");
    RC_ASSERT(read.status() == core::ok_status());
    const auto physics = learned_physics(known, *read);
    RC_ASSERT(physics.status() == core::ok_status());
    RC_ASSERT(physics->size() == objects.size());
    for (std::size_t i = 0; i < objects.size(); ++i) RC_ASSERT((*physics)[i] == objects[i].physics);
    RC_ASSERT(learned_yaml(*read) == text);
    // What a session learned nothing about stays as an earlier one left it.
    RC_ASSERT(learned_yaml(with_learned(*read, known, beliefs_of(known))) == text);
  }));
}

TEST(LearnedFileLaws, ValuesOfModelsReadBackEqualWhatWasWritten) {
  belief::Scene known = scene();
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    RandomStream stream(seed, core::Purpose::kTest);
    belief::Scene fitted = known;
    for (belief::ObjectModel& model : fitted.models) {
      model.contact.friction = belief::NormalScalar{stream.uniform(), 0.1 * stream.uniform(), 0.0, 100.0};
      model.contact.restitution = belief::FixedScalar{stream.uniform()};
      model.contact.edge_radius = 0.01 * stream.uniform();
      model.center_of_mass.x = belief::NormalScalar{0.01 * stream.uniform(), 0.001};
      model.unit_inertia *= stream.uniform(0.5, 2.0);
    }
    LearnedFile file;
    for (const belief::ObjectModel& model : fitted.models) file.models.push_back(learned_model(model));
    const auto read = parse_learned(learned_yaml(file), "learned.yaml");
    RC_ASSERT(read.status() == core::ok_status());
    const auto with = with_learned_models(known, *read);
    RC_ASSERT(with.status() == core::ok_status());
    RC_ASSERT(*with == fitted);
  }));
}

TEST(LearnedFile, OfNothingIsThePriors) {
  const belief::Scene known = scene();
  const std::string text = learned_yaml(with_learned({}, known, beliefs_of(known)));
  const auto read = parse_learned(text, "learned.yaml");
  ASSERT_TRUE(read.ok()) << read.status().message();
  const auto learned = learned_physics(known, *read);
  ASSERT_TRUE(learned.ok());
  for (const belief::PhysicalBelief& physics : *learned) EXPECT_EQ(physics, belief::PhysicalBelief{});
  EXPECT_EQ(*with_learned_models(known, *read), known);
}

TEST(LearnedFile, OfThePageIsRead) {
  const std::string page = tests::text_of_file("docs/reference/scene_files.md");
  const auto read = parse_learned(tests::code_blocks(page, "yaml learned file"), "page.yaml");
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->models.size(), 1u);
  ASSERT_EQ(read->objects.size(), 1u);
  EXPECT_EQ(read->objects[0].physics.draws->size(), 2u);
}

TEST(LearnedFile, ThatWasLearnedFromOtherPriorsIsRefusedWithItsLine) {
  const belief::Scene known = scene();
  std::vector<belief::ObjectBelief> objects = beliefs_of(known);
  RandomStream stream(1, core::Purpose::kTest);
  objects[0].physics = random_physics(stream, 3);
  const auto read = parse_learned(learned_yaml(with_learned({}, known, objects)), "learned.yaml");
  ASSERT_TRUE(read.ok()) << read.status().message();
  belief::Scene other = known;
  other.models[0].contact.friction = belief::UniformScalar{0.2, 0.8};
  EXPECT_THAT(learned_physics(other, *read).status().message(),
              testing::AllOf(HasSubstr("learned.yaml:5: learned.objects.mug: it was learned from friction: {uniform: "
                                       "[0.1, 0.9]}, the scene says {uniform: [0.2, 0.8]}"),
                             HasSubstr("remove it from this file")));
  other = known;
  other.models[0].contact.impact_friction = belief::FixedScalar{0.2};
  EXPECT_THAT(learned_physics(other, *read).status().message(), HasSubstr("a prior of impact_friction"));
}

TEST(LearnedFile, MistakesAreToldWithLineAndRemedy) {
  const auto error = [](const std::string& text) { return parse_learned(text, "l.yaml").status().message(); };
  EXPECT_THAT(error("models: {}\n"), HasSubstr("learned"));
  EXPECT_THAT(error(""), HasSubstr("l.yaml"));
  EXPECT_THAT(error("learned:\n  objets: {}\n"), HasSubstr("l.yaml:2: learned.objets: unknown key"));
  const auto object = [&](const std::string& keys) { return error("learned:\n  objects:\n    mug:\n" + keys); };
  const std::string priors =
      "      priors: {friction: {uniform: [0.1, 0.9]}, restitution: 0.1, mass: 1, center_of_mass_x: 0, "
      "center_of_mass_y: 0, center_of_mass_z: 0}\n      lessons: 1\n";
  EXPECT_EQ(object(priors + "      draws: [[-0.6931471805599453, 0.3], [-0.6931471805599453, 0.6]]\n"), "");
  EXPECT_THAT(object(priors + "      draws:\n        - [-0.1, 0.3]\n"),
              HasSubstr("l.yaml:7: learned.objects.mug.draws: the weights sum to 0.9"));
  EXPECT_THAT(object(priors + "      draws: [[0, 0.3, 0.3]]\n"), HasSubstr("1 numbers between 0 and 1"));
  EXPECT_THAT(object(priors + "      draws: [[0, 1]]\n"), HasSubstr("an end of the interval"));
  EXPECT_THAT(object(priors + "      draws: [[.nan, 0.5]]\n"), HasSubstr("l.yaml:6"));
  EXPECT_THAT(object(priors + "      draws: []\n"), HasSubstr("1 to 4096 draws"));
  EXPECT_THAT(object(priors), HasSubstr("draws"));
  EXPECT_THAT(object("      lessons: 1\n      draws: [[0]]\n"), HasSubstr("priors"));
  EXPECT_THAT(error("learned: {models: {mug: {friction: -1}}}\n"), HasSubstr("learned.models.mug.friction"));
  EXPECT_THAT(error("learned: {models: {'a b': {friction: 1}}}\n"), HasSubstr("no scene has that name"));
}

}  // namespace
}  // namespace prescene::interfaces::learned_file_test
