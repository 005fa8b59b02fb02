// SPDX-License-Identifier: Apache-2.0
// The meshes of the recorded data against the table in their README: counts, boxes, closedness.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <string>

#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

TEST(RealMeshes, AgreeWithTheirTable) {
  const auto folder = tests::data_dir("meshes");
  if (!folder) GTEST_SKIP() << tests::missing_data_message("meshes");
  std::ifstream table(*folder / "README.md");
  std::string section;
  int compared = 0;
  for (std::string line; std::getline(table, line);) {
    if (line.starts_with("## ")) section = line.substr(3, line.find('/') - 3);
    char name[64];
    char closed[8];
    unsigned long vertices = 0;
    unsigned long triangles = 0;
    double min[3];
    double size[3];
    if (std::sscanf(line.c_str(),
                    "| %63[^. ].ply | %lu | %lu | %7s | %*d | %*d | %*d | %lf %lf %lf | %lf x %lf x %lf |", name,
                    &vertices, &triangles, closed, &min[0], &min[1], &min[2], &size[0], &size[1], &size[2]) != 10) {
      continue;
    }
    const auto mesh = read_mesh(*folder / section / (std::string(name) + ".ply"));
    ASSERT_TRUE(mesh.ok()) << mesh.status().message();
    const geometry::Box box = geometry::bounding_box(mesh->mesh);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(box.min()[i], min[i], 2e-4) << name;
      EXPECT_NEAR(box.sizes()[i], size[i], 2e-4) << name;
    }
    if (!mesh->repair.changed()) {
      EXPECT_EQ(mesh->mesh.vertices.size(), vertices) << name;
      EXPECT_EQ(mesh->mesh.triangles.size(), triangles) << name;
      EXPECT_EQ(geometry::mesh_topology(mesh->mesh).watertight(), std::string(closed).starts_with("yes")) << name;
    }
    ++compared;
  }
  EXPECT_EQ(compared, 74);
}

}  // namespace
}  // namespace prescene::interfaces
