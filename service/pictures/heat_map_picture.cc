// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/pictures/heat_map_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "heat_map_layout.h"
#include "heat_map_legend.h"
#include "heat_map_part.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/reports/lettering.h"
#include "prescene/interfaces/reports/overlay.h"
#include "prescene/service/pictures/scene_view.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using Eigen::Vector2d;
using geometry::ColorImage;
using geometry::Rgb;
using geometry::Vector3d;
using interfaces::TextAlign;

constexpr std::size_t kMostObjects = 3;
constexpr double kStill = 0.003;  // m: deviation of what hardly moves

void draw_object(const belief::Scene& scene, const HeatMapPart& part, bool with_labels, bool with_paths,
                 SceneView& view, Backends& backends, core::Status& status) {
  const auto keep = [&](const core::Status& done) {
    if (status.ok()) status = done;
  };
  if (with_paths) {
    for (const belief::ObjectPath* path : part.paths) {
      Rgb color = kSoft;
      for (const HeatMapPart::Ending& ending : part.endings)
        if (ending.name == path->outcome) color = ending.color;
      view.line(path->points, 1.0, color, 0.4, false);
    }
  }
  if (const belief::Trajectory* run = part.likeliest_run())
    keep(view.outline(scene, part.object, run->states[begin_of(*run, part.object)].objects[part.object].X_WO, kSoft,
                      with_labels ? 0.25 : 0.0, true, backends));
  for (const HeatMapPart::Ending& ending : part.endings) {
    if (!ending.run) continue;
    const belief::Trajectory& run = ending.run->trajectory;
    keep(view.outline(scene, part.object, run.final().objects[part.object].X_WO, ending.color, with_labels ? 0.55 : 0.0,
                      false, backends));
  }
  if (part.otherwise)
    keep(view.outline(scene, part.object, *part.otherwise, kSoft, with_labels ? 0.4 : 0.0, false, backends));
  if (!with_labels) return;
  for (const HeatMapPart::Ending& ending : part.endings) {
    if (!ending.run) continue;
    const belief::Trajectory& run = ending.run->trajectory;
    std::vector<Vector3d> way;
    for (std::size_t i = begin_of(run, part.object); i < run.states.size(); ++i)
      way.push_back(run.states[i].objects[part.object].X_WO.translation);
    view.line(way, 2.6, ending.color, 0.95, true);
  }
}

/// A number with its scale bar's unit.
double round_length(double metres) {
  const double power = std::pow(10.0, std::floor(std::log10(metres)));
  for (const double factor : {5.0, 2.0})
    if (factor * power <= metres) return factor * power;
  return power;
}

void draw_axes(const MapView& view, int x0, int y0, ColorImage& canvas) {
  const Vector3d& p = view.X_WC.translation;
  const double scale = view.camera.fx / p.z();
  const double step = round_length(0.28 * kPanelHeight / scale);
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6);
  const double half_x = 0.5 * kPanelWidth / scale, half_y = 0.5 * kPanelHeight / scale;
  for (double x = std::ceil((p.x() - half_x) / step) * step; x <= p.x() + half_x; x += step) {
    const double u = x0 + view.camera.cx + scale * (x - p.x());
    const std::array<Vector2d, 2> tick{Vector2d(u, y0 + kPanelHeight), Vector2d(u, y0 + kPanelHeight + 6)};
    interfaces::draw_line(tick, 1.2, kFrame, 1.0, canvas);
    interfaces::draw_text(fixed_text(std::abs(x) < 1e-9 ? 0.0 : x, decimals), {u, y0 + kPanelHeight + 22.0}, 10.0,
                          kSoft, canvas, TextAlign::kCenter);
  }
  for (double y = std::ceil((p.y() - half_y) / step) * step; y <= p.y() + half_y; y += step) {
    const double v = y0 + view.camera.cy - scale * (y - p.y());
    const std::array<Vector2d, 2> tick{Vector2d(x0 - 6, v), Vector2d(x0, v)};
    interfaces::draw_line(tick, 1.2, kFrame, 1.0, canvas);
    if (v < y0 + 28.0) continue;  // there the axis has its name
    interfaces::draw_text(fixed_text(std::abs(y) < 1e-9 ? 0.0 : y, decimals), {x0 - 10.0, v + 5.0}, 10.0, kSoft, canvas,
                          TextAlign::kRight);
  }
  interfaces::draw_text("x, m", {x0 + kPanelWidth - 4.0, y0 + kPanelHeight + 40.0}, 10.0, kSoft, canvas,
                        TextAlign::kRight);
  interfaces::draw_text("y, m", {x0 - 10.0, y0 + 12.0}, 10.0, kSoft, canvas, TextAlign::kRight);
}

