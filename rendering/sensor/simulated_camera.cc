// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/simulated_camera.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "chamfer.h"
#include "prescene/core/check.h"

namespace prescene::rendering {
namespace {

/// What a stream's particle number is used for, so that no two draws share numbers.
enum Channel : std::uint32_t { kFixedPattern, kCorrelated, kMissing, kPart, kPixels, kColors };

/// Standard normal at each pixel, correlated over about one cell: a grid of normals, interpolated and scaled back to
/// unit variance.
class SmoothField {
 public:
  SmoothField(int width, int height, double cell_px, core::RandomStream stream) : cell_(std::max(1.0, cell_px)) {
    columns_ = static_cast<std::size_t>(width / cell_) + 2;
    const std::size_t rows = static_cast<std::size_t>(height / cell_) + 2;
    grid_.resize(columns_ * rows);
    for (double& value : grid_) value = stream.normal();
  }

  double operator()(int x, int y) const {
    const double gx = x / cell_;
    const double gy = y / cell_;
    const auto column = static_cast<std::size_t>(gx);
    const auto row = static_cast<std::size_t>(gy);
    const double right = gx - static_cast<double>(column);
    const double down = gy - static_cast<double>(row);
    const double* corner = &grid_[row * columns_ + column];
    const double sum = (1 - down) * ((1 - right) * corner[0] + right * corner[1]) +
                       down * ((1 - right) * corner[columns_] + right * corner[columns_ + 1]);
    const double squares = ((1 - right) * (1 - right) + right * right) * ((1 - down) * (1 - down) + down * down);
    return sum / std::sqrt(squares);
  }

 private:
  double cell_;
  std::size_t columns_;
  std::vector<double> grid_;
};

/// Of each pixel: how far the nearest edge is, and the depth on its other side.
struct EdgeMap {
  geometry::Image<float> distance_px;
  geometry::Image<float> other_depth;  ///< 0 = nothing there.
};

/// How far apart in depth two neighbouring pixels are, metres, less what the slope of either surface explains.
double jump(const RenderedView& view, const geometry::PinholeCamera& camera, int x, int y, int other_x, int other_y) {
  const double depth = view.depth(x, y);
  const double other = view.depth(other_x, other_y);
  if (depth == 0.0 || other == 0.0) return std::abs(depth - other);
  const geometry::Vector3d ray = camera.unproject(x, y, 1.0);
  const geometry::Vector3d other_ray = camera.unproject(other_x, other_y, 1.0);
  const geometry::Vector3d normal = view.normals(x, y).cast<double>();
  const geometry::Vector3d other_normal = view.normals(other_x, other_y).cast<double>();
  // Where each pixel's plane meets the other's ray; edge-on planes say nothing (not finite, or far off).
  const double continued = depth * normal.dot(ray) / normal.dot(other_ray);
  const double other_continued = other * other_normal.dot(other_ray) / other_normal.dot(ray);
  double smallest = std::abs(depth - other);
  for (const double gap : {std::abs(other - continued), std::abs(depth - other_continued)})
    if (gap < smallest) smallest = gap;
  return smallest;
}

/// Distances by two sweeps over the eight neighbours (chamfer), exact along rows, columns and diagonals.
EdgeMap find_edges(const RenderedView& view, const geometry::PinholeCamera& camera, double depth_edge) {
  constexpr float kFar = 1e6f;
  const int width = view.depth.width();
  const int height = view.depth.height();
  EdgeMap edges{geometry::Image<float>(width, height, kFar), geometry::Image<float>(width, height, 0.0f)};
  const auto inside = [&](int x, int y) { return x >= 0 && x < width && y >= 0 && y < height; };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        if (!inside(x + dx, y + dy)) continue;
        const float other = view.depth(x + dx, y + dy);
        // A change of label without a jump of depth is contact, not an edge; nor is the step down a steep surface.
        if (!(jump(view, camera, x, y, x + dx, y + dy) > depth_edge)) continue;
        edges.distance_px(x, y) = 1.0f;
        edges.other_depth(x, y) = other;
      }
    }
  }
  const auto relax = [&](int x, int y, int dx, int dy, float length) {
    if (!inside(x + dx, y + dy)) return;
    const float distance = edges.distance_px(x + dx, y + dy) + length;
    if (distance >= edges.distance_px(x, y)) return;
    edges.distance_px(x, y) = distance;
    edges.other_depth(x, y) = edges.other_depth(x + dx, y + dy);
  };
  sweep_neighbours(width, height, relax);
  return edges;
}

