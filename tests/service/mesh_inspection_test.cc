// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/mesh_inspection.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/service/backends.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/scene_report.h"
#include "tests/support/paths.h"

namespace prescene::service {
namespace {

using geometry::Vector3d;

struct Case {
  const char* name;
  geometry::TriangleMesh mesh;
  const char* symmetry;
};

std::vector<Case> cases() {
  return {{"ball", geometry::make_mesh(geometry::Sphere{0.04}, 48), "every rotation"},
          {"can", geometry::make_mesh(geometry::Cylinder{0.03, 0.1}, 48), "continuous about z, both ways round"},
          {"cone", geometry::make_mesh(geometry::Cone{0.03, 0.1}, 48), "continuous about z"},
          {"box", geometry::make_mesh(geometry::BoxShape{Vector3d(0.05, 0.1, 0.2)}), "4 rotations about several axes"},
          {"carton", geometry::make_gable_carton(0.07, 0.09, 0.18, 0.22), "2 turns about z"}};
}

/// The model that a scene gets from the model file that was made of a mesh.
core::Result<belief::ObjectModel> model_in_a_scene(const MeshInspection& inspection,
                                                   const MeshInspectionOptions& options,
                                                   const std::filesystem::path& folder) {
  PRESCENE_TRY(const interfaces::ModelFile file, model_file(inspection, options, folder / "model.yaml"));
  PRESCENE_RETURN_IF_ERROR(interfaces::write_model(folder / "model.yaml", file));
  PRESCENE_TRY(const auto scene,
               load_scene_text("models: {m: {file: model.yaml}}\nobjects: {m: {model: m, pose: {}}}\n",
                               folder / "scene.yaml", {}));
  return scene->models[0];
}

TEST(MeshInspection, ASceneGetsTheModelThatWasFound) {
  const tests::ScratchDir folder;
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const auto path = folder.path() / (std::string(c.name) + ".ply");
    // Beside its own origin and in millimetres, so that place and unit matter.
    const geometry::Pose X_MO = geometry::Pose::from_translation({0.01, -0.02, 0.03});
    ASSERT_TRUE(interfaces::write_ply(path, geometry::scaled(geometry::transformed(c.mesh, X_MO), 1000.0)).ok());
    MeshInspectionOptions options;
    options.read.metres_per_unit = 0.001;
    options.density = 700.0;
    const auto found = inspect_mesh(path, options);
    ASSERT_TRUE(found.ok()) << found.status().message();
    EXPECT_EQ(symmetry_text(found->symmetry), c.symmetry);
    const auto truth = geometry::mass_properties(geometry::transformed(c.mesh, X_MO), 700.0);
    ASSERT_TRUE(truth.ok());

    const auto model = model_in_a_scene(*found, options, folder.path());
    ASSERT_TRUE(model.ok()) << model.status().message();
    EXPECT_NEAR(belief::mean(model->mass), truth->mass, 1e-9 * truth->mass);
    EXPECT_LT((belief::mean(model->center_of_mass) - truth->p_BoBcm).norm(), 1e-9);
    EXPECT_LT((model->unit_inertia - truth->I_BBcm_B / truth->mass).norm(), 1e-9);
    EXPECT_EQ(symmetry_text(model->symmetry), c.symmetry);
    EXPECT_LT((model->symmetry.p_BoC - found->symmetry.p_BoC).norm(), 1e-9);
    EXPECT_LT(geometry::radius_about(*model->visual, Vector3d::Zero()), 0.2) << "metres";
  }
}

TEST(MeshInspection, TexturesThatAreNotReadAreRemarkedOn) {
  const tests::ScratchDir folder;
  const std::string said = std::string(interfaces::kUnreadLook) + ": " + std::string(interfaces::kUnreadLookRemedy);
  const std::string obj = interfaces::encode_obj(geometry::make_mesh(geometry::BoxShape{Vector3d(0.05, 0.1, 0.2)}));
  for (const bool textured : {false, true}) {
    SCOPED_TRACE(textured);
    const auto path = folder.path() / (textured ? "textured.obj" : "plain.obj");
    ASSERT_TRUE(interfaces::write_file(path, (textured ? "mtllib box.mtl\nusemtl box\n" : "") + obj).ok());
    const auto inspected = inspect_mesh(path, {});
    ASSERT_TRUE(inspected.ok()) << inspected.status().message();
    EXPECT_EQ(std::count(inspected->remarks.begin(), inspected->remarks.end(), said), textured ? 1 : 0);
    // Once, though two models have it.
    const std::string shape = "{mesh: {file: " + path.filename().string() + "}, mass: 1}";
    interfaces::FileReport report;
    const auto scene =
        load_reported_scene("models: {a: " + shape + ", b: " + shape + "}\nobjects: {o: {model: a, pose: {}}}\n",
                            folder.path() / "scene.yaml", {}, report, Symmetries::kAsWritten);
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_EQ(
        std::count_if(report.remarks.begin(), report.remarks.end(),
                      [&](const interfaces::Problem& remark) { return remark.text() == path.string() + ": " + said; }),
        textured ? 1 : 0);
  }
}

TEST(MeshInspection, AnOpenMeshGetsTheMassOfItsHullAndSaysSo) {
  const tests::ScratchDir folder;
  geometry::TriangleMesh open = geometry::make_mesh(geometry::BoxShape{Vector3d(0.1, 0.1, 0.1)});
  open.triangles.pop_back();
  ASSERT_TRUE(interfaces::write_ply(folder.path() / "open.ply", open).ok());
  const auto found = inspect_mesh(folder.path() / "open.ply", {});
  ASSERT_TRUE(found.ok());
  EXPECT_FALSE(found->mass.has_value());
  const auto file = model_file(*found, {}, folder.path() / "open.yaml");
  ASSERT_TRUE(file.ok());
  EXPECT_NEAR(belief::mean(file->model.mass), 0.5, 1e-9);
  EXPECT_THAT(file->remarks.back(), testing::HasSubstr("convex hull"));
  EXPECT_THAT(found->remarks, testing::Contains(testing::HasSubstr("nothing gets into its hollows")));
}

TEST(MeshInspection, HollowThingsKeepTheirHollowUnlessSomebodyChoosesOtherwise) {
  const tests::ScratchDir folder;
  const geometry::TriangleMesh mug =
      geometry::make_lathe({{0.0, 0.0}, {0.04, 0.0}, {0.04, 0.1}, {0.036, 0.1}, {0.036, 0.006}, {0.0, 0.006}}, 48);
  ASSERT_TRUE(interfaces::write_ply(folder.path() / "mug.ply", mug).ok());
  const auto use_of = [&](std::optional<belief::MeshUse> use, std::string* remarks) {
    MeshInspectionOptions options;
    options.use = use;
    const auto found = inspect_mesh(folder.path() / "mug.ply", options);
    EXPECT_TRUE(found.ok()) << found.status().message();
    EXPECT_NEAR(*found->hollow, 0.036 * 0.036 * 0.094 / (0.04 * 0.04 * 0.1), 1e-9);
    for (const std::string& remark : found->remarks) *remarks += remark + "\n";
    const auto model = model_in_a_scene(*found, options, folder.path());
    EXPECT_TRUE(model.ok()) << model.status().message();
    return std::get<belief::MeshShape>(model->collision[0]).use;
  };
  std::string by_default, chosen, spheres;
  EXPECT_EQ(use_of({}, &by_default), belief::MeshUse::kSpheres);
  EXPECT_THAT(by_default, testing::HasSubstr("76 % of its convex hull is hollow: in a scene it collides as spheres"));
  EXPECT_EQ(use_of(belief::MeshUse::kConvexHull, &chosen), belief::MeshUse::kConvexHull);
  EXPECT_THAT(chosen, testing::HasSubstr("with use: convex_hull nothing gets into that"));
  EXPECT_EQ(use_of(belief::MeshUse::kSpheres, &spheres), belief::MeshUse::kSpheres);
  EXPECT_EQ(spheres, "");
}

TEST(MeshInspection, OriginsAreAsHighAboveTheGroundAsTheLowestVertexIsBelowThem) {
  const tests::ScratchDir folder;
  // Its origin is outside of it, and its centre of mass elsewhere.
  geometry::TriangleMesh cone = geometry::make_mesh(geometry::Cone{0.04, 0.1}, 24);
  for (Vector3d& vertex : cone.vertices) vertex += Vector3d(0.03, -0.02, 0.2);
  ASSERT_TRUE(interfaces::write_ply(folder.path() / "cone.ply", cone).ok());
  const auto found = inspect_mesh(folder.path() / "cone.ply", {});
  ASSERT_TRUE(found.ok()) << found.status().message();
  ASSERT_GE(found->resting_poses.size(), 2u);
  for (const geometry::RestingPose& pose : found->resting_poses) {
    double lowest = std::numeric_limits<double>::infinity();
    for (const Vector3d& vertex : cone.vertices) lowest = std::min(lowest, (pose.R_WB * vertex).z());
    EXPECT_NEAR(origin_height(*found, pose), -lowest, 1e-6);
  }
  EXPECT_TRUE(to_json(*found)["resting_poses"][0].contains("origin_height"));
}

TEST(MeshInspection, CanBeStoppedAtEachStep) {
  const tests::ScratchDir folder;
  const geometry::TriangleMesh ball = geometry::make_mesh(geometry::Sphere{0.04}, 48);
  ASSERT_TRUE(interfaces::write_ply(folder.path() / "ball.ply", ball).ok());
  std::vector<std::string> steps;
  MeshInspectionOptions options;
  double last = 0.0;
  options.progress = [&](const core::Progress& progress) {
    steps.push_back(progress.text);
    EXPECT_GE(progress.fraction, last);
    last = progress.fraction;
  };
  ASSERT_TRUE(inspect_mesh(folder.path() / "ball.ply", options).ok());
  ASSERT_EQ(last, 1.0);
  for (const std::string& step : std::vector(steps)) {
    core::Cancellation cancellation;
    options.read.cancellation = &cancellation;
    options.progress = [&](const core::Progress& progress) {
      if (progress.text == step) cancellation.request();
    };
    EXPECT_EQ(inspect_mesh(folder.path() / "ball.ply", options).status().code(), core::StatusCode::kCancelled) << step;
  }
}

geometry::TriangleMesh inside_out(geometry::TriangleMesh mesh) {
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

TEST(MeshInspection, TellsWhatIsInsideOut) {
  const tests::ScratchDir folder;
  const auto box = [](double size, double x) {
    return geometry::transformed(geometry::make_mesh(geometry::BoxShape{Vector3d::Constant(size)}),
                                 geometry::Pose::from_translation({x, 0, 0}));
  };
  const auto remarks_on = [&](const geometry::TriangleMesh& mesh) {
    EXPECT_TRUE(interfaces::write_ply(folder.path() / "a.ply", mesh).ok());
    const auto found = inspect_mesh(folder.path() / "a.ply", {});
    EXPECT_TRUE(found.ok()) << found.status().message();
    std::string text;
    for (const std::string& remark : found->remarks) text += remark + "\n";
    return text;
  };
  const std::string whole = remarks_on(inside_out(box(0.1, 0.0)));
  EXPECT_THAT(whole, testing::HasSubstr("because it is inside out"));
  EXPECT_THAT(whole, testing::Not(testing::HasSubstr("not closed")));
  EXPECT_THAT(remarks_on(geometry::joined(box(0.1, 0.0), inside_out(box(0.04, 0.08)))),
              testing::HasSubstr("1 part of 12 triangles that lie outside of the others are inside out"));
  EXPECT_THAT(remarks_on(geometry::joined(box(0.1, 0.0), inside_out(box(0.04, 0.0)))),
              testing::Not(testing::HasSubstr("inside out")))
      << "a cavity";
}

/// The hull of points that lie about evenly on a ball, on a spiral; so little beside it that no two are alike.
geometry::TriangleMesh fine_ball(double radius, int points) {
  std::vector<Vector3d> on_it;
  core::RandomStream stream(1, core::Purpose::kTest);
  for (int i = 0; i < points; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0 + stream.uniform(-0.2, 0.2)) / points, across = std::sqrt(1.0 - z * z);
    const double angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * i;
    on_it.push_back(radius * Vector3d(across * std::cos(angle), across * std::sin(angle), z));
  }
  return *geometry::convex_hull(on_it);
}

/// m: of the largest ball about the origin that is inside of the convex mesh.
double inscribed_radius(const geometry::TriangleMesh& mesh) {
  double least = 1e9;
  for (const auto& t : mesh.triangles) {
    const Vector3d& a = mesh.vertices[t[0]];
    least = std::min(least, (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).normalized().dot(a));
  }
  return least;
}

TEST(MeshInspection, SaysHowFarASimplifiedHullStaysBehind) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "ball.ply";
  for (const int points : {1000, 3000}) {  // Of more than 1500, both steppers leave out some.
    const double radius = 0.05, rounding = 2e-4;
    const geometry::TriangleMesh ball = fine_ball(radius, points);
    ASSERT_TRUE(interfaces::write_ply(path, ball).ok());
    const auto found = inspect_mesh(path, {});
    ASSERT_TRUE(found.ok() && found->lockstep_hull) << found.status().message();
    const LockstepHull& hull = *found->lockstep_hull;
    EXPECT_EQ(hull.vertices, static_cast<std::size_t>(points));
    EXPECT_LE(hull.kept, 64U);
    // Of all polyhedra with n vertices in a ball, none has an inscribed ball of more than 1 / (sqrt(3) tan w) of its
    // radius, w = pi n / (6 (n - 2)) [Fejes Toth 1953]: a face is as near, and the mesh reaches as far as the ball in
    // it.
    const double w = std::numbers::pi / 6.0 * 64.0 / 62.0;
    const double best = (radius - rounding) / (std::sqrt(3.0) * std::tan(w)) + rounding;
    EXPECT_GT(hull.error, inscribed_radius(ball) - best) << points;
    EXPECT_LT(hull.error, 4.5 * (radius - best)) << points;
    const auto json = to_json(*found)["lockstep_hull"];
    EXPECT_EQ(json["vertices"].get<std::size_t>(), hull.vertices);
    EXPECT_EQ(json["kept"].get<std::size_t>(), hull.kept);
    EXPECT_EQ(json["error"].get<double>(), hull.error);
  }
}

