// SPDX-License-Identifier: Apache-2.0
// What stands in a scene file may be asked in a question, as JSON, and means the same.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "scene_texts.h"

namespace prescene::interfaces {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const LocatedValue& value) {
  Json json;
  if (value.kind == LocatedValue::Kind::kMap) {
    json = Json::object();
    for (std::size_t i = 0; i < value.keys.size(); ++i) json[value.keys[i].name] = json_of(value.items[i]);
  } else if (value.kind == LocatedValue::Kind::kList) {
    json = Json::array();
    for (const LocatedValue& item : value.items) json.push_back(json_of(item));
  } else if (value.kind == LocatedValue::Kind::kScalar) {
    char* end = nullptr;
    const double number = std::strtod(value.text.c_str(), &end);
    if (value.quoted || value.text.empty())
      json = value.text;
    else if (value.text == "true" || value.text == "false")
      json = value.text == "true";
    else if (*end == '\0')
      json = number;
    else
      json = value.text;
  }
  return json;
}

class OneVocabulary : public testing::TestWithParam<tests::SceneText> {};

TEST_P(OneVocabulary, ActionsAndOutcomesOfASceneFileMeanTheSameInAQuestion) {
  const auto scene = parse_scene(GetParam().text, GetParam().file, tests::options_with_meshes());
  const auto tree = parse_yaml(GetParam().text, GetParam().file);
  ASSERT_TRUE(scene.ok() && tree.ok());
  Json predict = Json::object();
  for (const char* key : {"actions", "outcomes", "exclusive_outcomes"}) {
    if (const LocatedValue* value = tree->find(key)) predict[key] = json_of(*value);
  }
  const auto query = belief::query_from_json(belief::json_text({{"predict", predict}}));
  ASSERT_TRUE(query.ok()) << core::to_string(query.status());
  auto asked = std::get<belief::PredictQuery>(query->what);
  for (belief::Outcome& outcome : asked.outcomes) ASSERT_TRUE(belief::complete_outcome(*scene, outcome).ok());
  for (belief::ExclusiveOutcomes& group : asked.exclusive_outcomes)
    for (belief::Outcome& outcome : group.outcomes) ASSERT_TRUE(belief::complete_outcome(*scene, outcome).ok());
  EXPECT_EQ(asked.actions, scene->actions);
  EXPECT_EQ(asked.outcomes, scene->outcomes);
  EXPECT_EQ(asked.exclusive_outcomes, scene->exclusive_outcomes);
}

INSTANTIATE_TEST_SUITE_P(Files, OneVocabulary, testing::ValuesIn(tests::scene_texts()),
                         [](const auto& one) { return one.param.name; });

TEST(OneVocabularyForRotations, ABareListIsRefusedWithTheForms) {
  const auto read = belief::pose_from_json(Json::parse(R"({"position": [0, 0, 0], "rotation": [1, 0, 0, 0]})"));
  ASSERT_FALSE(read.ok());
  EXPECT_THAT(read.status().message(), testing::HasSubstr("quaternion_wxyz"));
  EXPECT_THAT(read.status().message(), testing::HasSubstr("quaternion_xyzw"));
}

TEST(OneVocabularyForRotations, EveryFormIsTheSameRotation) {
  const double half = std::sqrt(0.5);
  const geometry::Quaterniond expected(half, 0.0, 0.0, half);
  for (const char* form : {R"({"quaternion_wxyz": [0.70710678, 0, 0, 0.70710678]})",
                           R"({"quaternion_xyzw": [0, 0, 0.70710678, 0.70710678]})", R"({"euler_deg": [0, 0, 90]})",
                           R"({"axis_angle_deg": [0, 0, 2, 90]})"}) {
    const auto pose = belief::pose_from_json({{"rotation", Json::parse(form)}});
    ASSERT_TRUE(pose.ok()) << form;
    EXPECT_NEAR(pose->rotation.angularDistance(expected), 0.0, 1e-7) << form;
  }
}

}  // namespace
}  // namespace prescene::interfaces
