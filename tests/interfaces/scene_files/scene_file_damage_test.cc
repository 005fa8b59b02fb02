// SPDX-License-Identifier: Apache-2.0
// Scene files with every key mistyped and every value replaced, one at a time: each has to be found, with its line, its
// key and a remedy, and nothing may crash.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "prescene/geometry/primitives.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "tests/interfaces/scene_files/scene_texts.h"
#include "tests/interfaces/scene_files/yaml_edits.h"

namespace prescene::interfaces {
namespace {

using testing::HasSubstr;

// Maps whose keys are names that the writer of the file chooses.
bool holds_names(const std::string& path) {
  if (path == "models" || path == "supports" || path == "robot" || path == "objects" || path == "outcomes" ||
      path == "joints" || path == "exclusive_outcomes")
    return true;
  const std::string group_end = ".outcomes";
  return path.rfind("exclusive_outcomes.", 0) == 0 && path.size() > group_end.size() &&
         path.compare(path.size() - group_end.size(), group_end.size(), group_end) == 0;
}

std::string all_texts(const std::vector<Problem>& problems) {
  std::string text;
  for (const Problem& problem : problems) text += problem.text() + "\n";
  return text;
}

class DamagedScene : public testing::TestWithParam<tests::SceneText> {
 protected:
  FileReport report_of(const std::string& text) const {
    FileReport report;
    const auto scene = parse_scene(text, GetParam().file, tests::options_with_meshes(), &report);
    EXPECT_EQ(scene.ok(), report.errors.empty());
    for (const Problem& problem : report.errors) EXPECT_THAT(scene.status().message(), HasSubstr(problem.reason));
    return report;
  }
  LocatedValue document() const { return *parse_yaml(GetParam().text, GetParam().file); }
};

TEST_P(DamagedScene, IsWholeToBeginWith) { EXPECT_EQ(all_texts(report_of(GetParam().text).errors), ""); }

TEST_P(DamagedScene, EveryMistypedKeyIsNamedWithItsLineAndTheRightKey) {
  int keys = 0;
  for (const tests::YamlKey& key : tests::all_keys(document())) {
    if (holds_names(key.parent)) continue;
    ++keys;
    for (const std::string& slip : tests::slips(key.name)) {
      const FileReport report =
          report_of(tests::replaced(GetParam().text, key.line, key.column, key.name.size(), slip));
      const bool found = std::any_of(report.errors.begin(), report.errors.end(), [&](const Problem& problem) {
        return problem.line == key.line && problem.key.find(slip) != std::string::npos &&
               problem.reason == "unknown key" && problem.remedy.find("'" + key.name + "'") != std::string::npos;
      });
      EXPECT_TRUE(found) << "line " << key.line << ": " << key.name << " written as " << slip << " gave\n"
                         << all_texts(report.errors);
    }
  }
  EXPECT_GT(keys, 10);
}

TEST_P(DamagedScene, EveryMistypedNameIsFoundWhereItIsReferredTo) {
  const LocatedValue whole = document();
  for (const tests::YamlKey& key : tests::all_keys(whole)) {
    if (!holds_names(key.parent)) continue;
    bool referred = false;
    for (const LocatedValue& scalar : tests::all_scalars(whole)) {
      const bool is_model_name = scalar.path.size() > 6 && scalar.path.substr(scalar.path.size() - 6) == ".model";
      referred = referred || (scalar.text == key.name && is_model_name == (key.parent == "models"));
    }
    const std::string slip = key.name + "q";
    const FileReport report = report_of(tests::replaced(GetParam().text, key.line, key.column, key.name.size(), slip));
    const bool is_outcome = key.parent.find("outcomes") != std::string::npos;
    if (!referred || is_outcome) continue;  // nothing names outcomes; nothing else is wrong with the new name
    const bool found = std::any_of(report.errors.begin(), report.errors.end(), [&](const Problem& problem) {
      return problem.line > 0 && problem.remedy.find("'" + slip + "'") != std::string::npos;
    });
    EXPECT_TRUE(found) << key.name << " written as " << slip << " gave\n" << all_texts(report.errors);
  }
}

TEST_P(DamagedScene, EveryValueOfAnotherKindIsFoundAtItsPlaceOrStillMeansSomething) {
  const std::vector<std::string> replacements{"[1, 2]", "{aa: 1}",    ".nan", "nan", "-7",
                                              "1e300",  "some words", "~",    "''",  "true"};
  for (const LocatedValue& scalar : tests::all_scalars(document())) {
    const std::size_t length = scalar.text.size() + (scalar.quoted ? 2 : 0);
    double number = 0.0;
    const bool is_number = !scalar.quoted && std::istringstream(scalar.text) >> number;
    for (const std::string& other : replacements) {
      const FileReport report =
          report_of(tests::replaced(GetParam().text, scalar.place.line, scalar.place.column, length, other));
      for (const Problem& problem : report.errors) {
        EXPECT_GT(problem.line, 0) << problem.text();
        EXPECT_FALSE(problem.reason.empty() || problem.remedy.empty()) << problem.text();
      }
      const bool is_of_any_length = other == "1e300" && scalar.path.find(".axis[") != std::string::npos;
      const bool is_wrong =
          other == "{aa: 1}" || other == "[1, 2]" || (is_number && other != "-7" && !is_of_any_length);
      const bool named = std::any_of(report.errors.begin(), report.errors.end(), [&](const Problem& problem) {
        return scalar.path.rfind(problem.key, 0) == 0 || problem.key.rfind(scalar.path, 0) == 0;
      });
      const bool may_be_text = scalar.path == "name" || scalar.path == "camera.name";
      const bool is_fine = !is_wrong && report.errors.empty();
      EXPECT_TRUE(named || is_fine || (may_be_text && report.errors.empty()))
          << scalar.path << " as " << other << " gave\n"
          << all_texts(report.errors);
    }
  }
}

TEST_P(DamagedScene, NegativeMassesFrictionsAndSizesAreErrors) {
  for (const LocatedValue& scalar : tests::all_scalars(document())) {
    const auto ends_with = [&](const std::string& end) {
      return scalar.path.size() >= end.size() &&
             scalar.path.compare(scalar.path.size() - end.size(), end.size(), end) == 0;
    };
    bool is_positive = false;
    for (const char* key :
         {".mass", ".density", ".friction", ".restitution", ".radius", ".length", "duration", ".sphere"})
      is_positive = is_positive || ends_with(key);
    if (!is_positive) continue;
    const FileReport report =
        report_of(tests::replaced(GetParam().text, scalar.place.line, scalar.place.column, scalar.text.size(), "-0.1"));
    ASSERT_FALSE(report.errors.empty()) << scalar.path;
    EXPECT_EQ(report.errors[0].line, scalar.place.line);
    EXPECT_EQ(report.errors[0].key, scalar.path);
  }
}

TEST_P(DamagedScene, CutAnywhereItIsReadOrExplained) {
  const std::string& text = GetParam().text;
  for (std::size_t length = 0; length < text.size(); length += 7) {
    const auto scene = parse_scene(text.substr(0, length), GetParam().file, tests::options_with_meshes());
    EXPECT_NE(scene.ok(), !scene.status().message().empty());
  }
}

INSTANTIATE_TEST_SUITE_P(Files, DamagedScene, testing::ValuesIn(tests::scene_texts()),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace prescene::interfaces