double quantised(double depth, double step_per_depth_squared) {
  if (!(step_per_depth_squared > 0.0)) return depth;
  // Even steps of 1/z, as triangulating cameras have.
  const double steps = std::round(1.0 / (depth * step_per_depth_squared));
  return 1.0 / (std::max(1.0, steps) * step_per_depth_squared);
}

geometry::Rgb blended(const geometry::Rgb& a, const geometry::Rgb& b, double share_of_b) {
  geometry::Rgb mixed;
  for (std::size_t i = 0; i < 3; ++i)
    mixed[i] = static_cast<std::uint8_t>(std::lround(a[i] + (b[i] - a[i]) * share_of_b));
  return mixed;
}

/// The pixel's noise and choices, drawn ahead so that every pixel uses the same number of draws.
struct PixelDraws {
  double noise;    ///< Of a hit, standard normal.
  double missing;  ///< Uniform, correlated over neighbours: holes are patches.
  double part;     ///< The same, for seeing through or not.
  double outlier;  ///< Uniform.
  double value;    ///< Uniform, where an outlier lies.
};

/// Share of returns that are not from the surface or what is behind it. Opaque materials' own share is of a likelihood,
/// which wants some robustness; here it is what was measured.
double outlier_share(const SensorModel& model, const SimulatedCameraOptions& options, const SurfaceMaterial& material,
                     double edge_px) {
  const bool opaque = material == SurfaceMaterial::opaque(material.color);
  const double share = opaque ? options.interior_outlier : material.outlier;
  const auto& classes = model.options().outline_px;
  for (std::size_t i = 0; i < classes.size(); ++i)
    if (edge_px <= classes[i]) return std::max(share, options.edge_outlier[i]);
  return share;
}

/// What one pixel of one surface returns.
double sample_pixel(const SensorModel& model, const SimulatedCameraOptions& options, const SurfaceMaterial& material,
                    const PixelGeometry& pixel, double behind_depth, double other_depth, const PixelDraws& draws) {
  const SensorModelOptions& sensor = model.options();
  if (pixel.depth < sensor.min_depth || pixel.depth > sensor.max_depth) return 0.0;
  if (options.missing && draws.missing < model.missing_probability(material, pixel.cosine, pixel.outline_px))
    return 0.0;

  if (draws.outlier < outlier_share(model, options, material, pixel.outline_px)) {
    const bool at_edge = pixel.outline_px <= sensor.outline_px.back() && other_depth > 0.0;
    if (at_edge) return pixel.depth + (other_depth - pixel.depth) * draws.value;
    return sensor.min_depth + model.range() * draws.value;
  }
  const double see_through = material.behind / (material.behind + material.hit + material.occluder);
  double depth = pixel.depth;
  double sigma = model.hit_sigma(pixel.depth, pixel.cosine);
  if (draws.part < see_through) {
    if (!(behind_depth > 0.0) || behind_depth > sensor.max_depth) return 0.0;
    depth = behind_depth;
    sigma = model.hit_sigma(behind_depth, 1.0);
  }
  return depth + sigma * draws.noise;
}

}  // namespace

