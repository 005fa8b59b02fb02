// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/heat_map_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "prescene/core/text.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/reports/lettering.h"
#include "prescene/interfaces/reports/overlay.h"
#include "prescene/service/scene_view.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using Eigen::Vector2d;
using geometry::ColorImage;
using geometry::Rgb;
using geometry::Vector3d;
using interfaces::TextAlign;

constexpr std::size_t kMostObjects = 3;
constexpr int kPanelWidth = 800, kPanelHeight = 640, kMargin = 36, kLeftAxis = 58, kTitle = 104, kLegend = 196;
constexpr int kWidth = kLeftAxis + 2 * kPanelWidth + 3 * kMargin;
constexpr int kHeight = kTitle + kPanelHeight + kLegend;
constexpr Rgb kInk = {35, 38, 45}, kSoft = {105, 110, 120}, kFrame = {150, 155, 165};
constexpr double kShares[] = {0.5, 0.9};
constexpr double kStill = 0.003;       // m: deviation of what hardly moves
constexpr double kLeastShown = 0.005;  // outcomes rarer than this are named, not drawn

std::string percent(double share) {
  const double p = 100.0 * share;
  return (p > 0.0 && p < 0.1 ? "<0.1" : fixed_text(p, p < 10.0 ? 1 : 0)) + " %";
}

/// What of the answer is about one object.
struct Part {
  std::size_t object = 0;
  const belief::FinalPoses* poses = nullptr;
  std::string group;  ///< Whose outcomes its ends are told apart by; empty: a single outcome, or none.
  struct Ending {
    std::string name;
    const belief::OutcomeProbability* probability = nullptr;
    const belief::TypicalRun* run = nullptr;  ///< Null: too rare to be drawn.
    Rgb color{};
  };
  std::vector<Ending> endings;
  std::vector<const belief::ObjectPath*> paths;
};

bool judges(const belief::Scene& scene, const std::string& group, const std::string& outcome,
            const std::string& object) {
  for (const belief::ExclusiveOutcomes& one : scene.exclusive_outcomes)
    if (one.name == group) return !one.outcomes.empty() && one.outcomes.front().object == object;
  return group.empty() && std::any_of(scene.outcomes.begin(), scene.outcomes.end(), [&](const belief::Outcome& one) {
           return one.name == outcome && one.object == object;
         });
}

Part part_of(const belief::Scene& scene, const belief::PredictAnswer& answer, const belief::FinalPoses& poses) {
  Part part;
  part.poses = &poses;
  part.object = static_cast<std::size_t>(belief::find_object(scene, poses.object).value_or(0));
  const auto first =
      std::find_if(answer.outcomes.begin(), answer.outcomes.end(), [&](const belief::OutcomeProbability& outcome) {
        return judges(scene, outcome.group, outcome.name, poses.object);
      });
  if (first == answer.outcomes.end()) return part;
  part.group = first->group;
  for (const belief::OutcomeProbability& outcome : answer.outcomes) {
    const bool mine = part.group.empty() ? &outcome == &*first : outcome.group == part.group;
    if (!mine || (outcome.probability <= 0.0 && outcome.name == "other")) continue;
    Part::Ending& ending = part.endings.emplace_back();
    ending.name = outcome.name;
    ending.probability = &outcome;
    ending.color = interfaces::series_color(part.endings.size());
    for (const belief::TypicalRun& run : answer.typical_runs)
      if (run.group == part.group && run.outcome == outcome.name && run.share >= kLeastShown) ending.run = &run;
  }
  for (const belief::ObjectPath& path : answer.paths)
    if (path.object == poses.object) part.paths.push_back(&path);
  return part;
}

/// Where a run's free motion begins: the state in which the object is last held, else the first.
std::size_t begin_of(const belief::Trajectory& run, std::size_t object) {
  for (std::size_t i = run.states.size(); i-- > 0;)
    if (run.states[i].objects[object].mode == belief::MotionMode::kHeld) return i;
  return 0;
}

const belief::Trajectory* likeliest_run(const Part& part) {
  const belief::TypicalRun* best = nullptr;
  for (const Part::Ending& ending : part.endings)
    if (ending.run && (!best || ending.run->share > best->share)) best = ending.run;
  return best ? &best->trajectory : nullptr;
}

