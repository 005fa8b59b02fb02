// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/calibration/depth_noise.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "prescene/core/text.h"
#include "prescene/rendering/sensor/local_surface.h"
#include "prescene/rendering/sensor/simulated_camera.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using rendering::SensorModelOptions;

constexpr std::size_t kMostSamples = std::size_t{1} << 25;
constexpr double kEdge = 0.02;            // m: a jump between neighbours that is an edge
constexpr double kFrontal = 0.6;          // cosine from which incidence changes nothing in the model
constexpr double kMoved = 0.006;          // of depth squared, 1/m: a change of depth that lasts is motion ...
constexpr double kMovedDeviations = 4.0;  // ... with so many standard deviations more ...
constexpr double kMovedShare = 0.02;      // ... when so many pixels have it
constexpr int kEnoughPixels = 300;        // of a class that may change a setting

double median_of(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

/// One pixel over time.
struct PixelNoise {
  float median = 0.0f;  ///< 0 = too few returns.
  float sigma = 0.0f;   ///< m, without outliers.
  float missing = 0.0f;
  float outliers = 0.0f;
  float cosine = 0.0f;  ///< 0 = no surface could be fitted.
  float edge_px = 0.0f;
};

/// Sums of one class.
struct ClassSum {
  std::vector<float> sigmas;
  double missing = 0.0;
  double outliers = 0.0;

  void add(const PixelNoise& pixel) {
    sigmas.push_back(pixel.sigma / (pixel.median * pixel.median));
    missing += static_cast<double>(pixel.missing);
    outliers += static_cast<double>(pixel.outliers);
  }
  DepthNoiseClass result(double limit) {
    if (sigmas.empty()) return {limit, 0, 0.0, 0.0};
    const auto n = static_cast<double>(sigmas.size());
    return {limit, static_cast<int>(sigmas.size()), median_of(sigmas), missing / n};
  }
};

PixelNoise over_time(std::vector<float>& returns, int frames, int fewest) {
  PixelNoise noise;
  const auto n = static_cast<double>(returns.size());
  noise.missing = static_cast<float>(1.0 - n / frames);
  if (static_cast<int>(returns.size()) < fewest) return noise;
  const double median = median_of(returns);
  std::vector<float> deviations;
  deviations.reserve(returns.size());
  for (const float z : returns) deviations.push_back(static_cast<float>(std::abs(static_cast<double>(z) - median)));
  // 1.4826 median absolute deviations are a normal standard deviation; quantised returns may have none at all.
  const double limit = 4.0 * 1.4826 * median_of(deviations) + 0.003 * median * median;
  double sum = 0.0, squares = 0.0, kept = 0.0;
  for (const float z : returns) {
    const double d = static_cast<double>(z) - median;
    if (std::abs(d) > limit) continue;
    sum += d;
    squares += d * d;
    kept += 1.0;
  }
  noise.median = static_cast<float>(median);
  noise.sigma = static_cast<float>(std::sqrt(std::max(0.0, (squares - sum * sum / kept) / (kept - 1.0))));
  noise.outliers = static_cast<float>(1.0 - kept / n);
  return noise;
}

/// Distances to the nearest edge in pixels, 1 = beside it.
geometry::Image<float> edge_distances(const geometry::DepthImage& depth) {
  geometry::Image<std::uint8_t> edge(depth.width(), depth.height(), 0);
  const auto mark = [&](int x, int y, int other_x, int other_y) {
    if (std::abs(depth(x, y) - depth(other_x, other_y)) > static_cast<float>(kEdge))
      edge(x, y) = edge(other_x, other_y) = 1;
  };
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      if (x + 1 < depth.width()) mark(x, y, x + 1, y);
      if (y + 1 < depth.height()) mark(x, y, x, y + 1);
    }
  geometry::Image<float> distance = rendering::distance_to_marked(edge);
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) distance(x, y) += 1.0f;
  return distance;
}

