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
  bool learn = false;  ///< The colours of every object; else of those alone whose model says so (learn_colors).
  double gain = 0.05;  ///< Share of a new frame in the histograms; the first 1 / gain frames are averaged evenly.
  int frames = 5;      ///< To learn from before the colours count.
  double min_evidence = 3.0;    ///< Nats per visible pixel from which on a tracked object's frame is learned from, ...
  double min_confidence = 0.9;  ///< ... if its place is so sure (belief::ObjectEstimate::confidence), ...
  double min_visible_share = 0.5;  ///< ... so much of it is seen ...
  double min_hit_share = 0.8;      ///< ... and matches.
  /// Mean nats of its pixels by the colours learned so far: less, and it may well be another thing of the same shape.
  double min_color_evidence = -0.5;
  int min_pixels = 12;        ///< Fewer pixels inside the outline are not learned from.
  int target_width = 160;     ///< The image is sampled every round(width / target_width) pixels for learning.
  double least_share = 1e-6;  ///< Bins seen less than this on both are forgotten.
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

/// By object name, of those that learn and have learned from enough frames.
std::map<std::string, rendering::ColorModel> learned_models(const belief::Belief& belief,
                                                            const ColorLearningOptions& options);

}  // namespace prescene::filter
