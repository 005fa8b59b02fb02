// SPDX-License-Identifier: Apache-2.0
// The question of where to look next: which of some camera poses would say most about an object.
//
//   NextViewQuery query;
//   query.object = "mug";
//   query.views = {{"left", X_WL}, {"right", X_WR}};
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "prescene/belief/world_state.h"
#include "prescene/geometry/camera.h"

namespace prescene::belief {

/// What is to be learned of the object.
enum class ViewAbout {
  kPlace,      ///< Which of its alternative poses it has: more than 5 cm or 30 degrees apart, up to symmetry.
  kPose,       ///< Its pose, as one of those drawn.
  kExistence,  ///< Whether it is there at all.
};
/// "place", "pose", "existence".
const std::vector<std::pair<std::string, ViewAbout>>& view_about_words();

/// A camera that may be looked through.
struct CandidateView {
  std::string name;  ///< May be empty.
  Pose X_WC;
  std::optional<geometry::PinholeCamera> intrinsics = {};  ///< Empty: the scene's camera's.
  friend bool operator==(const CandidateView&, const CandidateView&) = default;
};

struct NextViewQuery {
  std::string object;
  ViewAbout about = ViewAbout::kPlace;
  std::vector<CandidateView> views;  ///< At least one.
  int draws = 64;                    ///< Simulated observations of each candidate.
  double confidence = 0.95;          ///< Of the intervals.
  friend bool operator==(const NextViewQuery&, const NextViewQuery&) = default;
};

struct NextViewAnswer {
  /// What is to be told apart: one of the hypotheses is true.
  struct Hypothesis {
    std::optional<Pose> X_WO;  ///< Empty: the object is not there.
    double probability = 0.0;
    friend bool operator==(const Hypothesis&, const Hypothesis&) = default;
  };
  /// What one observation through a candidate would say.
  struct View {
    std::string name;
    int index = 0;  ///< In the question's list.
    /// By how much the entropy over the hypotheses goes down on average at least, nats: a lower bound, as circumstances
    /// are known from those drawn only. With the bound's interval from the finite number of simulated observations.
    /// Just 0 where all hypotheses look alike from there.
    double reduction = 0.0, low = 0.0, high = 0.0;
    int visible_pixels = 0;    ///< Of the object, on average over the hypotheses, of the reduced image.
    int different_pixels = 0;  ///< Of the reduced image: those at which hypotheses differ.
    friend bool operator==(const View&, const View&) = default;
  };
  std::string object;
  ViewAbout about = ViewAbout::kPlace;
  double entropy = 0.0;  ///< Over the hypotheses now, nats.
  std::vector<Hypothesis> hypotheses;
  std::vector<View> views;  ///< The most telling first.
  bool any_tells = false;   ///< Some candidate's interval is above 0, with the confidence of all together.
  /// The first is better than the second by more than chance explains; true also of a single candidate that tells
  /// something.
  bool best_is_clear = false;
  int draws = 0;  ///< Simulated observations of each candidate.
  std::vector<std::string> remarks;
  friend bool operator==(const NextViewAnswer&, const NextViewAnswer&) = default;
};

}  // namespace prescene::belief
