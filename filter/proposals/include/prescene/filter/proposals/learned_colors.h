// SPDX-License-Identifier: Apache-2.0
// Colours that an object was seen to have: how a frame's histograms are blended into what the belief carries, and the
// colour model that comes of it.
//
//   blend(object_histogram, rest_histogram, options, object.colors);
//   ColorModels models = learned_models(belief, options);      // of the objects that were seen often enough
#pragma once

#include <map>
#include <string>

#include "prescene/belief/belief.h"
#include "prescene/rendering/sensor/color_model.h"

namespace prescene::filter {

/// When colours are learned and how much they count. Source of the blending: region-based tracking [Bibby & Reid 2008].
struct ColorLearningOptions {
  /// switch. Colours are learned of every object, not only of those whose model asks for it (learn_colors). Range true
  /// or false. Chosen.
  bool learn = false;
  /// share. A new frame has this weight in the histograms; the first 1 / gain frames are averaged evenly. Range 0 to 1.
  /// Chosen.
  double gain = 0.05;
  /// frames. The colours count after they were learned from this many frames. Range 1 to 1000. Chosen.
  int frames = 5;
  /// nats per pixel. A frame is learned from only if it says at least this much for each visible pixel of the tracked
  /// object. Range 0 to 10. Chosen.
  double min_evidence = 3.0;
  /// share. A frame is learned from only if it shows at least this share of the object. Range 0 to 1. Chosen.
  double min_visible_share = 0.5;
  rendering::ColorModelOptions model;
};

/// Moves `colors` towards what a frame shows: shares += g (seen - shares), g = max(1 / frames so far, gain). Both
/// histograms hold something (checked).
void blend(const rendering::ColorHistogram& object, const rendering::ColorHistogram& rest,
           const ColorLearningOptions& options, belief::LearnedColors& colors);

/// The model of a table. It is not null (checked).
rendering::ColorModel model_of(const belief::LearnedColors& colors, const rendering::ColorModelOptions& options);

/// Whether the object's colours are to be learned.
bool learns(const belief::Belief& belief, const belief::ObjectBelief& object, const ColorLearningOptions& options);

/// What this camera's frames showed of the object's colours; there is room for it from then on.
belief::LearnedColors& colors_by(int camera, belief::ObjectBelief& object);
/// The same, or null where they showed none yet.
const belief::LearnedColors* colors_by(int camera, const belief::ObjectBelief& object);

/// By object name, of those that learn and have learned from enough frames of this camera: two cameras show one colour
/// as two.
std::map<std::string, rendering::ColorModel> learned_models(const belief::Belief& belief,
                                                            const ColorLearningOptions& options, int camera = 0);

}  // namespace prescene::filter
