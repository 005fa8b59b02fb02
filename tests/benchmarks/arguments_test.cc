// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/arguments.h"

#include <gmock/gmock.h>

namespace prescene::benchmarks {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

struct Given {
  int seeds = 10;
  double seconds = 30.0;
  std::string out, part;
  std::vector<std::string> names;
  std::string error;
  bool good = false;
};

Given given(std::vector<const char*> words) {
  Given result;
  Arguments arguments;
  arguments.flag("quick", [&] { result.seeds = 2; });
  arguments.number("seeds", 1, 1000, &result.seeds);
  arguments.number("seconds", 0.1, 1e6, &result.seconds);
  arguments.text("benchmark_out", "PATH", &result.out);
  arguments.one_of("part", {"cost", "memory"}, &result.part);
  arguments.list("only", "NAME", &result.names);
  words.insert(words.begin(), "bench");
  result.good = arguments.parse(static_cast<int>(words.size()), words.data(), &result.error);
  return result;
}

TEST(Arguments, AreTaken) {
  const Given some = given({"--benchmark_out=a=b", "--part=cost", "--only=x,yz", "--seconds=0.5"});
  EXPECT_TRUE(some.good) << some.error;
  EXPECT_EQ(some.seeds, 10);
  EXPECT_EQ(some.seconds, 0.5);
  EXPECT_EQ(some.out, "a=b");
  EXPECT_EQ(some.part, "cost");
  EXPECT_THAT(some.names, ElementsAre("x", "yz"));
  EXPECT_TRUE(given({}).good);
}

TEST(Arguments, FlagsAreTakenBeforeValues) {
  EXPECT_EQ(given({"--quick"}).seeds, 2);
  EXPECT_EQ(given({"--seeds=7", "--quick"}).seeds, 7);
  EXPECT_EQ(given({"--quick", "--seeds=7"}).seeds, 7);
}

TEST(Arguments, WhatIsWrongIsNamed) {
  for (const auto& [word, why] :
       std::vector<std::pair<const char*, const char*>>{{"--sed=3", "--sed=3: there is no such option"},
                                                        {"seeds=3", "there is no such option"},
                                                        {"--seeds", "there is no such option"},
                                                        {"--quick=1", "there is no such option"},
                                                        {"--seeds=0", "give a whole number from 1 to 1000"},
                                                        {"--seeds=2.5", "give a whole number"},
                                                        {"--seeds=3x", "give a whole number"},
                                                        {"--seeds=", "give a whole number"},
                                                        {"--seconds=nan", "give a number from 0.1"},
                                                        {"--part=cots", "give one of cost, memory"}}) {
    const Given refused = given({word});
    EXPECT_FALSE(refused.good) << word;
    EXPECT_THAT(refused.error, HasSubstr(why));
    EXPECT_THAT(refused.error, HasSubstr("usage: bench [--quick] [--seeds=N] [--seconds=X] [--benchmark_out=PATH] "
                                         "[--part=cost|memory] [--only=NAME[,NAME]...]\n"));
  }
}

}  // namespace
}  // namespace prescene::benchmarks
