// SPDX-License-Identifier: Apache-2.0
// What every Renderer must do, checked against rays cast by Embree.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <thread>

#include "prescene/geometry/sampling.h"
#include "prescene/rendering/gpu/egl_renderer.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "scenes.h"
#include "tests/peers/ray_caster.h"

namespace prescene::rendering::renderer_contract_test {
namespace {

using core::Purpose;
using core::RandomStream;
using geometry::Pose;
using geometry::Vector3d;
using tests::camera_of_width;

struct Backend {
  const char* name;
  std::function<core::Result<std::unique_ptr<Renderer>>()> make;
};

const Backend kBackends[] = {
    {"reference", [] { return core::Result<std::unique_ptr<Renderer>>(make_reference_renderer()); }},
    {"egl", [] { return make_egl_renderer(); }},
};

class RendererContract : public testing::TestWithParam<Backend> {
 protected:
  void SetUp() override {
    auto made = GetParam().make();
    if (!made) {
      ASSERT_EQ(made.status().code(), core::StatusCode::kUnavailable) << made.status().message();
      GTEST_SKIP() << made.status().message();
    }
    renderer_ = *std::move(made);
  }

  void TearDown() override {
    if (IsSkipped()) return;
    EXPECT_GT(views_rendered_, 0) << "the suite never called " << GetParam().name;
  }

  RenderedView render(const RenderScene& scene, const geometry::PinholeCamera& camera, const Pose& X_WC,
                      const RenderOptions& options) {
    RenderedView view;
    const core::Status status = renderer_->render(scene, camera, X_WC, options, &view);
    EXPECT_TRUE(status.ok()) << status.message();
    ++views_rendered_;
    return view;
  }

  std::unique_ptr<Renderer> renderer_;
  int views_rendered_ = 0;
};

/// A scene of some of the twenty meshes as the renderer and as the ray caster know it.
struct TwinScene {
  RenderScene scene;
  tests::RayCaster rays;
  std::vector<geometry::TriangleMesh> meshes_C;

  void add(const geometry::TriangleMesh& mesh, const Pose& X_WM, const Pose& X_WC) {
    scene.instances.push_back({make_render_mesh(mesh), X_WM, SurfaceMaterial{}});
    meshes_C.push_back(geometry::transformed(mesh, X_WC.inverse() * X_WM));
    rays.add(meshes_C.back());
  }
};

/// What the comparison of one view with rays found.
struct Comparison {
  int compared = 0;
  int silhouettes = 0;
  int wrong_depths = 0;
  int wrong_labels = 0;
  int wrong_normals = 0;
  double worst_depth = 0.0;

  void operator+=(const Comparison& other) {
    compared += other.compared;
    silhouettes += other.silhouettes;
    wrong_depths += other.wrong_depths;
    wrong_labels += other.wrong_labels;
    wrong_normals += other.wrong_normals;
    worst_depth = std::max(worst_depth, other.worst_depth);
  }
};

/// Whether within a fiftieth of a pixel the ray meets something else than the plane of its own hit goes on to.
bool at_silhouette(const TwinScene& twin, const geometry::PinholeCamera& camera, const RenderOptions& options, int x,
                   int y, const std::optional<tests::RayHit>& hit) {
  constexpr double kOffset = 0.02;
  for (const double dx : {-kOffset, kOffset}) {
    for (const double dy : {-kOffset, kOffset}) {
      const Vector3d ray = camera.unproject(x + dx, y + dy, 1.0);
      const auto other = twin.rays.cast(Vector3d::Zero(), ray, options.near_depth, options.far_depth);
      if (hit.has_value() != other.has_value()) return true;
      if (!hit) continue;
      if (hit->mesh != other->mesh) return true;
      const double plane = hit->normal.dot(camera.unproject(x, y, hit->t)) / hit->normal.dot(ray);
      if (!(std::abs(plane - other->t) < 1e-3)) return true;
    }
  }
  return false;
}

Comparison compare(const TwinScene& twin, const geometry::PinholeCamera& camera, const RenderOptions& options,
                   const RenderedView& view, double tolerance) {
  Comparison result;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vector3d ray = camera.unproject(x, y, 1.0);
      const auto hit = twin.rays.cast(Vector3d::Zero(), ray, options.near_depth, options.far_depth);
      if (!hit && view.labels(x, y) == 0 && view.depth(x, y) == 0.0f) continue;
      if (at_silhouette(twin, camera, options, x, y, hit)) {
        ++result.silhouettes;
        continue;
      }
      ++result.compared;
      const double expected = hit ? hit->t : 0.0;
      const double error = std::abs(view.depth(x, y) - expected);
      if (error > tolerance + 1e-4 * expected) ++result.wrong_depths;
      result.worst_depth = std::max(result.worst_depth, error);
      if (view.labels(x, y) != (hit ? hit->mesh + 1 : 0)) ++result.wrong_labels;
      if (!hit) continue;
      const Vector3d normal = view.normals(x, y).cast<double>();
      // On an edge between two faces either normal is right: compare where faces are clearly seen.
      if (std::abs(normal.dot(hit->normal)) < 0.999) ++result.wrong_normals;
      if (normal.dot(ray) > 1e-6) ++result.wrong_normals;
    }
  }
  return result;
}

