// SPDX-License-Identifier: Apache-2.0
// How things are related now: what lies on what, what is in what, who holds it. The question and its answer, as plain
// values; prescene/queries/relations.h works them out and says what each relation means.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "prescene/belief/belief.h"

namespace prescene::belief {

enum class RelationKind {
  kOn,           ///< `subject` rests on `other`: what bears its weight.
  kSupports,     ///< `subject` bears `other`; the same as `other` on `subject`.
  kIn,           ///< `subject` is inside the hollow of `other`.
  kTouches,      ///< Both touch; listed once for two things.
  kHolds,        ///< The hand `subject` holds `other`.
  kUpright,      ///< `subject` stands as its model stands.
  kVisible,      ///< The camera sees some of it.
  kWithinReach,  ///< Some of it is within a distance of a point.
  // Of timelines only:
  kPresent,    ///< It is there and its place is known.
  kMoves,      ///< Faster than kMovingSpeed or kMovingTurn.
  kFalls,      ///< Downwards by more than 0.3 m/s, in no hand and on nothing.
  kHidden,     ///< The camera sees nothing of it, though it is there.
  kAppears,    ///< An event: the time between the two frames in which it came to be present, ...
  kDisappears  ///< ... and ceased to be.
};
const std::vector<std::pair<std::string, RelationKind>>& relation_words();
std::string to_string(RelationKind kind);
/// Whether it is between two things; else `other` is "".
bool is_between_two(RelationKind kind);

/// Within reach of what.
struct Reach {
  std::string of;                       ///< A robot body's name, or "camera"; "" = `point_W`.
  Vector3d point_W = Vector3d::Zero();  ///< m
  double radius = 0.8;                  ///< m
  friend bool operator==(const Reach&, const Reach&) = default;
};

struct RelationsQuery {
  std::optional<std::string> object;           ///< Those that it takes part in; empty: all.
  int draws = 256;                             ///< Of the state of the world, in [16, 4096].
  double confidence = 0.95;                    ///< Of the intervals.
  double upright_within = 0.2617993877991494;  ///< rad (15 degrees).
  std::optional<Reach> reach;                  ///< Empty: within reach of nothing is asked.
  friend bool operator==(const RelationsQuery&, const RelationsQuery&) = default;
};

struct RelationProbability {
  RelationKind relation = RelationKind::kOn;
  std::string subject;
  std::string other;  ///< "" of what is not between two things.
  double probability = 0.0;
  double low = 0.0, high = 1.0;  ///< Interval of what more draws would change.
  /// Of kVisible: the mean share of its pixels that nothing hides. Of kIn: the mean share of its surface inside.
  std::optional<double> share = std::nullopt;
  friend bool operator==(const RelationProbability&, const RelationProbability&) = default;
};

struct RelationsAnswer {
  struct Item {
    std::string object;
    TrackState state = TrackState::kTracked;
    double existence = 1.0;
    /// Of its particles, for what their number leaves open; nothing before the first frame.
    std::optional<double> effective_sample_size = std::nullopt;
    double tolerance = 0.0;  ///< m: gaps up to this to what is below are taken for contact.
    friend bool operator==(const Item&, const Item&) = default;
  };
  std::vector<Item> objects;
  /// Those that hold in some draw, and kUpright, kVisible and kWithinReach of each object; likeliest first, by kind.
  std::vector<RelationProbability> relations;
  std::vector<std::string> remarks;  ///< What one should know before trusting the numbers, in sentences.
  int draws = 0;                     ///< That the probabilities rest on, ...
  int failed_draws = 0;              ///< ... and of these, those that the simulator could not follow.
  friend bool operator==(const RelationsAnswer&, const RelationsAnswer&) = default;
};

}  // namespace prescene::belief