/// What lockstep itself says.
double simulated_error(const belief::Scene& scene) {
  core::ThreadPool pool(1);
  BackendSettings settings;
  settings.stepper = Stepper::kLockstep;
  Backends backends(pool, settings);
  const auto simulator = backends.make_simulator(scene);
  EXPECT_TRUE(simulator.ok()) << simulator.status().message();
  return simulator ? (*simulator)->stepper().hull_error : -1.0;
}

TEST(MeshInspection, ASimplifiedHullIsTheOneThatIsSimulated) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "thing.ply";
  const geometry::TriangleMesh can = geometry::make_mesh(geometry::Cylinder{0.03, 0.1}, 48);
  // Small things are simulated as similar ones of household size; a box is its hull.
  const geometry::TriangleMesh box = geometry::make_mesh(geometry::BoxShape{Vector3d(0.05, 0.1, 0.2)});
  for (const auto& [mesh, mass] : {std::pair(fine_ball(0.05, 1000), "0.5"), std::pair(fine_ball(0.004, 1000), "0.0003"),
                                   std::pair(can, "0.3"), std::pair(box, "1")}) {
    ASSERT_TRUE(interfaces::write_ply(path, mesh).ok());
    const auto found = inspect_mesh(path, {});
    ASSERT_TRUE(found.ok() && found->lockstep_hull) << found.status().message();
    const auto scene = load_scene_text(
        "models: {m: {mesh: {file: thing.ply, use: convex_hull}, mass: " + std::string(mass) + "}}\n" +
            "supports: {floor: {ground: {size: 4}}}\nobjects: {m: {model: m, pose: {position: [0, 0, 1]}}}\n",
        folder.path() / "scene.yaml", {});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    const double error = found->lockstep_hull->error;
    EXPECT_NEAR(error, simulated_error(**scene), 1e-9) << mesh.vertices.size();
    EXPECT_EQ(error > 0.0, mesh.vertices.size() > 64) << mesh.vertices.size();
    if (error == 0.0) {
      EXPECT_EQ(found->lockstep_hull->kept, found->lockstep_hull->vertices);
    }
  }
}