TEST_P(RendererContract, AgreesWithRaysOnTwentyMeshesInRandomPoses) {
  const std::vector<tests::NamedMesh> meshes = tests::twenty_meshes();
  ASSERT_EQ(meshes.size(), 20u);
  RandomStream stream(1, Purpose::kTest);
  RenderOptions options;
  options.near_depth = 0.1;
  options.far_depth = 3.0;
  options.normals = true;
  int crossing_near = 0;
  int partly_outside = 0;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    Comparison sum;
    for (int pose = 0; pose < 12; ++pose) {
      // Every third view has the mesh across the near plane.
      const bool close = pose % 3 == 2;
      const geometry::PinholeCamera camera = camera_of_width(pose % 2 == 0 ? 96 : 131);
      Pose X_WC;
      X_WC.rotation = geometry::uniform_rotation(stream);
      X_WC.translation = geometry::normal_vector(stream);
      const double radius = geometry::radius_about(meshes[i].mesh, Vector3d::Zero());
      const Pose X_CM =
          tests::random_view_pose(camera, close ? 0.1 : 0.3 + radius, close ? 0.1 + 0.5 * radius : 1.5, stream);
      const Pose X_CN = tests::random_view_pose(camera, 0.4, 1.5, stream);
      TwinScene twin;
      twin.add(meshes[i].mesh, X_WC * X_CM, X_WC);
      twin.add(meshes[(i + 7) % meshes.size()].mesh, X_WC * X_CN, X_WC);
      bool before = false, behind = false, inside = false, outside = false;
      for (const Vector3d& p : twin.meshes_C[0].vertices) {
        (p.z() < options.near_depth ? before : behind) = true;
        if (p.z() < options.near_depth) continue;
        const Eigen::Vector2d pixel = camera.project(p);
        const bool in_view =
            pixel.x() > 0 && pixel.x() < camera.width - 1 && pixel.y() > 0 && pixel.y() < camera.height - 1;
        (in_view ? inside : outside) = true;
      }
      crossing_near += before && behind ? 1 : 0;
      partly_outside += inside && outside ? 1 : 0;
      sum +=
          compare(twin, camera, options, render(twin.scene, camera, X_WC, options), renderer_->info().depth_tolerance);
    }
    EXPECT_EQ(sum.wrong_depths, 0) << meshes[i].name << ", worst " << sum.worst_depth << " m";
    EXPECT_EQ(sum.wrong_labels, 0) << meshes[i].name;
    // Faces nearly in one plane as seen may be told apart only by position.
    EXPECT_LE(sum.wrong_normals, sum.compared / 200) << meshes[i].name;
    EXPECT_GT(sum.compared, 1000) << meshes[i].name;
    EXPECT_LT(sum.silhouettes, sum.compared / 4) << meshes[i].name;
  }
  EXPECT_GT(crossing_near, 40);
  EXPECT_GT(partly_outside, 40);
}

