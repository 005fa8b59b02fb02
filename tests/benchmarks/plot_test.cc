// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/plot.h"

#include <gmock/gmock.h>

#include <cmath>

namespace prescene::benchmarks {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(SvgOf, DrawsDecadesLabelsAndGaps) {
  const Plot plot{"p",
                  "time & place",
                  "us",
                  {"a", "b", "c"},
                  {{"one", {1.0, 10.0, 100.0}, false}, {"two", {5.0, std::nan(""), 7.0}, true}}};
  const std::string svg = svg_of(plot);
  EXPECT_THAT(svg, HasSubstr("time &amp; place"));
  // Two decades over 360 points from 40 on: 1 at the bottom, 10 in the middle, 100 at the top.
  EXPECT_THAT(svg, HasSubstr("cy=\"400\""));
  EXPECT_THAT(svg, HasSubstr("cy=\"220\""));
  EXPECT_THAT(svg, HasSubstr("cy=\"40\""));
  EXPECT_THAT(svg, HasSubstr("stroke-dasharray"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(SvgOf, NothingMeasured) {
  EXPECT_THAT(svg_of({"p", "t", "us", {"a"}, {{"one", {std::nan("")}, false}}}), HasSubstr("nothing was measured"));
}

}  // namespace
}  // namespace prescene::benchmarks
