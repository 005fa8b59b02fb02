// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/binder.h"

#include <gmock/gmock.h>

#include <functional>

#include "prescene/core/random.h"
#include "prescene/core/spelling.h"
#include "tests/support/laws.h"

namespace prescene::interfaces {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// The problems that binding a text finds.
std::vector<std::string> problems_of(const std::string& text, const std::function<void(Binder&)>& bind) {
  const auto document = parse_yaml(text, "f.yaml");
  EXPECT_TRUE(document.ok());
  Problems problems;
  {
    Binder binder(*document, problems);
    bind(binder);
  }
  std::vector<std::string> texts;
  for (const Problem& problem : problems.errors()) texts.push_back(problem.text());
  return texts;
}

std::vector<std::string> number_problems(const std::string& value, const NumberRange& range) {
  return problems_of("x: " + value, [&](Binder& binder) {
    double x = 0.0;
    binder.read("x", x, range);
  });
}

TEST(Binder, FillsWhatIsThereAndLeavesTheRest) {
  double rate = 1.5, other = 2.5;
  int count = 3;
  bool flag = false;
  std::string topic = "default";
  std::optional<double> limit;
  const auto problems =
      problems_of("rate: -2e-1\ncount: 7\nflag: true\ntopic: /camera\nlimit: 4\n", [&](Binder& binder) {
        EXPECT_TRUE(binder.read("rate", rate));
        EXPECT_FALSE(binder.read("other", other));
        EXPECT_TRUE(binder.read("count", count, 0, 10));
        EXPECT_TRUE(binder.read("flag", flag));
        EXPECT_TRUE(binder.read("topic", topic));
        EXPECT_TRUE(binder.read("limit", limit));
      });
  EXPECT_THAT(problems, ElementsAre());
  EXPECT_EQ(rate, -0.2);
  EXPECT_EQ(other, 2.5);
  EXPECT_EQ(count, 7);
  EXPECT_TRUE(flag);
  EXPECT_EQ(topic, "/camera");
  EXPECT_EQ(limit, 4.0);
}

TEST(Binder, ReportsUnknownKeysWithTheNearestOneThatIsNotThereYet) {
  double fx = 0.0, fy = 0.0;
  EXPECT_THAT(problems_of("fx: 1\nfz: 2\n", [&](Binder& b) { b.read("fx", fx), b.read("fy", fy); }),
              ElementsAre("f.yaml:2: fz: unknown key: did you mean 'fy'?"));
  EXPECT_THAT(problems_of("weight: 1\n", [&](Binder& b) { b.read("fx", fx), b.read("mass", fy); }),
              ElementsAre("f.yaml:1: weight: unknown key: use one of 'fx' or 'mass'"));
  EXPECT_THAT(problems_of("mass: 1\nmasss: 2\n", [&](Binder& b) { b.read("mass", fx); }),
              ElementsAre("f.yaml:2: masss: unknown key: did you mean 'mass'?"));
}

TEST(Binder, DoesNotComplainTwiceAboutAMistypedRequiredKey) {
  EXPECT_THAT(problems_of("modle: 1\n", [](Binder& b) { b.require("model", "name a model"); }),
              ElementsAre("f.yaml:1: modle: unknown key: did you mean 'model'?"));
  EXPECT_THAT(problems_of("pose: 1\n", [](Binder& b) { b.require("model", "name a model"), b.find("pose"); }),
              ElementsAre("f.yaml:1: the key 'model' is missing: name a model"));
  EXPECT_THAT(problems_of("cylindr: 1\n",
                          [](Binder& b) {
                            b.one_of({"box", "cylinder"}, "give a shape");
                          }),
              ElementsAre("f.yaml:1: cylindr: unknown key: did you mean 'cylinder'?"));
}

TEST(Binder, WantsJustOneOfSeveral) {
  const auto one_of = [](Binder& b) { b.one_of({"mass", "density"}, "give one of them"); };
  EXPECT_THAT(problems_of("mass: 1\n", one_of), ElementsAre());
  EXPECT_THAT(problems_of("mass: 1\ndensity: 2\n", one_of),
              ElementsAre("f.yaml:2: density: 'density' and 'mass' exclude each other: remove one of them"));
  EXPECT_THAT(problems_of("{}", one_of), ElementsAre("f.yaml:1: a key is missing: give one of them"));
}

TEST(Binder, WantsAMap) {
  EXPECT_THAT(problems_of("[1, 2]", [](Binder& b) { b.require("x", "give x"); }),
              ElementsAre(HasSubstr("this is a list of 2")));
}

TEST(ReadNumber, ConvertsUnitsAndGuessesThem) {
  const NumberRange metres{0.0, 20.0, "give metres", "m"};
  EXPECT_THAT(number_problems("5 cm", metres),
              ElementsAre("f.yaml:1: x: '5 cm' is not a number: write 0.05 without a unit"));
  EXPECT_THAT(number_problems("12mm", metres), ElementsAre(HasSubstr("write 0.012 without a unit")));
  EXPECT_THAT(number_problems("105", metres),
              ElementsAre("f.yaml:1: x: 105 is out of range: millimetres? then write 0.105; give metres"));
  EXPECT_THAT(number_problems("250 g", {0.0, 1.0, "give kg", "kg"}), ElementsAre(HasSubstr("write 0.25")));
  EXPECT_THAT(number_problems("0.5 rad", {0.0, 90.0, "give degrees", "deg"}), ElementsAre(HasSubstr("write 28.6479")));
  EXPECT_THAT(number_problems("90", {0.0, 3.2, "give rad", "rad"}),
              ElementsAre(HasSubstr("degrees? then write 1.5708")));
  EXPECT_THAT(number_problems("-3", metres), ElementsAre("f.yaml:1: x: -3 is out of range: give metres"));
}

TEST(ReadNumber, TakesNumbersOnly) {
  for (const char* good : {"1", "-0.5", "+2", "1e-3", ".5", "2.", "0x0"}) {
    const bool reads = number_problems(good, {}).empty();
    EXPECT_EQ(reads, std::string(good) != "0x0") << good;
  }
  for (const char* bad : {"nan", ".nan", "inf", ".inf", "-.inf", "1e999", "\"1\"", "one", "1,5", "1 2", "[1]", "{a: 1}",
                          "~", "--1", "+-1"})
    EXPECT_EQ(number_problems(bad, {}).size(), 1U) << bad;
}

TEST(ReadInteger, TakesWholeNumbersInRangeOnly) {
  const auto integer_problems = [](const std::string& value) {
    return problems_of("x: " + value, [](Binder& binder) {
      int x = 0;
      binder.read("x", x, 1, 16, "give a number of threads");
    });
  };
  EXPECT_THAT(integer_problems("16"), ElementsAre());
  EXPECT_THAT(integer_problems("17"),
              ElementsAre("f.yaml:1: x: 17 is out of range: give a number of threads between 1 and 16"));
  for (const char* bad : {"1.5", "99999999999999999999", "'3'", "three", "[3]", "~"})
    EXPECT_EQ(integer_problems(bad).size(), 1U) << bad;
}

TEST(Binder, ReadsEnumerationsByTheirWords) {
  enum class Color { kRed, kGreen };
  const std::vector<std::pair<std::string, Color>> words{{"red", Color::kRed}, {"green", Color::kGreen}};
  Color color = Color::kRed;
  EXPECT_THAT(problems_of("c: green\n", [&](Binder& b) { b.read_enum("c", color, words); }), ElementsAre());
  EXPECT_EQ(color, Color::kGreen);
  EXPECT_THAT(problems_of("c: gren\n", [&](Binder& b) { b.read_enum("c", color, words); }),
              ElementsAre("f.yaml:1: c: 'gren' is not known here: did you mean 'green'?"));
}

std::string random_word(core::RandomStream& stream) {
  std::string word;
  for (auto i = stream.uniform_below(6); i > 0; --i) word += static_cast<char>('a' + stream.uniform_below(3));
  return word;
}

TEST(EditDistanceLaws, IsSymmetricZeroForEqualsOnlyAndOneForEachSlip) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const std::string a = random_word(stream), b = random_word(stream);
    RC_ASSERT(core::edit_distance(a, b) == core::edit_distance(b, a));
    RC_ASSERT((core::edit_distance(a, b) == 0) == (a == b));
    RC_ASSERT(core::edit_distance(a, b) <= static_cast<int>(std::max(a.size(), b.size())));
    RC_ASSERT(core::edit_distance(a, b) >= std::abs(static_cast<int>(a.size()) - static_cast<int>(b.size())));
    std::string dropped = a + "x" + b;
    RC_ASSERT(core::edit_distance(dropped, a + b) == 1);
    RC_ASSERT(core::edit_distance(a + "xy" + b, a + "yx" + b) == 1);
    RC_ASSERT(core::edit_distance(a + "x" + b, a + "y" + b) == 1);
  }));
}

TEST(Problems, AreToldInTheOrderOfTheFileAndNotWithoutEnd) {
  Problems problems;
  const auto file = std::make_shared<const std::string>("f.yaml");
  for (int line = 300; line > 0; --line) problems.add({file, line, 1}, "k", "reason", "remedy");
  const std::string text = problems.status().message();
  EXPECT_EQ(text.substr(0, text.find('\n')), "f.yaml:201: k: reason: remedy");
  EXPECT_THAT(text, HasSubstr("and 200 more problems"));
}

}  // namespace
}  // namespace prescene::interfaces
