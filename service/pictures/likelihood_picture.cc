// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/pictures/likelihood_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "prescene/core/text.h"
#include "prescene/interfaces/reports/lettering.h"
#include "prescene/interfaces/reports/overlay.h"
#include "prescene/rendering/reference/reference_likelihood.h"
#include "prescene/service/pictures/belief_overlay.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using geometry::ColorImage;
using geometry::Rgb;

constexpr Rgb kTextColor = {30, 32, 35};
constexpr Rgb kNoteColor = {95, 100, 105};
constexpr int kLeastWidth = 640;
// The scale ends where this share of the pixels has its log ratio.
constexpr double kWithinScale = 0.95;

/// 1, 2 or 5 times a power of ten, not below the value.
double rounded_up(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= value * (1.0 - 1e-9)) return factor * power;
  return 10.0 * power;
}

double end_of_scale(const std::vector<ObjectEvidence>& objects) {
  std::vector<double> sizes;
  for (const ObjectEvidence& object : objects)
    for (std::size_t i = 0; i < object.log_ratios.size(); ++i)
      if (const double r = static_cast<double>(object.log_ratios.data()[i]); std::isfinite(r))
        sizes.push_back(std::abs(r));
  if (sizes.empty()) return 1.0;
  const auto at = static_cast<std::ptrdiff_t>(kWithinScale * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), sizes.begin() + at, sizes.end());
  return rounded_up(std::max(1.0, sizes[static_cast<std::size_t>(at)]));
}

/// Grey, and darker than it was, so that colours stand out.
ColorImage in_grey(const ColorImage& picture) {
  ColorImage grey(picture.width(), picture.height());
  for (std::size_t i = 0; i < picture.size(); ++i) {
    const Rgb& c = picture.data()[i];
    const double luma = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    const auto level = static_cast<std::uint8_t>(std::lround(20.0 + 0.55 * luma));
    grey.data()[i] = {level, level, level};
  }
  return grey;
}

std::string text_of(const ObjectEvidence& object) {
  const rendering::PoseEvidence& e = object.evidence;
  if (e.in_view == 0) return object.object + ": out of view";
  if (e.covered == 0) return object.object + ": hidden by what is known";
  return object.object + ": " + (e.log_ratio >= 0.0 ? "+" : "") + fixed_text(e.log_ratio, 0) + " nats from " +
         std::to_string(e.covered) + " pixels; " + fixed_text(100.0 * e.visible_share(), 0) + " % of them visible, " +
         fixed_text(100.0 * e.hit_share(), 0) + " % of these on its surface";
}

/// Of letters that are `wanted` pixels high, or so much less, down to 7, that the text fits.
double fitting_height(std::string_view text, double wanted, double room) {
  return std::clamp(wanted * room / std::max(1.0, interfaces::text_width(text, wanted)), std::min(7.0, wanted), wanted);
}

void draw_scale(double end, double x, double y, double width, ColorImage& canvas) {
  const auto columns = static_cast<int>(width);
  const auto left = static_cast<int>(x), top = static_cast<int>(y);
  for (int i = 0; i < columns; ++i)
    interfaces::fill_rectangle(left + i, top, left + i + 1, top + 18,
                               interfaces::divergence_color(2.0 * i / (columns - 1.0) - 1.0), 1.0, canvas);
  for (int k = -2; k <= 2; ++k) {
    const double value = 0.5 * k * end;
    const std::string sign = k > 0 ? "+" : "";
    const std::string number = k == 0 ? "0" : sign + core::rounded_text(value);
    interfaces::draw_text(number, {x + (0.5 + 0.25 * k) * (width - 1.0), y + 36.0}, 10.5, kNoteColor, canvas,
                          k == -2  ? interfaces::TextAlign::kLeft
                          : k == 2 ? interfaces::TextAlign::kRight
                                   : interfaces::TextAlign::kCenter);
  }
}

}  // namespace