void SimulatedCamera::sample(const RenderScene& scene, const RenderedView& view, const RenderedView* behind,
                             const geometry::PinholeCamera& camera, const geometry::Pose& X_WC,
                             const core::RandomStream& stream, std::uint64_t frame, geometry::DepthImage* depth,
                             geometry::ColorImage* color) const {
  const int width = view.depth.width();
  const int height = view.depth.height();
  PRESCENE_CHECK(width == camera.width && height == camera.height);
  PRESCENE_CHECK_MSG(view.normals.width() == width, "the view must be rendered with normals");
  resize(depth, width, height);

  const std::uint64_t step = frame + 1;  // step 0 is what stays from frame to frame
  const double cell = options_.correlation_px;
  const SmoothField fixed(width, height, cell, stream.at(0, kFixedPattern));
  const SmoothField correlated(width, height, cell, stream.at(step, kCorrelated));
  const SmoothField missing(width, height, cell, stream.at(step, kMissing));
  const SmoothField part(width, height, cell, stream.at(step, kPart));
  core::RandomStream pixels = stream.at(step, kPixels);
  const double fixed_scale = std::sqrt(options_.fixed_pattern_share);
  const double correlated_scale = std::sqrt(options_.correlated_share);
  const double white_scale = std::sqrt(std::max(0.0, 1.0 - options_.fixed_pattern_share - options_.correlated_share));
  const EdgeMap edges = find_edges(view, camera, options_.depth_edge);

  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double white = pixels.normal();
      const double outlier = pixels.uniform();
      const double value = pixels.uniform();
      float& returned = (*depth)(x, y);
      returned = 0.0f;
      const std::uint16_t label = view.labels(x, y);
      if (label == 0) continue;
      const geometry::Vector3d ray = camera.unproject(x, y, 1.0).normalized();
      const double cosine = std::abs(ray.dot(view.normals(x, y).cast<double>()));
      const PixelGeometry pixel{static_cast<double>(view.depth(x, y)), cosine,
                                static_cast<double>(edges.distance_px(x, y))};
      const PixelDraws draws{fixed_scale * fixed(x, y) + correlated_scale * correlated(x, y) + white_scale * white,
                             core::normal_cdf(missing(x, y)), core::normal_cdf(part(x, y)), outlier, value};
      const double behind_depth = behind != nullptr ? static_cast<double>(behind->depth(x, y)) : 0.0;
      const double z = sample_pixel(model_, options_, scene.instances[label - 1u].material, pixel, behind_depth,
                                    static_cast<double>(edges.other_depth(x, y)), draws);
      if (z >= model_.options().min_depth && z <= model_.options().max_depth)
        returned = static_cast<float>(quantised(z, options_.quantisation_per_depth_squared));
    }
  }
  if (color == nullptr) return;
  shade(scene, view, X_WC, options_, color);
  core::RandomStream noise = stream.at(step, kColors);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (std::uint8_t& channel : (*color)(x, y))
        channel = static_cast<std::uint8_t>(
            std::clamp(std::lround(channel + options_.color_noise * noise.normal()), 0L, 255L));
}

bool has_look(const RenderMesh& mesh) { return !mesh.look.vertex_colors.empty() || !mesh.look.texture_places.empty(); }

bool has_looks(const RenderScene& scene) {
  return std::any_of(scene.instances.begin(), scene.instances.end(),
                     [](const RenderInstance& instance) { return has_look(*instance.mesh); });
}

void shade(const RenderScene& scene, const RenderedView& view, const geometry::Pose& X_WC,
           const SimulatedCameraOptions& options, geometry::ColorImage* color) {
  const int width = view.labels.width();
  const int height = view.labels.height();
  PRESCENE_CHECK_MSG(view.normals.width() == width, "the view must be rendered with normals");
  resize(color, width, height);
  // A window high up to one side, and light that comes back from the walls; turned into the camera's axes.
  const Vector3f window =
      (X_WC.rotation.conjugate() * geometry::Vector3d(0.35, -0.45, 0.82).normalized()).cast<float>();
  const Vector3f up = (X_WC.rotation.conjugate() * geometry::Vector3d::UnitZ()).cast<float>();
  for (int y = 0; y < height; ++y) {
    const double share_down = height > 1 ? static_cast<double>(y) / (height - 1) : 0.0;
    const geometry::Rgb background = blended(options.background_high, options.background_low, share_down);
    for (int x = 0; x < width; ++x) {
      const std::uint16_t label = view.labels(x, y);
      geometry::Rgb& pixel = (*color)(x, y);
      pixel = background;
      if (label == 0) continue;
      const Vector3f& normal = view.normals(x, y);
      const float light = 0.42f + 0.10f * normal.dot(up) + 0.48f * std::max(0.0f, normal.dot(window));
      const RenderMesh& mesh = *scene.instances[label - 1u].mesh;
      if (!view.color.empty() && has_look(mesh)) {
        pixel = view.color(x, y);  // by the light of the view
        continue;
      }
      const geometry::Rgb& own = scene.instances[label - 1u].material.color;
      for (std::size_t i = 0; i < 3; ++i)
        pixel[i] =
            static_cast<std::uint8_t>(std::clamp(std::lround(static_cast<float>(own[i]) * light * 1.1f), 0L, 255L));
      // What is seen through carries the background's colour, too.
      const double clear = scene.instances[label - 1u].material.behind;
      if (clear > 0.0) pixel = blended(pixel, background, 0.7 * clear);
    }
  }
}

}  // namespace prescene::rendering