/// Whether a pixel sees something else for a while: its returns, in time, have a near and a far value farther apart
/// than noise explains, and stay at each for longer than those of an edge, which come now from the one side and now
/// from the other.
bool sees_motion(const std::vector<float>& returns, std::vector<float>& scratch) {
  const auto count = static_cast<std::ptrdiff_t>(returns.size());
  scratch.clear();
  for (std::size_t i = 1; i < returns.size(); ++i) scratch.push_back(std::abs(returns[i] - returns[i - 1]));
  const double sigma = 1.4826 * median_of(scratch) / std::numbers::sqrt2;
  scratch = returns;
  std::ranges::nth_element(scratch, scratch.begin() + count / 10);
  const auto near = static_cast<double>(scratch[static_cast<std::size_t>(count / 10)]);
  std::ranges::nth_element(scratch, scratch.begin() + count - 1 - count / 10);
  const auto far = static_cast<double>(scratch[static_cast<std::size_t>(count - 1 - count / 10)]);
  if (far - near <= kMoved * near * near + 0.002 + kMovedDeviations * sigma) return false;
  // Of so many tosses of a coin the longest run is some log2 of the number.
  const std::ptrdiff_t enough =
      std::min(count / 3, static_cast<std::ptrdiff_t>(std::log2(static_cast<double>(count)) + 3.0));
  std::ptrdiff_t run = 0, longest[2] = {0, 0};
  bool was_far = false;
  for (const float z : returns) {
    const bool is_far = static_cast<double>(z) > 0.5 * (near + far);
    run = is_far == was_far ? run + 1 : 1;
    was_far = is_far;
    longest[is_far] = std::max(longest[is_far], run);
  }
  return std::min(longest[0], longest[1]) >= enough;
}

/// Of the pixels that mostly return something.
double moved_share(const std::vector<geometry::DepthImage>& frames) {
  int judged = 0, moved = 0;
  std::vector<float> returns, scratch;
  for (int y = 0; y < frames[0].height(); y += 2)
    for (int x = 0; x < frames[0].width(); x += 2) {
      returns.clear();
      for (const geometry::DepthImage& frame : frames)
        if (frame(x, y) > 0.0f) returns.push_back(frame(x, y));
      if (2 * returns.size() < frames.size()) continue;
      ++judged;
      moved += sees_motion(returns, scratch);
    }
  return judged > 0 ? static_cast<double>(moved) / judged : 0.0;
}

/// Steps of returned depths in windows of 4 cm: (depth, median step).
std::vector<std::pair<double, double>> steps_of(const std::vector<geometry::DepthImage>& frames) {
  std::vector<std::pair<double, double>> steps;
  for (double low = 0.3; low < 4.0; low += 0.1) {
    std::vector<float> values;
    for (const geometry::DepthImage& frame : frames)
      for (std::size_t i = 0; i < frame.size(); i += 3) {
        const float z = frame.data()[i];
        if (static_cast<double>(z) >= low && static_cast<double>(z) < low + 0.04) values.push_back(z);
      }
    const std::size_t returns = values.size();
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end(), [](float a, float b) { return b - a < 1e-6f; }),
                 values.end());
    if (values.size() < 5 || returns < 30 * values.size()) continue;
    std::vector<float> gaps;
    for (std::size_t i = 1; i < values.size(); ++i) gaps.push_back(values[i] - values[i - 1]);
    steps.emplace_back(low + 0.02, median_of(gaps));
  }
  return steps;
}

void find_steps(const std::vector<geometry::DepthImage>& frames, DepthNoise* noise) {
  const auto steps = steps_of(frames);
  if (steps.empty()) {
    noise->remarks.emplace_back("steps of the returned depths: too fine to be seen, or too few depths in view");
    return;
  }
  std::vector<float> scaled, plain;
  for (const auto& [depth, step] : steps) {
    scaled.push_back(static_cast<float>(step / (depth * depth)));
    plain.push_back(static_cast<float>(step));
  }
  const auto spread = [](const std::vector<float>& v) {
    const auto [low, high] = std::minmax_element(v.begin(), v.end());
    return static_cast<double>(*high / *low);
  };
  if (steps.size() > 1 && spread(scaled) < spread(plain)) {
    noise->quantisation_per_depth_squared = median_of(scaled);
  } else {
    noise->step = median_of(plain);
    if (steps.size() == 1) noise->remarks.emplace_back("whether steps grow with depth: one depth alone was seen");
  }
}

