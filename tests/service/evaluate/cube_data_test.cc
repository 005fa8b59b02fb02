// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/cube_data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/paths.h"

namespace prescene::service {
namespace {

const std::string kHeader = "toss,row,t_s,x_m,y_m,z_m,qw,qx,qy,qz,vx_mps\n";
const std::string kFirst = "4,0,0.0,0.1,0.2,0.3,0.6,0.8,0,0,0.5\n";

core::Result<std::vector<CubeToss>> read(const std::string& text) {
  const prescene::tests::ScratchDir scratch;
  std::ofstream(scratch.path() / "tosses_even.csv", std::ios::binary) << text;
  return read_cube_tosses(scratch.path());
}

TEST(CubeData, ReadsTossesInTheFilesOrder) {
  const auto tosses = read(kHeader + kFirst + "4,1,0.00676,0.1,0.2,0.29,0.6,0.8,0,0,0.5\n2,0,0,0,0,0.2,1,0,0,0,0\n");
  ASSERT_TRUE(tosses.ok()) << tosses.status().message();
  ASSERT_EQ(tosses->size(), 2u);
  EXPECT_EQ((*tosses)[0].number, 4);
  ASSERT_EQ((*tosses)[0].frames.size(), 2u);
  EXPECT_EQ((*tosses)[0].frames[1].time, 0.00676);
  EXPECT_EQ((*tosses)[0].frames[1].X_WO.translation, geometry::Vector3d(0.1, 0.2, 0.29));
  EXPECT_DOUBLE_EQ((*tosses)[0].frames[0].X_WO.rotation.w(), 0.6);
  EXPECT_DOUBLE_EQ((*tosses)[0].frames[0].X_WO.rotation.x(), 0.8);
  EXPECT_EQ((*tosses)[1].number, 2);
}

TEST(CubeData, EveryDefectIsNamedWithFileAndLine) {
  struct Case {
    std::string text;
    const char* line;
    const char* reason;
  };
  const std::vector<Case> cases = {
      {"", "line 1", "expected the columns"},
      {"a,b\n", "line 1", "expected the columns"},
      {"toss,row,t_s,x_m,y_m,qw,qx,qy,qz,\n" + kFirst, "line 1", "expected the columns"},  // no z_m
      {kHeader, "line 2", "no toss"},
      {kHeader + kFirst + "4,1,0.01,0.1,0.2,0.3,0.6,0.8,0,x,0\n", "line 3", "finite numbers"},
      {kHeader + kFirst + "4,1,0.01,nan,0.2,0.3,0.6,0.8,0,0,0\n", "line 3", "finite numbers"},
      {kHeader + kFirst + "4,1,0.01,0.1,inf,0.3,0.6,0.8,0,0,0\n", "line 3", "finite numbers"},
      {kHeader + kFirst + "4,1,0.01,,0.2,0.3,0.6,0.8,0,0,0\n", "line 3", "finite numbers"},
      {kHeader + "4.5,0,0.01,0.1,0.2,0.3,0.6,0.8,0,0,0\n", "line 2", "finite numbers"},
      {kHeader + "1e300,0,0.01,0.1,0.2,0.3,0.6,0.8,0,0,0\n", "line 2", "finite numbers"},
      {kHeader + kFirst + "4,1,0.01,0.1,0.2,0.3,2,0,0,0,0\n", "line 3", "norm is 2"},
      {kHeader + kFirst + "4,1,0.01,0.1,0.2,0.3,0,0,0,0,0\n", "line 3", "norm is 0"},
      {kHeader + kFirst + "4,1,0.0,0.1,0.2,0.3,0.6,0.8,0,0,0\n", "line 3", "not after the row before"},
      {kHeader + kFirst + "4,1,0.01,0.1,0.2,0.3,0.6,0.8,0,0\n", "line 3", "10 of 11 columns"},
      {kHeader + kFirst + "4,1,0.01,0.1,0.", "line 3", "is the file cut?"},
  };
  for (const Case& c : cases) {
    const auto tosses = read(c.text);
    ASSERT_FALSE(tosses.ok()) << c.text;
    EXPECT_EQ(tosses.status().code(), core::StatusCode::kInvalidInput);
    EXPECT_THAT(tosses.status().message(), testing::HasSubstr("tosses_even.csv, " + std::string(c.line))) << c.text;
    EXPECT_THAT(tosses.status().message(), testing::HasSubstr(c.reason)) << c.text;
  }
}

TEST(CubeData, AFileCutInsideARowSaysSoWhereverItIsCut) {
  const std::string whole = kHeader + kFirst;
  // From inside the header to inside the last used column; what is cut off an unused column is not missed.
  for (std::size_t size = 0; size < whole.size() - 4; ++size) EXPECT_FALSE(read(whole.substr(0, size)).ok()) << size;
}

TEST(CubeData, AMissingFolderIsNamed) {
  const auto tosses = read_cube_tosses("no/such/folder");
  EXPECT_EQ(tosses.status().code(), core::StatusCode::kNotFound);
  EXPECT_THAT(tosses.status().message(), testing::HasSubstr("no/such/folder"));
}

TEST(CubeData, SplitsByPlaceInTheList) {
  std::vector<CubeToss> tosses(5);
  for (int i = 0; i < 5; ++i) tosses[static_cast<std::size_t>(i)].number = 10 + i;
  EXPECT_EQ(select(tosses, CubeSplit::kCalibrate).size(), 3u);
  EXPECT_EQ(select(tosses, CubeSplit::kReport).front().number, 11);
  EXPECT_EQ(select(tosses, CubeSplit::kAll).size(), 5u);
}

}  // namespace
}  // namespace prescene::service
