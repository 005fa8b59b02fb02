// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/report.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/matchers.h"
#include "tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

Target ratio(double reached) {
  Target target;
  target.work = "boolean";
  target.must = at_least(20.0);
  target.aim = at_least(40.0);
  target.reached = reached;
  target.unit = "x";
  target.n = 12;
  target.baseline = "a peer";
  return target;
}

TEST(Report, MarksWhatWasReached) {
  for (const auto& [reached, mark] :
       {std::pair(50.0, " aim "), std::pair(40.0, " aim "), std::pair(39.9, " must "), std::pair(19.9, " MISSED ")}) {
    Report report("some", "scalar");
    report.add(ratio(reached));
    EXPECT_THAT(report.text(), HasSubstr(mark)) << reached;
  }
}

TEST(Report, AnAimAloneIsNotMissed) {
  Target target = ratio(30.0);
  target.must.reset();
  Report report("some", "scalar");
  report.add(target);
  EXPECT_THAT(report.text(), Not(HasSubstr("MISSED")));
}

TEST(Report, GoalsBelowAndWithin) {
  Target target = ratio(16.0);
  target.better = Better::kLower;
  EXPECT_TRUE(meets(target, at_most(16.0)));
  EXPECT_FALSE(meets(target, at_most(15.9)));
  target.better = Better::kWithin;
  EXPECT_TRUE(meets(target, {10.0, 16.0}));
  EXPECT_FALSE(meets(target, {17.0, 20.0}));
}

TEST(Report, WritesJsonAndCsv) {
  const tests::ScratchDir folder;
  Report report("some", "AVX2");
  report.note("Made shapes only.");
  report.add(ratio(30.0));
  Target missing;
  missing.work = "distance";
  missing.better = Better::kWithin;
  missing.must = Goal{1.0, 2.0};
  missing.why = "the peer has no distance";
  report.add(missing);
  report.add(Table{
      "times", {"pair", "us", "count"}, {{"a \"b\", c", 1.5, std::int64_t{3}}, {"d", std::nan(""), std::int64_t{4}}}});
  ASSERT_TRUE(report.write(folder.path() / "some.json").ok());

  const nlohmann::json json = nlohmann::json::parse(content(folder.path() / "some.json"));
  EXPECT_EQ(json.at("simd_target"), "AVX2");
  EXPECT_EQ(json.at("machine"), machine_name());
  const nlohmann::json& target = json.at("targets").at(0);
  EXPECT_EQ(target.at("must"), 20.0);
  EXPECT_EQ(target.at("aim"), 40.0);
  EXPECT_EQ(target.at("reached"), 30.0);
  EXPECT_EQ(target.at("better"), "higher");
  EXPECT_FALSE(target.contains("why"));
  EXPECT_TRUE(json.at("targets").at(1).at("reached").is_null());
  EXPECT_EQ(json.at("targets").at(1).at("why"), "the peer has no distance");
  EXPECT_EQ(json.at("targets").at(1).at("must"), nlohmann::json::array({1.0, 2.0}));
  EXPECT_TRUE(json.at("targets").at(1).at("aim").is_null());
  EXPECT_EQ(json.at("raw").at("times").at(0).at("us"), 1.5);
  EXPECT_TRUE(json.at("raw").at("times").at(1).at("us").is_null());
  EXPECT_EQ(content(folder.path() / "some.times.csv"),
            "\"pair\",\"us\",\"count\"\n\"a \"\"b\"\", c\",1.5,3\n\"d\",,4\n");
}

TEST(Report, SaysWhereItCannotWrite) {
  const core::Status status = Report("some", "scalar").write("/no/such/folder/some.json");
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(status.message(), HasSubstr("/no/such/folder/some.json"));
}

TEST(TextOf, AlignsColumns) {
  const Table table{"t", {"name", "value"}, {{"a", 1.0}, {"longer", 12345.6}}};
  EXPECT_EQ(text_of(table), "name    value\na           1\nlonger  12346\n");
}

}  // namespace
}  // namespace prescene::benchmarks