core::Result<std::vector<ObjectEvidence>> evidence_of_pixels(const belief::Belief& belief,
                                                             const belief::Observation& observation,
                                                             const filter::ColorModels& colors,
                                                             const filter::FrameOptions& options, Backends& backends) {
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  const filter::FilterTools tools{nullptr, renderer.get(), &backends.meshes()};
  filter::FrameOptions all_pixels = options;
  all_pixels.terms.target_width = observation.frame.camera.width;
  filter::FrameCache cache;
  filter::FilterFrame frame;
  PRESCENE_RETURN_IF_ERROR(prepare_frame(belief.scene, observation, belief.robot,
                                         {colors, learned_models(belief, options.colors, observation.camera)},
                                         all_pixels, tools, cache, &frame));

  struct Seen {
    const belief::ObjectBelief* object;
    filter::SearchTarget target;
    belief::Pose X_CO;
    geometry::DepthImage depth;
  };
  std::vector<Seen> seen;
  for (const belief::ObjectBelief& object : belief.objects) {
    if (object.state == belief::TrackState::kLost) continue;
    const filter::SearchTarget target = target_of(object, *belief.scene, frame, tools);
    const belief::Pose X_CO = frame.X_CW * belief::heaviest(object.particles).X_WO;
    seen.push_back({&object, target, X_CO, depth_of(target, X_CO, frame.terms.camera, *renderer)});
  }
  const auto batch = rendering::make_reference_likelihood_batch();
  const auto workspace = batch->make_workspace();
  std::vector<ObjectEvidence> objects;
  for (const Seen& one : seen) {
    std::vector<const geometry::DepthImage*> others;
    for (const Seen& other : seen)
      if (&other != &one) others.push_back(&other.depth);
    const rendering::FrameTerms terms =
        terms_for_object(frame, others, one.X_CO * one.target.centre(), static_cast<double>(one.target.mesh->radius));
    const rendering::PoseHypothesis pose = hypothesis(one.target, one.X_CO);
    ObjectEvidence& found = objects.emplace_back();
    found.object = one.object->name;
    batch->evaluate(terms, std::span(&pose, 1), *workspace, std::span(&found.evidence, 1));
    found.log_ratios = log_ratio_map(terms, pose);
  }
  return objects;
}

ColorImage likelihood_picture(const belief::Observation& observation, const std::vector<ObjectEvidence>& objects) {
  ColorImage picture = in_grey(picture_of(observation));
  const double end = end_of_scale(objects);
  geometry::LabelImage labels(picture.width(), picture.height());
  std::vector<std::optional<Rgb>> outline_colors;
  for (std::size_t k = 0; k < objects.size(); ++k) {
    outline_colors.emplace_back(Rgb{250, 250, 250});
    for (int y = 0; y < picture.height(); ++y) {
      for (int x = 0; x < picture.width(); ++x) {
        const auto r = static_cast<double>(objects[k].log_ratios(x, y));
        if (std::isnan(r)) continue;
        picture(x, y) = interfaces::divergence_color(r / end);
        labels(x, y) = static_cast<std::uint16_t>(k + 1);
      }
    }
  }
  interfaces::draw_outlines(labels, outline_colors, 1, picture);

  constexpr int kLine = 20;
  const int width = std::max(kLeastWidth, picture.width());
  const auto lines = static_cast<int>(objects.size());
  ColorImage canvas(width, picture.height() + 96 + kLine * (lines + 1), {250, 250, 250});
  const int left = (width - picture.width()) / 2;
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) canvas(left + x, y) = picture(x, y);
  double y = picture.height() + 24.0;
  const std::string title = "What each pixel says, nats: log of p(measured | object there) / p(measured | not there)";
  const std::string meaning = "blue: against the pose, orange: for";
  double height = fitting_height(title, 11.0, width - 24.0);
  for (const ObjectEvidence& object : objects)
    height = std::min(height, fitting_height(text_of(object), 11.0, width - 24.0));
  interfaces::draw_text(title, {12.0, y}, height, kTextColor, canvas);
  draw_scale(end, 12.0, y + 8.0, 380.0, canvas);
  interfaces::draw_text(meaning, {408.0, y + 22.0}, fitting_height(meaning, 10.5, width - 420.0), kNoteColor, canvas);
  y += 68.0;
  for (const ObjectEvidence& object : objects) {
    interfaces::draw_text(text_of(object), {12.0, y}, height, kTextColor, canvas);
    y += kLine;
  }
  if (objects.empty()) interfaces::draw_text("No object is believed to be there.", {12.0, y}, 11.0, kTextColor, canvas);
  return canvas;
}

}  // namespace prescene::service
