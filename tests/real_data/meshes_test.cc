// SPDX-License-Identifier: Apache-2.0
// The folder `meshes` of the recorded data: what its table says of 74 meshes of scans, household things and robots,
// found by another program, against ours.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "tests/support/paths.h"

namespace prescene::geometry {
namespace {

struct Row {
  std::string path;
  std::map<std::string, std::string> columns;

  double number(const std::string& column) const { return std::stod(columns.at(column)); }
};

std::string trimmed(const std::string& text) {
  const auto begin = text.find_first_not_of(' ');
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  for (std::size_t begin = 1; begin < line.size();) {
    const std::size_t end = std::min(line.find('|', begin), line.size());
    cells.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return cells;
}

// The rows of the tables below headings "## folder/: ...".
std::vector<Row> read_table(const std::filesystem::path& readme) {
  std::vector<Row> rows;
  std::ifstream file(readme);
  std::string folder;
  std::vector<std::string> names;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("## ")) folder = line.substr(3, line.find('/') - 3);
    if (!line.starts_with("|")) continue;
    const std::vector<std::string> cells = cells_of(line);
    if (cells.at(0) == "file") names = cells;
    if (!cells.at(0).ends_with(".ply")) continue;
    Row row{folder + "/" + cells[0], {}};
    for (std::size_t i = 1; i < std::min(names.size(), cells.size()); ++i) row.columns[names[i]] = cells[i];
    rows.push_back(std::move(row));
  }
  return rows;
}

TEST(RealMeshes, AreAsTheirTableSays) {
  const auto folder = tests::data_dir("meshes");
  if (!folder) GTEST_SKIP() << tests::missing_data_message("meshes");
  const std::vector<Row> rows = read_table(*folder / "README.md");
  ASSERT_EQ(rows.size(), 74U);
  int closed = 0;
  for (const Row& row : rows) {
    SCOPED_TRACE(row.path);
    const auto loaded = interfaces::read_mesh(*folder / row.path);
    ASSERT_TRUE(loaded.ok()) << to_string(loaded.status());
    const TriangleMesh& mesh = loaded->mesh;
    EXPECT_EQ(static_cast<double>(mesh.triangles.size()), row.number("triangles"));

    const MeshTopology topology = mesh_topology(mesh);
    const std::string watertight = row.columns.at("watertight");
    EXPECT_EQ(topology.watertight(), watertight.starts_with("yes"));
    EXPECT_EQ(topology.open_edges, static_cast<int>(row.number("open")));
    EXPECT_EQ(topology.non_manifold_edges, static_cast<int>(row.number("nm")));
    EXPECT_EQ(topology.components, static_cast<int>(row.number("parts")));
    EXPECT_EQ(topology.watertight() && topology.oriented(), watertight == "yes");

    const auto body = mass_properties(mesh, 1000.0);
    EXPECT_EQ(body.ok(), topology.bounds_volume());
    if (!body.ok()) continue;
    ++closed;
    EXPECT_TRUE(body->is_physical());
    // The table has four digits of cubic centimetres.
    const double volume = row.number("volume (cm3)");
    EXPECT_NEAR(1e6 * signed_volume(mesh), volume, 6e-4 * std::abs(volume));
    EXPECT_NEAR(1e3 * body->mass, volume, 6e-4 * std::abs(volume));
    EXPECT_TRUE(bounding_box(mesh).contains(body->p_BoBcm));
  }
  EXPECT_EQ(closed, 66);
}

TEST(RealMeshes, HullsHoldTheirMeshes) {
  const auto folder = tests::data_dir("meshes");
  if (!folder) GTEST_SKIP() << tests::missing_data_message("meshes");
  for (const Row& row : read_table(*folder / "README.md")) {
    SCOPED_TRACE(row.path);
    const auto loaded = interfaces::read_mesh(*folder / row.path);
    ASSERT_TRUE(loaded.ok());
    const auto hull = convex_hull(loaded->mesh.vertices);
    ASSERT_TRUE(hull.ok()) << to_string(hull.status());
    EXPECT_TRUE(mesh_topology(*hull).watertight());
    EXPECT_TRUE(mesh_topology(*hull).oriented());
    EXPECT_EQ(2 * hull->vertices.size(), hull->triangles.size() + 4);
    EXPECT_EQ(bounding_box(*hull).min(), bounding_box(loaded->mesh).min());
    EXPECT_EQ(bounding_box(*hull).max(), bounding_box(loaded->mesh).max());
    // A simple body's volume is at most its hull's; overlapping parts count twice.
    if (row.columns.at("parts") == "1" && mesh_topology(loaded->mesh).bounds_volume()) {
      EXPECT_LE(signed_volume(loaded->mesh), signed_volume(*hull) * (1.0 + 1e-9));
    }
  }
}

TEST(RealMeshes, FourHundredTrianglesKeepTheShape) {
  // What a tracker renders. Measured: the worst of the closed meshes keeps 80 % of its volume (a shell of 2 mm), the
  // decompositions into 62 and 104 parts have too many parts for it, the median keeps 99 %.
  const auto folder = tests::data_dir("meshes");
  if (!folder) GTEST_SKIP() << tests::missing_data_message("meshes");
  std::vector<double> ratios;
  for (const Row& row : read_table(*folder / "README.md")) {
    SCOPED_TRACE(row.path);
    const auto loaded = interfaces::read_mesh(*folder / row.path);
    ASSERT_TRUE(loaded.ok());
    const TriangleMesh coarse = simplified(loaded->mesh, 400);
    EXPECT_LE(coarse.triangles.size(), 400U);
    const bool bounds_volume = mesh_topology(loaded->mesh).bounds_volume();
    EXPECT_TRUE(!bounds_volume || mesh_topology(coarse).bounds_volume());
    EXPECT_LT((bounding_box(coarse).sizes() - bounding_box(loaded->mesh).sizes()).cwiseAbs().maxCoeff(),
              0.05 * bounding_box(loaded->mesh).sizes().maxCoeff());
    if (!bounds_volume || row.number("parts") > 50) continue;
    ratios.push_back(signed_volume(coarse) / signed_volume(loaded->mesh));
    EXPECT_NEAR(ratios.back(), 1.0, 0.25);
  }
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
  EXPECT_NEAR(ratios[ratios.size() / 2], 1.0, 0.02);
}

}  // namespace
}  // namespace prescene::geometry