/// Puts `value` in place of a setting where there are enough pixels.
void set(const std::string& name, const DepthNoiseClass& from, double value, double* setting, DepthNoise* noise) {
  if (from.pixels < kEnoughPixels) {
    noise->remarks.push_back(name + ": " + std::to_string(from.pixels) + " pixels of its class in view, " +
                             std::to_string(kEnoughPixels) + " are needed; the default stays");
    return;
  }
  *setting = value;
  noise->found.push_back(name);
}

}  // namespace

core::Status DepthNoiseEstimator::add(const geometry::DepthImage& depth, const geometry::PinholeCamera& camera) {
  PRESCENE_RETURN_IF_ERROR(geometry::validate(camera));
  if (depth.width() != camera.width || depth.height() != camera.height)
    return core::invalid_input("the depth image is not of its camera's size");
  if (!frames_.empty() && (depth.width() != camera_.width || depth.height() != camera_.height))
    return core::invalid_input("the depth images change their size: record one camera in one mode");
  if (frames_.empty()) {
    camera_ = camera;
    most_frames_ = std::max(kFewestFrames, static_cast<int>(std::min<std::size_t>(200, kMostSamples / depth.size())));
  }
  if (full()) return core::ok_status();
  frames_.push_back(depth);
  for (std::size_t i = 0; i < depth.size(); ++i)
    if (!std::isfinite(depth.data()[i]) || depth.data()[i] < 0.0f) frames_.back().data()[i] = 0.0f;
  return core::ok_status();
}

core::Result<DepthNoise> DepthNoiseEstimator::finish() const {
  DepthNoise noise;
  noise.frames = static_cast<int>(frames_.size());
  if (noise.frames < kFewestFrames)
    return core::invalid_input("it has " + std::to_string(noise.frames) + " depth images, " +
                               std::to_string(kFewestFrames) + " are needed: record some seconds");
  const double moved = moved_share(frames_);
  if (moved > kMovedShare)
    return core::invalid_input("something moves: " + fixed_text(100.0 * moved, 0) +
                               " % of the pixels change their depth within the recording: record a scene in which "
                               "neither camera nor things move");

  const int width = camera_.width, height = camera_.height;
  geometry::Image<PixelNoise> pixels(width, height);
  geometry::DepthImage medians(width, height, 0.0f);
  std::vector<float> returns;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      returns.clear();
      for (const geometry::DepthImage& frame : frames_)
        if (frame(x, y) > 0.0f) returns.push_back(frame(x, y));
      pixels(x, y) = over_time(returns, noise.frames, 5);
      medians(x, y) = pixels(x, y).median;
    }

  SensorModelOptions& settings = noise.settings;
  const geometry::Image<float> edges = edge_distances(medians);
  const double far_from_edges = settings.outline_px.back();
  ClassSum frontal;
  std::array<ClassSum, 4> by_incidence, by_edge;
  std::vector<ClassSum> by_depth(16);  // quarters of a metre
  std::vector<float> knees;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      PixelNoise& pixel = pixels(x, y);
      if (pixel.median == 0.0f) continue;
      const auto surface = rendering::local_surface(medians, camera_, x, y, {4, 0.015, 0.5});
      if (!surface || std::abs(surface->depth - static_cast<double>(pixel.median)) > kEdge) continue;
      ++noise.pixels;
      pixel.cosine = static_cast<float>(surface->cosine);
      const auto below = [](const auto& limits, double value) {
        return static_cast<std::size_t>(
            std::find_if(limits.begin(), limits.end(), [&](double limit) { return value <= limit; }) - limits.begin());
      };
      const double edge = static_cast<double>(edges(x, y));
      if (edge > far_from_edges) {
        by_incidence[below(settings.incidence_cosine, surface->cosine)].add(pixel);
        if (surface->cosine > kFrontal) {
          frontal.add(pixel);
          const auto bin = static_cast<std::size_t>(4.0f * pixel.median);
          if (bin < by_depth.size()) by_depth[bin].add(pixel);
        } else if (surface->cosine > 0.15 && surface->cosine < 0.5) {
          knees.push_back(pixel.cosine * pixel.sigma / (pixel.median * pixel.median));
        }
      } else if (surface->cosine > kFrontal) {
        by_edge[below(settings.outline_px, edge)].add(pixel);
      }
    }
  const double outliers = frontal.outliers;
  const DepthNoiseClass middle = frontal.result(kFrontal);
  if (middle.pixels < kEnoughPixels)
    return core::invalid_input("only " + std::to_string(middle.pixels) +
                               " pixels see a surface from the front, far from edges: record a wall or a table");
  noise.sigma_over_time = middle.sigma;
  noise.missing = middle.missing;
  noise.outliers = outliers / middle.pixels;
  for (std::size_t i = 0; i < by_depth.size(); ++i)
    if (!by_depth[i].sigmas.empty()) noise.by_depth.push_back(by_depth[i].result(0.25 * static_cast<double>(i + 1)));
  for (std::size_t i = 0; i < 4; ++i) {
    noise.by_incidence.push_back(by_incidence[i].result(i < 3 ? settings.incidence_cosine[i] : 1.0));
    noise.by_edge.push_back(by_edge[i].result(settings.outline_px[i]));
  }

  // A pattern that stays is in every frame alike and can't be distinguished from the surface's own shape.
  const double fixed = rendering::SimulatedCameraOptions{}.fixed_pattern_share;
  set("sigma_per_depth_squared", middle, middle.sigma / std::sqrt(1.0 - fixed), &settings.sigma_per_depth_squared,
      &noise);
  noise.remarks.push_back(
      "errors that stay from frame to frame (calibration): not seen in a still recording; they are "
      "taken for " +
      fixed_text(100.0 * fixed, 0) + " % of the variance");
  const DepthNoiseClass steep{0.5, static_cast<int>(knees.size()), 0.0, 0.0};
  set("incidence_knee", steep,
      knees.empty() ? settings.incidence_knee : std::clamp(median_of(knees) / middle.sigma, 0.2, 0.95),
      &settings.incidence_knee, &noise);
  for (std::size_t i = 0; i < 3; ++i)
    set("incidence_missing[" + std::to_string(i) + "]", noise.by_incidence[i], noise.by_incidence[i].missing,
        &settings.incidence_missing[i], &noise);
  for (std::size_t i = 0; i < 4; ++i)
    set("outline_missing[" + std::to_string(i) + "]", noise.by_edge[i], noise.by_edge[i].missing,
        &settings.outline_missing[i], &noise);
  find_steps(frames_, &noise);
  noise.remarks.emplace_back("pixels that never return anything (shadows of the projector, out of range): left out");
  noise.remarks.emplace_back(
      "incidence_max_growth, support and background shares, materials other than those in view: not estimated");
  return noise;
}