TEST(MeshInspection, ValidationRemarksOnHullsThatStayBehind) {
  const tests::ScratchDir folder;
  ASSERT_TRUE(interfaces::write_ply(folder.path() / "ball.ply", fine_ball(0.05, 1000)).ok());
  ASSERT_TRUE(interfaces::write_ply(folder.path() / "box.ply",
                                    geometry::make_mesh(geometry::BoxShape{Vector3d(0.05, 0.1, 0.2)}))
                  .ok());
  const auto remarks_on = [&](const std::string& mesh, const std::string& shape, Symmetries symmetries) {
    interfaces::FileReport report;
    const auto scene = load_reported_scene("models: {m: {mesh: {file: " + mesh + "}, mass: 0.1, symmetry: none}}\n" +
                                               "supports: {s: {" + shape + "}}\n" +
                                               "objects: {m: {model: m, pose: {position: [0, 0, 1]}}}\n",
                                           folder.path() / "scene.yaml", {}, report, symmetries);
    EXPECT_TRUE(scene.ok()) << scene.status().message();
    std::string text;
    for (const interfaces::Problem& remark : report.remarks) text += remark.text() + "\n";
    return text;
  };
  const std::string ground = "ground: {size: 4}", ball = "mesh: {file: ball.ply, use: convex_hull}";
  EXPECT_THAT(
      remarks_on("ball.ply", ground, Symmetries::kSuggested),
      testing::AllOf(testing::HasSubstr("models.m: in lockstep its convex hull is simplified to at most 64 vertices"),
                     testing::HasSubstr("describe it as a sphere"), testing::Not(testing::HasSubstr("supports.s"))));
  EXPECT_THAT(
      remarks_on("box.ply", ball, Symmetries::kSuggested),
      testing::AllOf(testing::HasSubstr("supports.s: in lockstep"), testing::Not(testing::HasSubstr("models."))));
  EXPECT_EQ(remarks_on("box.ply", ground, Symmetries::kSuggested), "");
  EXPECT_EQ(remarks_on("ball.ply, use: spheres", ground, Symmetries::kSuggested), "") << "no hull";
  EXPECT_EQ(remarks_on("ball.ply", ball, Symmetries::kAsWritten), "") << "nobody asked";
}