void put(const ColorImage& panel, int x0, int y0, ColorImage& canvas) {
  for (int y = 0; y < panel.height(); ++y)
    for (int x = 0; x < panel.width(); ++x) canvas(x0 + x, y0 + y) = panel(x, y);
  const double left = x0 - 0.5, right = x0 + panel.width() - 0.5, top = y0 - 0.5, bottom = y0 + panel.height() - 0.5;
  const std::array<Vector2d, 5> frame{Vector2d(left, top), Vector2d(right, top), Vector2d(right, bottom),
                                      Vector2d(left, bottom), Vector2d(left, top)};
  interfaces::draw_line(frame, 1.2, kFrame, 1.0, canvas);
}

/// Labels of the endings beside their silhouettes, kept apart.
void draw_names(const HeatMapPart& part, const SceneView& view, int x0, int y0, ColorImage& canvas) {
  constexpr double kLetter = 13.0, kApart = 24.0;
  std::vector<Vector2d> taken;
  const auto place = [&](Vector2d at, double width) {
    at.x() = std::clamp(at.x(), x0 + 0.5 * width + 8.0, x0 + kPanelWidth - 0.5 * width - 8.0);
    at.y() = std::clamp(at.y(), y0 + 24.0, y0 + kPanelHeight - 12.0);
    for (int tries = 0; tries < 12; ++tries) {
      const bool free = std::none_of(taken.begin(), taken.end(), [&](const Vector2d& other) {
        return std::abs(other.y() - at.y()) < kApart && std::abs(other.x() - at.x()) < 0.5 * width + 90.0;
      });
      if (free) break;
      at.y() -= kApart;
      if (at.y() < y0 + 24.0) at.y() = y0 + kPanelHeight - 12.0;
    }
    taken.push_back(at);
    return at;
  };
  const auto label = [&](const Vector3d& p_WQ, double above, const std::string& text, const Rgb& color) {
    const std::optional<Vector2d> p = view.pixel(p_WQ);
    if (!p) return;
    const double width = interfaces::text_width(text, kLetter);
    const Vector2d at = place({x0 + p->x(), y0 + p->y() - above}, width);
    interfaces::draw_label(text, at, kLetter, color, canvas, TextAlign::kCenter);
  };
  const auto darker = [](Rgb color) {
    for (std::uint8_t& channel : color) channel = static_cast<std::uint8_t>(channel * 7 / 10);
    return color;
  };
  if (const belief::Trajectory* run = part.likeliest_run()) {
    const std::size_t begin = begin_of(*run, part.object);
    label(run->states[begin].objects[part.object].X_WO.translation, 62.0,
          begin > 0 ? part.poses->object + " let go here" : part.poses->object + " starts here", kInk);
  }
  if (part.otherwise && part.is_open())
    label(part.otherwise->translation, -46.0,
          "otherwise " + percent_text(1.0 - part.endings.front().probability->probability), kSoft);
  for (const HeatMapPart::Ending& ending : part.endings) {
    if (!ending.run) continue;
    label(ending.run->trajectory.final().objects[part.object].X_WO.translation, -46.0,
          ending.name + " " + percent_text(ending.probability->probability), darker(ending.color));
  }
}

