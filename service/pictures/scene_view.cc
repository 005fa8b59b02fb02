// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/pictures/scene_view.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "prescene/interfaces/reports/lettering.h"
#include "prescene/rendering/sensor/simulated_camera.h"

namespace prescene::service {
namespace {

using Eigen::Vector2d;
using geometry::ColorImage;
using geometry::Rgb;
using geometry::Vector3d;

constexpr int kFiner = 2;      // pixels are rendered so many times finer on each side, then averaged
constexpr double kPale = 0.5;  // share of white over the scene, so that what is painted on it stands out

void mix(Rgb& pixel, const Rgb& color, double share) {
  for (std::size_t c = 0; c < 3; ++c)
    pixel[c] = static_cast<std::uint8_t>(std::lround((1.0 - share) * pixel[c] + share * color[c]));
}

/// z of C towards `forward`, x level.
geometry::Quaterniond looking(const Vector3d& forward, const Vector3d& right) {
  geometry::Matrix3d R_WC;
  R_WC << right, forward.cross(right), forward;
  return geometry::Quaterniond(R_WC);
}

geometry::PinholeCamera enlarged(const geometry::PinholeCamera& camera) {
  geometry::PinholeCamera large = camera;
  large.width *= kFiner;
  large.height *= kFiner;
  large.fx *= kFiner;
  large.fy *= kFiner;
  large.cx = kFiner * (camera.cx + 0.5) - 0.5;
  large.cy = kFiner * (camera.cy + 0.5) - 0.5;
  return large;
}

rendering::RenderOptions options_for(const MapView& view) {
  rendering::RenderOptions options;
  options.near_depth = 0.02;
  options.far_depth = view.X_WC.translation.norm() + 100.0;
  options.normals = true;
  return options;
}

/// 1 where surfaces end or bend, as a draughtsman would draw them.
geometry::Image<std::uint8_t> edges_of(const rendering::RenderedView& images) {
  constexpr double kBend = 0.85;   // cosine
  constexpr double kJump = 0.012;  // m, more where surfaces are seen flat
  const auto edge_between = [&](int x, int y, int u, int v) {
    const float a = images.depth(x, y), b = images.depth(u, v);
    if ((a > 0.0f) != (b > 0.0f)) return true;
    if (!(a > 0.0f)) return false;
    if (static_cast<double>(images.normals(x, y).dot(images.normals(u, v))) < kBend) return true;
    const double flat = std::max(0.05, std::abs(static_cast<double>(images.normals(x, y).z())));
    return std::abs(static_cast<double>(a - b)) > kJump / flat;
  };
  geometry::Image<std::uint8_t> edges(images.depth.width(), images.depth.height(), 0);
  for (int y = 1; y + 1 < edges.height(); ++y)
    for (int x = 1; x + 1 < edges.width(); ++x)
      edges(x, y) = edge_between(x, y, x + 1, y) || edge_between(x, y, x, y + 1) || edge_between(x, y, x - 1, y) ||
                    edge_between(x, y, x, y - 1);
  return edges;
}

void draw_edges(const geometry::Image<std::uint8_t>& edges, ColorImage& picture) {
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (edges.data()[i] != 0) mix(picture.data()[i], {60, 62, 68}, 0.6);
}

struct Rendered {
  rendering::RenderedView images;
  ColorImage pale;
};

core::Result<Rendered> render_pale(const belief::Scene& scene, const belief::WorldState& state, const MapView& view,
                                   Backends& backends) {
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  const filter::BeliefView what =
      filter::render_scene(scene, state, {}, filter::MeshDetail::kDisplay, backends.meshes());
  Rendered rendered;
  PRESCENE_RETURN_IF_ERROR(renderer->render(what.scene, view.camera, view.X_WC, options_for(view), &rendered.images));
  rendering::SimulatedCameraOptions look;
  look.background_low = look.background_high = {225, 228, 232};
  rendering::shade(what.scene, rendered.images, view.X_WC, look, &rendered.pale);
  for (std::size_t i = 0; i < rendered.pale.size(); ++i) {
    Rgb& pixel = rendered.pale.data()[i];
    // Half of the colour and most of the darkness are taken out.
    const auto grey = static_cast<std::uint8_t>((pixel[0] + pixel[1] + pixel[2]) / 3);
    mix(pixel, {grey, grey, grey}, 0.5);
    mix(pixel, {255, 255, 255}, kPale);
  }
  return rendered;
}

}  // namespace

MapView map_view(const Vector2d& low, const Vector2d& high, int width, int height) {
  constexpr double kHeights = 25.0;  // of the extent: things as high as they are wide shift by 2 %
  MapView view;
  const double scale = std::min(width / (high.x() - low.x()), height / (high.y() - low.y()));
  const double distance = kHeights * (high - low).maxCoeff();
  view.camera = {width, height, scale * distance, scale * distance, 0.5 * (width - 1), 0.5 * (height - 1)};
  const Vector2d middle = 0.5 * (low + high);
  view.X_WC = {looking(-Vector3d::UnitZ(), Vector3d::UnitX()), {middle.x(), middle.y(), distance}};
  return view;
}

MapView perspective_view(std::span<const Vector3d> points, const Vector3d& away, int width, int height) {
  constexpr double kFocal = 1.9;  // of the picture's height: a narrow view distorts little
  constexpr double kFilled = 0.94;
  MapView view;
  view.camera = {width, height, kFocal * height, kFocal * height, 0.5 * (width - 1), 0.5 * (height - 1)};
  const Vector3d forward = -away.normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  view.X_WC.rotation = looking(forward, right);
  Vector3d low = Vector3d::Constant(1e9), high = Vector3d::Constant(-1e9);
  for (const Vector3d& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Vector3d middle = 0.5 * (low + high);
  // The nearest distance from which all points lie within the picture; then moved so that they lie in its middle.
  double near = 0.0, far = 100.0 * (high - low).norm();
  const auto extent_at = [&](double distance, Vector2d& least, Vector2d& most) {
    view.X_WC.translation = middle - distance * forward;
    least.setConstant(1e9);
    most.setConstant(-1e9);
    const geometry::Pose X_CW = view.X_WC.inverse();
    for (const Vector3d& point : points) {
      const Vector3d p_CQ = X_CW * point;
      if (p_CQ.z() < 0.05) return false;
      const Vector2d p = view.camera.project(p_CQ);
      least = least.cwiseMin(p);
      most = most.cwiseMax(p);
    }
    return true;
  };
  Vector2d least, most;
  for (int i = 0; i < 50; ++i) {
    const double distance = 0.5 * (near + far);
    const bool seen = extent_at(distance, least, most);
    const bool fits = seen && (most - least).x() <= kFilled * width && (most - least).y() <= kFilled * height;
    (fits ? far : near) = distance;
  }
  extent_at(far, least, most);
  view.camera.cx -= 0.5 * (least + most).x() - 0.5 * (width - 1);
  view.camera.cy -= 0.5 * (least + most).y() - 0.5 * (height - 1);
  return view;
}

Rgb warm_color(double value) {
  static constexpr std::array<std::array<double, 3>, 7> kStops{
      {{255, 244, 176}, {254, 217, 112}, {253, 178, 62}, {244, 128, 34}, {220, 74, 24}, {172, 28, 28}, {108, 8, 32}}};
  const double place = std::clamp(std::isfinite(value) ? value : 0.0, 0.0, 1.0) * (kStops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(place), kStops.size() - 2);
  Rgb color;
  for (std::size_t c = 0; c < 3; ++c)
    color[c] = static_cast<std::uint8_t>(
        std::lround(kStops[i][c] + (place - static_cast<double>(i)) * (kStops[i + 1][c] - kStops[i][c])));
  return color;
}

double warm_opacity(double value) {
  const double t = std::clamp((value - 0.02) / 0.2, 0.0, 1.0);
  return 0.92 * t * t * (3.0 - 2.0 * t);
}

core::Result<SceneView> SceneView::make(const belief::Scene& scene, const belief::WorldState* state,
                                        std::size_t left_out, const MapView& view, Backends& backends) {
  constexpr double kSeenThrough = 0.5;
  SceneView made(view);
  made.view_.camera = enlarged(view.camera);
  belief::Scene supports = scene;
  supports.robot.clear();
  supports.objects.clear();
  PRESCENE_TRY(Rendered bare, render_pale(supports, {}, made.view_, backends));
  const geometry::Image<std::uint8_t> edges = edges_of(bare.images);
  made.image_ = std::move(bare.pale);
  made.support_depth_ = made.depth_ = std::move(bare.images.depth);
  made.object_edges_ = geometry::Image<std::uint8_t>(edges.width(), edges.height(), 0);
  if (state && scene.objects.size() > 1) {
    belief::Scene others = scene;
    others.robot.clear();
    belief::WorldState where = *state;
    where.objects.erase(where.objects.begin() + static_cast<std::ptrdiff_t>(left_out));
    others.objects.erase(others.objects.begin() + static_cast<std::ptrdiff_t>(left_out));
    PRESCENE_TRY(const Rendered full, render_pale(others, where, made.view_, backends));
    made.object_edges_ = edges_of(full.images);
    for (std::size_t i = 0; i < made.image_.size(); ++i) {
      if (edges.data()[i] != 0) made.object_edges_.data()[i] = 0;
      if (full.images.depth.data()[i] != made.depth_.data()[i])
        mix(made.image_.data()[i], full.pale.data()[i], kSeenThrough);
    }
    made.depth_ = full.images.depth;
  }
  draw_edges(edges, made.image_);
  draw_edges(made.object_edges_, made.image_);
  return made;
}

void SceneView::paint(const std::vector<DensityLevel>& levels, const GroundDensity& whole,
                      std::span<const double> outlined_shares) {
  constexpr double kTolerance = 0.012;  // m: a plane that lies so little below a surface lies on it
  if (!(whole.largest_mass() > 0.0)) return;
  geometry::Image<float> painted(image_.width(), image_.height(), 0.0f);
  const Vector3d& eye = view_.X_WC.translation;
  for (int v = 0; v < image_.height(); ++v) {
    for (int u = 0; u < image_.width(); ++u) {
      const Vector3d ray = view_.X_WC.rotation * view_.camera.unproject(u, v, 1.0);
      const double depth = support_depth_(u, v);
      double value = 0.0, mass = 0.0;
      for (const DensityLevel& level : levels) {
        const double t = (level.height - eye.z()) / ray.z();  // z in C of the plane at this pixel
        if (!(t > 0.0) || !std::isfinite(t)) continue;
        const Vector3d p_WQ = eye + t * ray;
        if (depth > 0.0 && (eye + depth * ray).z() > level.height + kTolerance && depth < t) continue;
        value += level.density.at(p_WQ.x(), p_WQ.y());
        mass += level.density.mass_around(p_WQ.x(), p_WQ.y());
      }
      painted(u, v) = static_cast<float>(value);
      const double shown = std::sqrt(std::min(1.0, mass / whole.largest_mass()));
      mix(image_(u, v), warm_color(shown), warm_opacity(shown));
    }
  }
  draw_edges(object_edges_, image_);
  for (const double share : outlined_shares) {
    const auto level = static_cast<float>(whole.level_of(share));
    if (!(level > 0.0f)) continue;
    const int reach = share < 0.7 ? 2 : 1;
    for (int v = 0; v + 1 < image_.height(); ++v) {
      for (int u = 0; u + 1 < image_.width(); ++u) {
        const bool inside = painted(u, v) > level;
        if (inside == (painted(u + 1, v) > level) && inside == (painted(u, v + 1) > level)) continue;
        for (int y = v - reach + 1; y <= v + reach; ++y)
          for (int x = u - reach + 1; x <= u + reach; ++x)
            if (x >= 0 && y >= 0 && x < image_.width() && y < image_.height()) image_(x, y) = {70, 20, 20};
      }
    }
  }
}

core::Status SceneView::outline(const belief::Scene& scene, std::size_t object, const geometry::Pose& X_WO,
                                const Rgb& color, double tint, bool dashed, Backends& backends) {
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  const belief::ObjectModel& model = scene.model_of(scene.objects[object]);
  rendering::RenderScene alone;
  alone.instances.push_back({backends.meshes().get(model.visual, model.collision, filter::MeshDetail::kDisplay), X_WO,
                             filter::material_of(belief::SurfaceKind::kOpaque, model.color)});
  rendering::RenderedView images;
  PRESCENE_RETURN_IF_ERROR(renderer->render(alone, view_.camera, view_.X_WC, options_for(view_), &images));
  geometry::ColorImage shaded;
  rendering::shade(alone, images, view_.X_WC, {}, &shaded);
  const auto covered = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < image_.width() && y < image_.height() && images.depth(x, y) > 0.0f;
  };
  constexpr int kThick = 2 * kFiner, kDash = 14 * kFiner;
  for (int y = 0; y < image_.height(); ++y) {
    for (int x = 0; x < image_.width(); ++x) {
      if (!covered(x, y)) continue;
      const float before = depth_(x, y);
      const bool hidden = before > 0.0f && before < images.depth(x, y) - 0.002f;
      if (!hidden && tint > 0.0) {
        mix(image_(x, y), shaded(x, y), 0.75 * tint);
        mix(image_(x, y), color, 0.5 * tint);
      }
      const bool edge =
          !covered(x - kThick, y) || !covered(x + kThick, y) || !covered(x, y - kThick) || !covered(x, y + kThick);
      if (edge && (!dashed || (x + y) / kDash % 2 == 0)) mix(image_(x, y), color, hidden ? 0.55 : 1.0);
    }
  }
  return core::ok_status();
}

std::optional<Vector2d> SceneView::pixel(const Vector3d& p_WQ) const {
  const Vector3d p_CQ = view_.X_WC.inverse() * p_WQ;
  if (!(p_CQ.z() > 0.02)) return std::nullopt;
  return (view_.camera.project(p_CQ) - Vector2d::Constant(0.5 * (kFiner - 1))) / kFiner;
}

void SceneView::line(std::span<const Vector3d> points, double width, const Rgb& color, double opacity, bool arrow) {
  std::vector<Vector2d> run;
  bool run_hidden = false;
  const auto draw_run = [&] {
    if (run.size() > 1) interfaces::draw_line(run, kFiner * width, color, run_hidden ? 0.3 * opacity : opacity, image_);
  };
  std::vector<Vector2d> all;
  for (const Vector3d& point : points) {
    const std::optional<Vector2d> p = pixel(point);
    if (!p) continue;
    const Vector2d large = kFiner * *p + Vector2d::Constant(0.5 * (kFiner - 1));
    const int x = static_cast<int>(std::lround(std::clamp(large.x(), -1.0, 1e6)));
    const int y = static_cast<int>(std::lround(std::clamp(large.y(), -1.0, 1e6)));
    bool hidden = false;
    if (x >= 0 && y >= 0 && x < depth_.width() && y < depth_.height()) {
      const double z = (view_.X_WC.inverse() * point).z();
      hidden = depth_(x, y) > 0.0f && static_cast<double>(depth_(x, y)) < z - 0.01;
    }
    if (!run.empty() && hidden != run_hidden) {
      run.push_back(large);
      draw_run();
      run.assign(1, large);
    } else {
      run.push_back(large);
    }
    run_hidden = hidden;
    all.push_back(large);
  }
  draw_run();
  if (!arrow || all.size() < 2) return;
  // The head points along the last piece that is long enough to have a direction.
  const Vector2d tip = all.back();
  Vector2d tail = all.front();
  for (std::size_t i = all.size(); i-- > 0;) {
    tail = all[i];
    if ((tip - tail).norm() > 6.0 * kFiner * width) break;
  }
  const double length = (tip - tail).norm();
  if (length < 4.0 * kFiner) return;
  const Vector2d back = (tail - tip) / length * (4.5 * kFiner * width), side(-0.5 * back.y(), 0.5 * back.x());
  const std::array<Vector2d, 3> head{tip + back + side, tip, tip + back - side};
  interfaces::draw_line(head, kFiner * width, color, opacity, image_);
}

ColorImage SceneView::picture() const {
  ColorImage small(image_.width() / kFiner, image_.height() / kFiner);
  for (int y = 0; y < small.height(); ++y) {
    for (int x = 0; x < small.width(); ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        int sum = 0;
        for (int j = 0; j < kFiner; ++j)
          for (int i = 0; i < kFiner; ++i) sum += image_(kFiner * x + i, kFiner * y + j)[c];
        small(x, y)[c] = static_cast<std::uint8_t>((sum + kFiner * kFiner / 2) / (kFiner * kFiner));
      }
    }
  }
  return small;
}

}  // namespace prescene::service