TEST(MeshInspection, AModelThatNoSceneCouldUseIsNotMade) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "box.ply";
  ASSERT_TRUE(interfaces::write_ply(path, geometry::make_mesh(geometry::BoxShape{Vector3d(0.1, 0.1, 0.1)})).ok());
  for (const double scale : {1e6, 1e3, 1e-5, 1e150}) {
    MeshInspectionOptions options;
    options.read.metres_per_unit = scale;
    const auto found = inspect_mesh(path, options);
    const core::Status status =
        found ? model_file(*found, options, folder.path() / "box.yaml").status() : found.status();
    EXPECT_EQ(status.code(), core::StatusCode::kInvalidInput) << scale;
    EXPECT_THAT(status.message(), testing::HasSubstr("--scale")) << scale;
  }
}

TEST(MeshInspection, AFlatMeshMakesNoModel) {
  const tests::ScratchDir folder;
  const geometry::TriangleMesh flat{{{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}}, {{0, 1, 2}}};
  ASSERT_TRUE(interfaces::write_ply(folder.path() / "flat.ply", flat).ok());
  const auto found = inspect_mesh(folder.path() / "flat.ply", {});
  ASSERT_TRUE(found.ok());
  const auto file = model_file(*found, {}, folder.path() / "flat.yaml");
  ASSERT_FALSE(file.ok());
  EXPECT_THAT(file.status().message(), testing::HasSubstr("flat"));
}

}  // namespace
}  // namespace prescene::service