core::Status draw_part(const belief::Scene& scene, const HeatMapPart& part, const HeatMapLegend& legend,
                       Backends& backends, int top, ColorImage& canvas) {
  const ShownSpace shown = shown_space(scene, part);
  // The map's grid covers more than the panel shows, whose sides may differ.
  const Vector2d low = shown.box.low.head<2>(), high = shown.box.high.head<2>();
  const double side = 0.75 * (high - low).maxCoeff();
  const Vector2d middle = 0.5 * (low + high);
  const Vector2d grid_low = middle - Vector2d::Constant(1.3 * side);
  const Vector2d grid_high = middle + Vector2d::Constant(1.3 * side);
  const GroundDensity density(part.poses->components, grid_low, grid_high, part.poses->heat_map.cell);
  const belief::ObjectModel& model = scene.model_of(scene.objects[part.object]);
  const std::vector<DensityLevel> levels = levels_of(*part.poses, belief::collision_mesh(model), grid_low, grid_high);
  const belief::Trajectory* run = part.likeliest_run();
  const belief::WorldState* others = run ? &run->final() : nullptr;
  const MapView map = map_view(low, high, kPanelWidth, kPanelHeight);
  Vector3d away(0.55, -0.8, 0.0);
  if (scene.camera) {
    const Vector3d from = scene.camera->X_WC.translation - Vector3d(middle.x(), middle.y(), 0.0);
    if (from.head<2>().norm() > 0.1) away = Vector3d(from.x(), from.y(), 0.0);
  }
  away = away.normalized() + 0.95 * Vector3d::UnitZ();
  const MapView oblique = perspective_view(shown.points, away, kPanelWidth, kPanelHeight);
  PRESCENE_TRY(SceneView from_above, SceneView::make(scene, others, part.object, map, backends));
  PRESCENE_TRY(SceneView in_space, SceneView::make(scene, others, part.object, oblique, backends));
  core::Status status;
  from_above.paint(levels, density, kOutlinedShares);
  draw_object(scene, part, false, false, from_above, backends, status);
  in_space.paint(levels, density, {});
  draw_object(scene, part, true, true, in_space, backends, status);
  if (!status.ok()) return status;

  const int x0 = kLeftAxis + kMargin, x1 = x0 + kPanelWidth + kMargin, y0 = top + kTitle;
  interfaces::draw_text("Where " + part.poses->object + " may end", {static_cast<double>(x0), top + 50.0}, 23.0, kInk,
                        canvas);
  interfaces::draw_text(scene.name, {static_cast<double>(x1 + kPanelWidth), top + 50.0}, 14.0, kSoft, canvas,
                        TextAlign::kRight);
  interfaces::draw_text("Seen from above", {static_cast<double>(x0), y0 - 10.0}, 12.0, kInk, canvas);
  interfaces::draw_text("In space", {static_cast<double>(x1), y0 - 10.0}, 12.0, kInk, canvas);
  put(from_above.picture(), x0, y0, canvas);
  put(in_space.picture(), x1, y0, canvas);
  draw_axes(map, x0, y0, canvas);
  draw_names(part, in_space, x1, y0, canvas);
  legend.draw(density, y0 + kPanelHeight + 28, canvas);
  return core::ok_status();
}

int part_height(const HeatMapLegend& legend) { return kTitle + kPanelHeight + 28 + legend.height(); }

}  // namespace

core::Result<ColorImage> heat_map_picture(const belief::Scene& scene, const belief::PredictAnswer& answer,
                                          Backends& backends) {
  if (answer.final_poses.empty()) return core::not_found("no final poses to draw");
  std::vector<const belief::FinalPoses*> drawn;
  for (const belief::FinalPoses& poses : answer.final_poses) {
    // Of things that surely stay there is nothing to see, unless they are all.
    const bool still = std::sqrt(poses.position_covariance.trace()) < kStill;
    if (!still || answer.final_poses.size() == 1) drawn.push_back(&poses);
  }
  if (drawn.empty()) drawn.push_back(&answer.final_poses.front());
  drawn.resize(std::min(kMostObjects, drawn.size()));
  std::vector<HeatMapPart> parts;
  for (const belief::FinalPoses* poses : drawn) parts.push_back(heat_map_part(scene, answer, *poses));
  std::vector<HeatMapLegend> legends;
  int height = 0;
  for (const HeatMapPart& part : parts) height += part_height(legends.emplace_back(scene, answer, part));
  ColorImage canvas(kPictureWidth, height, {255, 255, 255});
  int top = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    PRESCENE_RETURN_IF_ERROR(draw_part(scene, parts[i], legends[i], backends, top, canvas));
    top += part_height(legends[i]);
  }
  return canvas;
}

core::Status write_heat_map(const std::filesystem::path& path, const belief::Scene& scene,
                            const belief::PredictAnswer& answer, Backends& backends) {
  PRESCENE_TRY(const ColorImage picture, heat_map_picture(scene, answer, backends));
  return interfaces::write_png(path, picture.view());
}

}  // namespace prescene::service
