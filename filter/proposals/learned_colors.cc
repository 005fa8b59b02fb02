// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/learned_colors.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "prescene/core/check.h"

namespace prescene::filter {

using belief::ColorShare;
using belief::LearnedColors;

static_assert(belief::kColorCells == rendering::kColorBins * rendering::kColorBins * rendering::kColorBins);

namespace {
constexpr double kLeastShare = 1e-6;  // bins seen less than this on both are forgotten
}  // namespace

void blend(const rendering::ColorHistogram& object, const rendering::ColorHistogram& rest,
           const ColorLearningOptions& options, LearnedColors& colors) {
  const double object_total = object.total(), rest_total = rest.total();
  PRESCENE_CHECK(object_total > 0.0 && rest_total > 0.0);
  ++colors.frames;
  const double gain = std::max(1.0 / colors.frames, options.gain);
  auto shares = std::make_shared<std::vector<ColorShare>>();
  const std::vector<ColorShare> none;
  const std::vector<ColorShare>& before = colors.shares ? *colors.shares : none;
  auto old = before.begin();
  for (int bin = 0; bin < belief::kColorCells; ++bin) {
    ColorShare share{.bin = bin};
    if (old != before.end() && old->bin == bin) share = *old++;
    const auto i = static_cast<std::size_t>(bin);
    share.object += gain * (object.counts()[i] / object_total - share.object);
    share.rest += gain * (rest.counts()[i] / rest_total - share.rest);
    if (std::max(share.object, share.rest) >= kLeastShare) shares->push_back(share);
  }
  colors.shares = std::move(shares);
}

rendering::ColorModel model_of(const LearnedColors& colors, const rendering::ColorModelOptions& options) {
  PRESCENE_CHECK(colors.shares != nullptr);
  rendering::ColorHistogram object, rest;
  for (const ColorShare& share : *colors.shares) {
    object.add_to_bin(static_cast<std::size_t>(share.bin), share.object);
    rest.add_to_bin(static_cast<std::size_t>(share.bin), share.rest);
  }
  return make_color_model(object, rest, options);
}

bool learns(const belief::Belief& belief, const belief::ObjectBelief& object, const ColorLearningOptions& options) {
  return options.learn || belief.scene->models[static_cast<std::size_t>(object.model)].learn_colors;
}

const LearnedColors* colors_by(int camera, const belief::ObjectBelief& object) {
  if (camera == 0) return &object.colors;
  const auto number = static_cast<std::size_t>(camera);
  return number < object.views.size() ? &object.views[number].colors : nullptr;
}

LearnedColors& colors_by(int camera, belief::ObjectBelief& object) {
  const auto number = static_cast<std::size_t>(camera);
  if (camera != 0 && object.views.size() <= number) object.views.resize(number + 1);
  return const_cast<LearnedColors&>(*colors_by(camera, std::as_const(object)));
}

std::map<std::string, rendering::ColorModel> learned_models(const belief::Belief& belief,
                                                            const ColorLearningOptions& options, int camera) {
  std::map<std::string, rendering::ColorModel> models;
  for (const belief::ObjectBelief& object : belief.objects) {
    const LearnedColors* colors = learns(belief, object, options) ? colors_by(camera, object) : nullptr;
    if (colors != nullptr && colors->shares && colors->frames >= options.frames)
      models.emplace(object.name, model_of(*colors, options.model));
  }
  return models;
}

}  // namespace prescene::filter