struct Box {
  Vector3d low = Vector3d::Constant(1e9), high = Vector3d::Constant(-1e9);
  void add(const Vector3d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  void add(const geometry::TriangleMesh& mesh, const geometry::Pose& X_WM) {
    for (const Vector3d& vertex : mesh.vertices) add(X_WM * vertex);
  }
  bool meets(const Box& other) const {
    return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
  }
};

/// The range of cells along an axis that holds all but 1 % of the mass at either end.
void add_heat(const belief::HeatMap& map, Box& box) {
  std::vector<double> columns(static_cast<std::size_t>(map.nx), 0.0), rows(static_cast<std::size_t>(map.ny), 0.0);
  for (std::size_t i = 0; i < map.mass.size(); ++i) {
    columns[i % static_cast<std::size_t>(map.nx)] += map.mass[i];
    rows[i / static_cast<std::size_t>(map.nx)] += map.mass[i];
  }
  const auto range = [&](const std::vector<double>& masses, double origin, double& low, double& high) {
    double below = 0.0;
    std::size_t first = masses.size() - 1, last = 0;
    for (std::size_t i = 0; i < masses.size(); ++i) {
      if (below + masses[i] > 0.01) first = std::min(first, i);
      if (below < 0.99) last = i;
      below += masses[i];
    }
    low = std::min(low, origin + static_cast<double>(first) * map.cell);
    high = std::max(high, origin + static_cast<double>(last + 1) * map.cell);
  };
  range(columns, map.x0, box.low.x(), box.high.x());
  range(rows, map.y0, box.low.y(), box.high.y());
}

/// What the pictures have to show: where the object begins and may end, and supports that are not far larger.
struct Shown {
  Box box;
  std::vector<Vector3d> points;
};

Shown shown_of(const belief::Scene& scene, const Part& part) {
  const belief::ObjectModel& model = scene.model_of(scene.objects[part.object]);
  const geometry::TriangleMesh mesh = belief::collision_mesh(model);
  Shown shown;
  const auto add_mesh = [&](const geometry::TriangleMesh& more, const geometry::Pose& X_WM) {
    shown.box.add(more, X_WM);
    for (const Vector3d& vertex : more.vertices) shown.points.push_back(X_WM * vertex);
  };
  if (const belief::Trajectory* run = likeliest_run(part))
    add_mesh(mesh, run->states[begin_of(*run, part.object)].objects[part.object].X_WO);
  for (const Part::Ending& ending : part.endings)
    if (ending.run) add_mesh(mesh, ending.run->trajectory.final().objects[part.object].X_WO);
  if (shown.points.empty())
    for (const belief::PoseComponent& component : part.poses->components) add_mesh(mesh, component.mean);
  Box heat;
  add_heat(part.poses->heat_map, heat);
  const double ground = shown.box.low.z();
  for (const double x : {heat.low.x(), heat.high.x()}) {
    for (const double y : {heat.low.y(), heat.high.y()}) {
      shown.points.emplace_back(x, y, ground);
      shown.box.add(shown.points.back());
    }
  }
  const double size = (shown.box.high - shown.box.low).norm();
  for (const belief::Support& support : scene.supports) {
    const geometry::TriangleMesh whole = belief::collision_mesh(support.collision);
    Box all;
    all.add(whole, support.X_WS);
    if ((all.high - all.low).norm() <= 1.2 * size + 0.3 && all.meets(shown.box)) add_mesh(whole, support.X_WS);
  }
  const Vector3d room = 0.06 * (shown.box.high - shown.box.low).norm() * Vector3d(1.0, 1.0, 0.0);
  shown.box.low -= room;
  shown.box.high += room;
  return shown;
}

void draw_object(const belief::Scene& scene, const Part& part, bool with_labels, bool with_paths, SceneView& view,
                 Backends& backends, core::Status& status) {
  const auto keep = [&](const core::Status& done) {
    if (status.ok()) status = done;
  };
  if (with_paths) {
    for (const belief::ObjectPath* path : part.paths) {
      Rgb color = kSoft;
      for (const Part::Ending& ending : part.endings)
        if (ending.name == path->outcome) color = ending.color;
      view.line(path->points, 1.0, color, 0.4, false);
    }
  }
  if (const belief::Trajectory* run = likeliest_run(part))
    keep(view.outline(scene, part.object, run->states[begin_of(*run, part.object)].objects[part.object].X_WO, kSoft,
                      with_labels ? 0.25 : 0.0, true, backends));
  for (const Part::Ending& ending : part.endings) {
    if (!ending.run) continue;
    const belief::Trajectory& run = ending.run->trajectory;
    keep(view.outline(scene, part.object, run.final().objects[part.object].X_WO, ending.color, with_labels ? 0.9 : 0.0,
                      false, backends));
  }
  if (!with_labels) return;
  for (const Part::Ending& ending : part.endings) {
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
void draw_names(const Part& part, const SceneView& view, int x0, int y0, ColorImage& canvas) {
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
  if (const belief::Trajectory* run = likeliest_run(part)) {
    const std::size_t begin = begin_of(*run, part.object);
    label(run->states[begin].objects[part.object].X_WO.translation, 62.0,
          begin > 0 ? part.poses->object + " let go here" : part.poses->object + " starts here", kInk);
  }
  for (const Part::Ending& ending : part.endings) {
    if (!ending.run) continue;
    label(ending.run->trajectory.final().objects[part.object].X_WO.translation, -46.0,
          ending.name + " " + percent(ending.probability->probability), darker(ending.color));
  }
}

void draw_legend(const belief::PredictAnswer& answer, const Part& part, const GroundDensity& density, int top,
                 ColorImage& canvas) {
  // The colour bar: what a square of the heat map's cell holds.
  const int x0 = kLeftAxis + kMargin, bar_width = 440, y0 = top + 30;
  const double cell = part.poses->heat_map.cell;
  interfaces::draw_text("Probability that the centre of " + part.poses->object + " comes to rest in a square of " +
                            core::rounded_text(100.0 * cell) + " x " + core::rounded_text(100.0 * cell) + " cm",
                        {static_cast<double>(x0), static_cast<double>(y0)}, 11.5, kInk, canvas);
  for (int i = 0; i < bar_width; ++i) {
    const double value = i / (bar_width - 1.0);
    interfaces::fill_rectangle(x0 + i, y0 + 14, x0 + i + 1, y0 + 34, {200, 202, 205}, 1.0, canvas);
    interfaces::fill_rectangle(x0 + i, y0 + 14, x0 + i + 1, y0 + 34, warm_color(value), warm_opacity(value), canvas);
  }
  for (int i = 0; i <= 4; ++i) {
    const double value = i / 4.0;  // the square root of the share of the largest, as the colours
    const double mass = std::min(1.0, value * value * density.largest() * cell * cell);
    interfaces::draw_text(i == 0 ? "0"
                                 : fixed_text(100.0 * mass, mass < 0.001  ? 3
                                                            : mass < 0.01 ? 2
                                                                          : 1) +
                                       " %",
                          {x0 + value * (bar_width - 1), y0 + 52.0}, 10.5, kSoft, canvas, TextAlign::kCenter);
  }
  const double line_y = y0 + 78.0;
  for (const bool half : {true, false}) {
    const double x = x0 + (half ? 0.0 : 230.0);
    const std::array<Vector2d, 2> sample{Vector2d(x, line_y - 4.0), Vector2d(x + 34.0, line_y - 4.0)};
    interfaces::draw_line(sample, half ? 2.2 : 1.1, {70, 20, 20}, 1.0, canvas);
    interfaces::draw_text(half ? "half of all ends inside" : "90 % of all end inside", {x + 44.0, line_y}, 11.0, kInk,
                          canvas);
  }
  interfaces::draw_text(
      "Each instance counts as a Gaussian 0.6 s n^(-1/6) wide within its outcome and resting face "
      "(s their spread, n their number).",
      {static_cast<double>(x0), y0 + 108.0}, 10.0, kSoft, canvas);
  interfaces::draw_text(
      "Outlines: the instance nearest to the middle of each outcome, with its way. Robot not shown. " +
          std::to_string(answer.instances) + " instances.",
      {static_cast<double>(x0), y0 + 128.0}, 10.0, kSoft, canvas);

  // The outcomes, with their intervals.
  const double x1 = kLeftAxis + kPanelWidth + 2.0 * kMargin + 10.0;
  double y = y0;
  interfaces::draw_text(part.endings.empty() ? "The scene names no outcomes for it"
                                             : "How it ends" + (part.group.empty() ? "" : " (" + part.group + ")"),
                        {x1, y}, 11.5, kInk, canvas);
  double name_width = 0.0;
  for (const Part::Ending& ending : part.endings)
    name_width = std::max(name_width, interfaces::text_width(ending.name, 11.5));
  const double bar = x1 + 34.0 + name_width, bar_end = x1 + kPanelWidth - 190.0;
  for (std::size_t i = 0; i < std::min<std::size_t>(6, part.endings.size()); ++i) {
    const Part::Ending& ending = part.endings[i];
    const belief::OutcomeProbability& p = *ending.probability;
    y += 23.0;
    const auto at = [&](double value) { return bar + value * (bar_end - bar); };
    interfaces::fill_rectangle(static_cast<int>(x1), static_cast<int>(y) - 11, static_cast<int>(x1) + 14,
                               static_cast<int>(y) + 1, ending.color, 1.0, canvas);
    interfaces::draw_text(ending.name, {x1 + 24.0, y}, 11.5, kInk, canvas);
    interfaces::fill_rectangle(static_cast<int>(bar), static_cast<int>(y) - 11, static_cast<int>(bar_end),
                               static_cast<int>(y) + 1, {232, 234, 238}, 1.0, canvas);
    interfaces::fill_rectangle(static_cast<int>(bar), static_cast<int>(y) - 11, static_cast<int>(at(p.probability)),
                               static_cast<int>(y) + 1, ending.color, 0.85, canvas);
    const std::array<Vector2d, 2> whisker{Vector2d(at(p.low), y - 5.0), Vector2d(at(p.high), y - 5.0)};
    interfaces::draw_line(whisker, 2.0, kInk, 1.0, canvas);
    interfaces::draw_text(percent(p.probability), {bar_end + 14.0, y}, 11.5, kInk, canvas);
    interfaces::draw_text("(" + fixed_text(100.0 * p.low, 1) + " to " + fixed_text(100.0 * p.high, 1) + ")",
                          {bar_end + 72.0, y}, 10.0, kSoft, canvas);
  }
  if (part.endings.size() > 6)
    interfaces::draw_text("and " + std::to_string(part.endings.size() - 6) + " more", {x1, y + 22.0}, 10.0, kSoft,
                          canvas);
}

core::Status draw_part(const belief::Scene& scene, const belief::PredictAnswer& answer, const Part& part,
                       Backends& backends, int top, ColorImage& canvas) {
  const Shown shown = shown_of(scene, part);
  // The map's grid covers more than the panel shows, whose sides may differ.
  const Vector2d low = shown.box.low.head<2>(), high = shown.box.high.head<2>();
  const double side = 0.75 * (high - low).maxCoeff();
  const Vector2d middle = 0.5 * (low + high);
  const Vector2d grid_low = middle - Vector2d::Constant(1.3 * side);
  const Vector2d grid_high = middle + Vector2d::Constant(1.3 * side);
  const GroundDensity density(part.poses->components, grid_low, grid_high);
  const belief::ObjectModel& model = scene.model_of(scene.objects[part.object]);
  const std::vector<DensityLevel> levels = levels_of(*part.poses, belief::collision_mesh(model), grid_low, grid_high);
  const belief::Trajectory* run = likeliest_run(part);
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
  from_above.paint(levels, density, kShares);
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
  draw_legend(answer, part, density, y0 + kPanelHeight + 28, canvas);
  return core::ok_status();
}

}  // namespace

core::Result<ColorImage> heat_map_picture(const belief::Scene& scene, const belief::PredictAnswer& answer,
                                          Backends& backends) {
  if (answer.final_poses.empty()) return core::not_found("there is no object whose end could be painted");
  std::vector<const belief::FinalPoses*> told;
  for (const belief::FinalPoses& poses : answer.final_poses) {
    // Of things that surely stay there is nothing to see, unless they are all.
    const bool still = std::sqrt(poses.position_covariance.trace()) < kStill;
    if (!still || answer.final_poses.size() == 1) told.push_back(&poses);
  }
  if (told.empty()) told.push_back(&answer.final_poses.front());
  told.resize(std::min(kMostObjects, told.size()));
  ColorImage canvas(kWidth, static_cast<int>(told.size()) * kHeight, {255, 255, 255});
  for (std::size_t i = 0; i < told.size(); ++i)
    PRESCENE_RETURN_IF_ERROR(
        draw_part(scene, answer, part_of(scene, answer, *told[i]), backends, static_cast<int>(i) * kHeight, canvas));
  return canvas;
}

core::Status write_heat_map(const std::filesystem::path& path, const belief::Scene& scene,
                            const belief::PredictAnswer& answer, Backends& backends) {
  PRESCENE_TRY(const ColorImage picture, heat_map_picture(scene, answer, backends));
  return interfaces::write_png(path, picture.view());
}

}  // namespace prescene::service