nlohmann::ordered_json to_json(const DepthNoise& noise) {
  using nlohmann::ordered_json;
  const auto classes = [](const std::vector<DepthNoiseClass>& all) {
    ordered_json json = ordered_json::array();
    for (const DepthNoiseClass& c : all)
      json.push_back(
          {{"limit", c.limit}, {"pixels", c.pixels}, {"sigma_per_depth_squared", c.sigma}, {"missing", c.missing}});
    return json;
  };
  const SensorModelOptions& settings = noise.settings;
  const auto maybe = [](const std::optional<double>& value) { return value ? ordered_json(*value) : ordered_json(); };
  return {{"frames", noise.frames},
          {"pixels", noise.pixels},
          {"sigma_over_time_per_depth_squared", noise.sigma_over_time},
          {"missing", noise.missing},
          {"outliers", noise.outliers},
          {"by_depth", classes(noise.by_depth)},
          {"by_incidence", classes(noise.by_incidence)},
          {"by_edge", classes(noise.by_edge)},
          {"quantisation_per_depth_squared", maybe(noise.quantisation_per_depth_squared)},
          {"step", maybe(noise.step)},
          {"settings",
           {{"sigma_per_depth_squared", settings.sigma_per_depth_squared},
            {"incidence_knee", settings.incidence_knee},
            {"incidence_missing", settings.incidence_missing},
            {"outline_missing", settings.outline_missing}}},
          {"found", noise.found},
          {"remarks", noise.remarks}};
}

}  // namespace prescene::service