TEST_P(RendererContract, LeavesNoHolesInASurface) {
  // A rough sheet larger than the view.
  const geometry::TriangleMesh sheet = tests::twenty_meshes()[17].mesh;
  RandomStream stream(2, Purpose::kTest);
  for (int i = 0; i < 20; ++i) {
    const geometry::PinholeCamera camera = camera_of_width(200);
    Pose X_CM;
    X_CM.rotation = geometry::exp_rotation(0.2 * geometry::normal_vector(stream));
    X_CM.translation = {0.0, 0.0, 0.5};
    RenderScene scene;
    scene.instances = {{make_render_mesh(geometry::scaled(sheet, 6.0)), X_CM, SurfaceMaterial{}}};
    const RenderedView view = render(scene, camera, Pose::identity(), {});
    int holes = 0;
    for (std::size_t k = 0; k < view.depth.size(); ++k) holes += view.depth.data()[k] == 0.0f ? 1 : 0;
    EXPECT_EQ(holes, 0);
  }
}

TEST_P(RendererContract, CutsAwayWhatIsTooNearOrTooFar) {
  const geometry::TriangleMesh wall = geometry::make_mesh(geometry::BoxShape{{4.0, 4.0, 0.01}});
  RenderScene scene;
  for (const double z : {0.5, 1.0, 2.0, 4.0})
    scene.instances.push_back({make_render_mesh(wall), Pose::from_translation({0, 0, z}), SurfaceMaterial{}});
  RenderOptions options;
  for (const auto& [near, far, label, depth] :
       {std::tuple{0.1, 10.0, 1, 0.495}, {0.6, 10.0, 2, 0.995}, {1.5, 10.0, 3, 1.995}, {2.5, 3.5, 0, 0.0}}) {
    options.near_depth = near;
    options.far_depth = far;
    const RenderedView view = render(scene, camera_of_width(32), Pose::identity(), options);
    EXPECT_EQ(view.labels(16, 12), label);
    EXPECT_NEAR(view.depth(16, 12), depth, 1e-4);
    EXPECT_TRUE(view.normals.empty());
  }
}

TEST_P(RendererContract, ReusesViewsOfAnySizeAndForgetsMeshes) {
  RenderedView view;
  RandomStream stream(3, Purpose::kTest);
  for (const int width : {64, 64, 33, 128, 64}) {
    const geometry::PinholeCamera camera = camera_of_width(width);
    // A mesh of its own each time, so that addresses come again.
    RenderScene scene;
    const double radius = stream.uniform(0.05, 0.3);
    scene.instances = {{make_render_mesh(geometry::make_mesh(geometry::Sphere{radius}, 64)),
                        Pose::from_translation({0, 0, 1}), SurfaceMaterial{}}};
    ASSERT_TRUE(renderer_->render(scene, camera, Pose::identity(), {}, &view).ok());
    ++views_rendered_;
    EXPECT_EQ(view.depth.width(), width);
    EXPECT_EQ(view.labels.height(), camera.height);
    const int x = static_cast<int>(std::lround(camera.cx));
    const int y = static_cast<int>(std::lround(camera.cy));
    EXPECT_NEAR(view.depth(x, y), 1.0 - radius, 0.003);
    EXPECT_EQ(view.labels(0, 0), 0);
  }
}

TEST_P(RendererContract, DrawsABatchAsItDrawsOneByOne) {
  const std::vector<tests::NamedMesh> meshes = tests::twenty_meshes();
  RandomStream stream(4, Purpose::kTest);
  std::vector<RenderScene> scenes(6);
  std::vector<RenderJob> jobs;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    const geometry::PinholeCamera camera = camera_of_width(40 + 10 * static_cast<int>(i % 3));
    scenes[i].instances = {
        {make_render_mesh(meshes[i].mesh), tests::random_view_pose(camera, 0.5, 1.0, stream), SurfaceMaterial{}}};
    jobs.push_back({&scenes[i], camera, Pose::identity()});
  }
  std::vector<RenderedView> views(jobs.size());
  ASSERT_TRUE(renderer_->render(jobs, {}, views).ok());
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const RenderedView alone = render(scenes[i], jobs[i].camera, Pose::identity(), {});
    EXPECT_TRUE(alone.depth == views[i].depth);
    EXPECT_TRUE(alone.labels == views[i].labels);
  }
}

TEST_P(RendererContract, MayBeUsedFromManyThreadsBesideAnotherRenderer) {
  auto second = GetParam().make();
  ASSERT_TRUE(second.ok());
  const geometry::PinholeCamera camera = camera_of_width(64);
  RenderScene scene;
  scene.instances = {{make_render_mesh(geometry::make_mesh(geometry::Cone{0.2, 0.4})),
                      Pose::from_translation({0, 0, 1}), SurfaceMaterial{}}};
  const RenderedView expected = render(scene, camera, Pose::identity(), {});
  std::vector<int> failures(4, 0);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < failures.size(); ++t) {
    threads.emplace_back([&, t] {
      RenderedView view;
      for (int i = 0; i < 10; ++i) {
        Renderer& renderer = (i + static_cast<int>(t)) % 2 == 0 ? *renderer_ : **second;
        if (!renderer.render(scene, camera, Pose::identity(), {}, &view).ok()) ++failures[t];
        if (!(view.labels == expected.labels)) ++failures[t];
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failures, std::vector<int>(4, 0));
}

TEST_P(RendererContract, RefusesWhatCanNotBeDrawn) {
  RenderScene scene;
  const geometry::PinholeCamera camera = camera_of_width(32);
  render(scene, camera, Pose::identity(), {});  // nothing to draw is fine
  RenderedView view;
  geometry::PinholeCamera flat = camera;
  flat.fx = 0.0;
  EXPECT_EQ(renderer_->render(scene, flat, Pose::identity(), {}, &view).code(), core::StatusCode::kInvalidInput);
  RenderOptions inside_out;
  inside_out.near_depth = 2.0;
  inside_out.far_depth = 1.0;
  EXPECT_EQ(renderer_->render(scene, camera, Pose::identity(), inside_out, &view).code(),
            core::StatusCode::kInvalidInput);
  RenderOptions dark;
  dark.color = true;
  dark.lighting.towards_light_W = Vector3d::Zero();
  EXPECT_EQ(renderer_->render(scene, camera, Pose::identity(), dark, &view).code(), core::StatusCode::kInvalidInput);
  Pose nowhere;
  nowhere.translation.x() = std::nan("");
  EXPECT_EQ(renderer_->render(scene, camera, nowhere, {}, &view).code(), core::StatusCode::kInvalidInput);
  scene.instances.resize(65536, {make_render_mesh({}), Pose::identity(), SurfaceMaterial{}});
  const core::Status status = renderer_->render(scene, camera, Pose::identity(), {}, &view);
  EXPECT_EQ(status.code(), core::StatusCode::kInvalidInput);
  EXPECT_NE(status.message().find("65535"), std::string::npos);
}

/// Largest difference of a channel away from where labels change.
struct ColorDifference {
  int compared = 0;
  int worst = 0;
};

ColorDifference compare_colors(const RenderedView& a, const RenderedView& b) {
  ColorDifference result;
  const auto label = [&](int x, int y) { return b.labels(x, y); };
  for (int y = 1; y + 1 < b.labels.height(); ++y) {
    for (int x = 1; x + 1 < b.labels.width(); ++x) {
      // At silhouettes and edges either surface is right.
      bool inside = a.labels(x, y) == label(x, y);
      for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        inside = inside && label(x + dx, y + dy) == label(x, y);
        inside = inside && b.normals(x + dx, y + dy).dot(b.normals(x, y)) > 0.9999f * b.normals(x, y).squaredNorm();
      }
      if (!inside) continue;
      ++result.compared;
      for (std::size_t c = 0; c < 3; ++c)
        result.worst = std::max(result.worst, std::abs(a.color(x, y)[c] - b.color(x, y)[c]));
    }
  }
  return result;
}

/// A square of two triangles in the plane z = 0, its texture once over it.
geometry::TriangleMesh square(double half) {
  geometry::TriangleMesh mesh;
  mesh.vertices = {{-half, -half, 0.0}, {half, -half, 0.0}, {half, half, 0.0}, {-half, half, 0.0}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  return mesh;
}
std::vector<std::array<Eigen::Vector2f, 3>> places_of(const geometry::TriangleMesh& mesh, double half, float repeats) {
  std::vector<std::array<Eigen::Vector2f, 3>> places;
  for (const auto& triangle : mesh.triangles) {
    std::array<Eigen::Vector2f, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d& p = mesh.vertices[triangle[k]];
      corners[k] = repeats * ((p.head<2>() / half).cast<float>() * 0.5f + Eigen::Vector2f(0.5f, 0.5f));
    }
    places.push_back(corners);
  }
  return places;
}

RenderOptions colored() {
  RenderOptions options;
  options.color = true;
  options.normals = true;
  return options;
}

TEST_P(RendererContract, DrawsTheColorsOfTheReference) {
  RandomStream stream(5, Purpose::kTest);
  auto texture = std::make_shared<geometry::ColorImage>(23, 17);
  for (std::size_t i = 0; i < texture->size(); ++i)
    for (std::uint8_t& channel : texture->data()[i]) channel = static_cast<std::uint8_t>(stream.uniform(0.0, 256.0));
  const auto reference = make_reference_renderer();
  int compared = 0;
  for (int view = 0; view < 12; ++view) {
    RenderScene scene;
    const geometry::PinholeCamera camera = camera_of_width(160);
    const geometry::TriangleMesh sheet = tests::twenty_meshes()[17].mesh;
    const geometry::TriangleMesh ball = geometry::make_mesh(geometry::Sphere{0.1}, 12);
    const geometry::TriangleMesh flat = square(0.15);
    MeshLook spotted, printed;
    for (std::size_t i = 0; i < ball.vertices.size(); ++i) {
      geometry::Rgb color;
      for (std::uint8_t& channel : color) channel = static_cast<std::uint8_t>(stream.uniform(0.0, 256.0));
      spotted.vertex_colors.push_back(color);
    }
    printed.texture_places = places_of(flat, 0.15, 1.7f);
    printed.texture = texture;
    Pose X_WC;
    X_WC.rotation = geometry::uniform_rotation(stream);
    X_WC.translation = geometry::normal_vector(stream);
    for (const MeshHandle& mesh :
         {make_render_mesh(sheet), make_render_mesh(ball, spotted), make_render_mesh(flat, printed)})
      scene.instances.push_back(
          {mesh, X_WC * tests::random_view_pose(camera, 0.4, 0.8, stream), SurfaceMaterial::opaque({200, 90, 30})});
    // Closer than the near plane in some: cut triangles have the same places.
    RenderOptions options = colored();
    options.near_depth = view % 3 == 0 ? 0.5 : 0.02;
    RenderedView expected;
    ASSERT_TRUE(reference->render(scene, camera, X_WC, options, &expected).ok());
    const ColorDifference difference = compare_colors(render(scene, camera, X_WC, options), expected);
    compared += difference.compared;
    // Texels of random colours change by 255 within a few pixels, and devices compute in single precision.
    EXPECT_LE(difference.worst, 2) << "view " << view;
  }
  EXPECT_GT(compared, 25000);
}

TEST_P(RendererContract, LightsInLinearLight) {
  // By hand: half of the light of sRGB 255 is 188, of 128 is 92.
  RenderScene scene;
  Pose facing;
  facing.rotation = Eigen::AngleAxisd(M_PI, Vector3d::UnitX());
  facing.translation = {0.0, 0.0, 1.0};
  scene.instances = {{make_render_mesh(square(0.2)), facing, SurfaceMaterial::opaque({255, 128, 0})}};
  RenderOptions options = colored();
  options.lighting.background = {10, 20, 30};
  const geometry::PinholeCamera camera = camera_of_width(64);
  const auto middle = [&](double ambient, double direct, const Vector3d& towards_light) {
    options.lighting.ambient = ambient;
    options.lighting.direct = direct;
    options.lighting.towards_light_W = towards_light;
    return render(scene, camera, Pose::identity(), options).color(32, 24);
  };
  const Vector3d from_camera(0.0, 0.0, -3.0);
  EXPECT_EQ(middle(1.0, 0.0, from_camera), (geometry::Rgb{255, 128, 0}));
  EXPECT_EQ(middle(0.5, 0.0, from_camera), (geometry::Rgb{188, 92, 0}));
  EXPECT_EQ(middle(0.0, 0.5, from_camera), (geometry::Rgb{188, 92, 0}));
  EXPECT_EQ(middle(0.25, 0.25, from_camera), (geometry::Rgb{188, 92, 0}));
  // From 60 degrees to the side, and from behind.
  EXPECT_EQ(middle(0.0, 1.0, {std::sqrt(3.0), 0.0, -1.0}), (geometry::Rgb{188, 92, 0}));
  EXPECT_EQ(middle(0.0, 1.0, {0.0, 0.0, 1.0}), (geometry::Rgb{0, 0, 0}));
  EXPECT_EQ(middle(5.0, 0.0, from_camera), (geometry::Rgb{255, 255, 0}));
  EXPECT_EQ(render(scene, camera, Pose::identity(), options).color(0, 0), (geometry::Rgb{10, 20, 30}));
  options.color = false;
  EXPECT_TRUE(render(scene, camera, Pose::identity(), options).color.empty());
}

TEST_P(RendererContract, PutsTexturesTheRightWayUp) {
  auto texture = std::make_shared<geometry::ColorImage>(2, 2);
  (*texture)(0, 0) = {255, 0, 0};
  (*texture)(1, 0) = {0, 255, 0};
  (*texture)(0, 1) = {0, 0, 255};
  (*texture)(1, 1) = {255, 255, 255};
  const geometry::TriangleMesh flat = square(0.2);
  MeshLook look;
  look.texture_places = places_of(flat, 0.2, 1.0f);
  look.texture = texture;
  look.vertex_colors.assign(4, {1, 2, 3});  // the texture goes before
  // Axes as the camera's: u to the right, v down.
  RenderScene scene;
  scene.instances = {{make_render_mesh(flat, look), Pose::from_translation({0.0, 0.0, 1.0}), {}}};
  RenderOptions options = colored();
  options.lighting.ambient = 1.0;
  options.lighting.direct = 0.0;
  const geometry::PinholeCamera camera = {101, 101, 100.0, 100.0, 50.0, 50.0};
  const RenderedView view = render(scene, camera, Pose::identity(), options);
  // 40 pixels wide: texel centres are 10 from the middle.
  EXPECT_EQ(view.color(40, 40), (*texture)(0, 0));
  EXPECT_EQ(view.color(60, 40), (*texture)(1, 0));
  EXPECT_EQ(view.color(40, 60), (*texture)(0, 1));
  EXPECT_EQ(view.color(60, 60), (*texture)(1, 1));
  // Half-way between red and green, in linear light.
  EXPECT_EQ(view.color(50, 40), (geometry::Rgb{188, 188, 0}));
}

TEST_P(RendererContract, GivesTheSameBitsAgainWhereItPromises) {
  if (!renderer_->info().deterministic_bits) {
    render({}, camera_of_width(8), Pose::identity(), {});
    GTEST_SKIP() << GetParam().name << " promises a tolerance only";
  }
  RenderScene scene;
  for (const tests::NamedMesh& mesh : tests::twenty_meshes())
    scene.instances.push_back({make_render_mesh(mesh.mesh), Pose::from_translation({0, 0, 0.7}), {}});
  const RenderedView first = render(scene, camera_of_width(100), Pose::identity(), {});
  const RenderedView again = render(scene, camera_of_width(100), Pose::identity(), {});
  EXPECT_TRUE(first.depth == again.depth);
  EXPECT_TRUE(first.labels == again.labels);
}

INSTANTIATE_TEST_SUITE_P(Backends, RendererContract, testing::ValuesIn(kBackends),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace prescene::rendering::renderer_contract_test
