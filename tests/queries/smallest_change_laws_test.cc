// SPDX-License-Identifier: Apache-2.0
// The smallest change that would have kept it: on boundaries that are known, and on events whose mechanics say what
// would have helped.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/geometry/angles.h"
#include "prescene/queries/changed_events.h"
#include "prescene/queries/shift_search.h"
#include "prescene/queries/smallest_change.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "tests/queries/sliding_scene.h"

namespace prescene::queries::smallest_change_test {
namespace {

using belief::EventKind;
using geometry::Pose;
using geometry::Vector3d;

// ---- shifts of draws whose outcome is a formula

/// Draws about 0 with a spread in each coordinate; the outcome comes about where `holds`.
struct Formula {
  std::size_t coordinates = 6;
  double spread = 0.1;
  std::function<bool(const Shift&)> holds;

  std::vector<Shift> draws(std::size_t count, std::uint64_t seed) const {
    std::vector<Shift> draws;
    core::RandomStream random(seed, core::Purpose::kTest);
    for (std::size_t d = 0; d < count; ++d) {
      Shift& draw = draws.emplace_back();
      for (std::size_t i = 0; i < coordinates; ++i) draw.push_back(spread * random.normal());
    }
    return draws;
  }
  double share(const Shift& shift, const std::vector<Shift>& draws) const {
    double holding = 0.0;
    for (Shift draw : draws) {
      for (std::size_t i = 0; i < coordinates; ++i) draw[i] += shift[i];
      holding += holds(draw) ? 1.0 / static_cast<double>(draws.size()) : 0.0;
    }
    return holding;
  }
  std::optional<Shift> shortest(std::uint64_t seed, std::size_t* tried = nullptr) const {
    const std::vector<Shift> met = draws(32, seed);
    ShiftProblem problem;
    problem.coordinates = coordinates;
    problem.draws = met.size();
    problem.allowed = 1;
    problem.try_out = [&](std::span<const Shift> shifts, std::span<const std::pair<std::size_t, std::size_t>> tries,
                          std::span<std::uint8_t> outcomes) {
      for (std::size_t t = 0; t < tries.size(); ++t) {
        Shift at = met[tries[t].second];
        for (std::size_t i = 0; i < coordinates; ++i) at[i] += shifts[tries[t].first][i];
        outcomes[t] = holds(at) ? 1 : 0;
      }
      if (tried != nullptr) *tried += tries.size();
    };
    return shortest_shift(problem, core::RandomStream(seed, core::Purpose::kTest));
  }
};

TEST(ShortestShift, IsNearlyTheDistanceToAFlatBoundary) {
  // One coordinate that decides, two that share, and all alike.
  for (const Shift& normal : {Shift{1, 0, 0, 0, 0, 0}, Shift{0, 0.8, 0, -0.6, 0, 0}, Shift{0.5, 0.5, -0.5, 0.5, 0, 0}})
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Formula formula;
      formula.holds = [&](const Shift& z) {
        return std::inner_product(z.begin(), z.end(), normal.begin(), 0.0) >= 2.0;
      };
      std::size_t tried = 0;
      const auto shift = formula.shortest(seed, &tried);
      ASSERT_TRUE(shift) << seed;
      // Nine of ten draws are beyond a plane that is 1.28 of their deviations nearer.
      const double shortest = 2.0 + 1.2816 * formula.spread;
      EXPECT_LE(length_of(*shift), 1.3 * shortest) << seed;
      EXPECT_GE(formula.share(*shift, formula.draws(4000, seed + 100)), 0.85) << seed;
      EXPECT_LT(tried, 6000U);
    }
}

TEST(ShortestShift, FindsWhatNoCoordinateReachesAlone) {
  Formula formula;
  formula.coordinates = 4;
  // Both are needed.
  formula.holds = [](const Shift& z) { return z[1] > 1.2 && z[2] < -1.2; };
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto shift = formula.shortest(seed);
    ASSERT_TRUE(shift) << seed;
    EXPECT_GE(formula.share(*shift, formula.draws(4000, seed + 100)), 0.8) << seed;
    EXPECT_GE(length_of(*shift), 1.2 * std::numbers::sqrt2);
  }
}

TEST(ShortestShift, IsNothingWhereNothingHelpsAndZeroWhereNothingMustChange) {
  Formula formula;
  formula.holds = [](const Shift&) { return false; };
  EXPECT_FALSE(formula.shortest(1));
  formula.holds = [](const Shift& z) { return z[0] > 5.0; };
  EXPECT_FALSE(formula.shortest(1));
  formula.holds = [](const Shift&) { return true; };
  const auto none = formula.shortest(1);
  ASSERT_TRUE(none);
  EXPECT_EQ(length_of(*none), 0.0);
}

// ---- events of one thing on or above a table of 1 m, whose edge is at x = 0.5

struct OneThing {
  belief::ObjectModel model;
  Vector3d at;
  bool held = false;
  /// Weights and modes of its particles. Empty: one, as `held` says.
  std::vector<std::pair<double, belief::MotionMode>> modes = {};
};

class Event {
 public:
  Event(const OneThing& thing, EventKind kind) : pool_(2) {
    auto scene = std::make_shared<belief::Scene>();
    scene->name = "table";
    scene->models = {thing.model};
    belief::Support table;
    table.name = "table";
    table.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{{1.0, 1.0, 0.04}}, {}});
    table.X_WS = Pose::from_translation({0.0, 0.0, -0.02});
    table.contact.friction = belief::FixedScalar{1.0};
    scene->supports.push_back(table);
    belief::SceneObject object;
    object.name = "thing";
    object.pose = belief::FixedPose{Pose::from_translation(thing.at)};
    if (thing.held) {
      object.held_by = "hand";
      belief::KinematicBody hand;
      hand.name = "hand";
      hand.collision.push_back(belief::PrimitiveShape{geometry::Sphere{0.02}, {}});
      hand.timeline = {{0.0, Pose::from_translation(thing.at + Vector3d(0.0, 0.0, 0.3))}};
      scene->robot.push_back(hand);
    }
    scene->objects.push_back(object);
    auto belief = std::make_shared<belief::Belief>();
    belief->seed = 5;
    belief->step = 20;
    for (const belief::KinematicBody& hand : scene->robot) belief->robot.push_back(hand.timeline.front().X_WG);
    belief::ObjectBelief& believed = belief->objects.emplace_back();
    believed.name = "thing";
    belief::Particle particle;
    particle.X_WO = Pose::from_translation(thing.at);
    particle.covariance.diagonal().head<3>().setConstant(0.005 * 0.005);
    particle.covariance.diagonal().segment<3>(3).setConstant(0.002 * 0.002);
    particle.mode = thing.held ? belief::MotionMode::kHeld : belief::MotionMode::kResting;
    for (const auto& [weight, mode] : thing.modes) {
      particle.log_weight = std::log(weight);
      particle.mode = mode;
      believed.particles.push_back(particle);
    }
    if (believed.particles.empty()) believed.particles = {particle};
    believed.motion.X_still = particle.X_WO;
    believed.motion.still_frames = 30;
    belief->scene = scene;
    window_.start = belief;
    WindowFrame& frame = window_.frames.emplace_back();
    frame.observation.stamp_ns = core::ns_of(1.0);
    frame.belief = belief;
    context_.simulation.pool = &pool_;
    context_.simulation.make_simulator = [this](const belief::Scene& of, double) {
      return simulation::make_bullet_simulator(of, shapes_);
    };
    query_.object = "thing";
    auto events = changed_events(window_, query_, context_, kind);
    if (!events) throw std::runtime_error(events.status().message());
    events_ = *std::move(events);
  }

  ChangedEvents& events() { return *events_; }

  /// About these parameters of the event, known to `spread` of their priors' deviations.
  std::vector<LatentPoint> draws(const LatentPoint& about, double spread, std::size_t count, std::uint64_t seed) const {
    std::vector<LatentPoint> draws;
    for (std::size_t d = 0; d < count; ++d) {
      core::RandomStream random = core::RandomStream(seed, core::Purpose::kTest).at(d);
      LatentPoint& z = draws.emplace_back();
      for (int i = 0; i < events_->dimensions(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        z.push_back(at < about.size() ? about[at] + spread * random.normal() : random.normal());
      }
    }
    return draws;
  }
  double share(const Shift& shift, const std::vector<LatentPoint>& draws) {
    std::vector<ChangedDraw> changed;
    for (const LatentPoint& draw : draws) changed.push_back({draw, shift});
    const std::vector<std::uint8_t> wanted = events_->outcomes(changed);
    return static_cast<double>(std::count(wanted.begin(), wanted.end(), 1)) / static_cast<double>(draws.size());
  }
  SmallestChange smallest(const LatentPoint& about, double spread) {
    ChangeSearch search;
    search.events = events_.get();
    search.wanted = "stays as it was";
    search.draws = [&](int number) { return draws(about, spread, 96, 1000 + static_cast<std::uint64_t>(number)); };
    return smallest_change(search);
  }
  /// Of the coordinate, the sum of what the change says.
  static const ChangedPart* part(const SmallestChange& change, const std::string& name) {
    for (const ChangedPart& one : change.parts)
      if (one.name == name) return &one;
    return nullptr;
  }
  /// The shift that the change says, from its parts.
  Shift shift_of(const SmallestChange& change) const {
    Shift shift;
    for (const ChangeCoordinate& coordinate : events_->coordinates()) {
      const ChangedPart* one = part(change, coordinate.name);
      shift.push_back(one == nullptr ? 0.0 : std::copysign(one->deviations, one->to - one->from));
    }
    return shift;
  }
  /// The greatest share over some coordinates alone and all pairs of them in four directions, at this length.
  double most_at(double length, const std::vector<std::string>& names, const std::vector<LatentPoint>& all) {
    std::vector<std::size_t> of;
    const std::size_t n = events_->coordinates().size();
    for (std::size_t i = 0; i < n; ++i)
      if (std::find(names.begin(), names.end(), events_->coordinates()[i].name) != names.end()) of.push_back(i);
    double most = 0.0;
    for (std::size_t i = 0; i < of.size(); ++i)
      for (std::size_t j = i; j < of.size(); ++j)
        for (int k = 0; k < (i == j ? 2 : 4); ++k) {
          Shift direction(n, 0.0);
          direction[of[i]] = (i == j ? 1.0 : std::sqrt(0.5)) * (k % 2 == 0 ? 1.0 : -1.0);
          if (i != j) direction[of[j]] = std::sqrt(0.5) * (k < 2 ? 1.0 : -1.0);
          most = std::max(most, share(scaled(direction, length), all));
        }
    return most;
  }

 private:
  core::ThreadPool pool_;
  simulation::ShapeStore shapes_;
  ExplainWindow window_;
  ExplainQuery query_;
  ExplainContext context_;
  std::unique_ptr<ChangedEvents> events_;
};

OneThing box_of(const Vector3d& size, const Vector3d& bottom, bool held) {
  OneThing thing;
  thing.model = tests::box_model("thing", size);
  thing.model.contact.friction = belief::FixedScalar{0.5};
  thing.model.contact.restitution = belief::FixedScalar{0.0};
  thing.at = bottom + Vector3d(0.0, 0.0, 0.5 * size.z());
  thing.held = held;
  return thing;
}

// What is held may be held higher; what stands in reach of a hand may not.
TEST(SmallestChange, AThingIsHeldIfMostOfItsParticlesAre) {
  using belief::MotionMode;
  const auto may_be_higher = [](std::vector<std::pair<double, MotionMode>> modes) {
    OneThing box = box_of({0.06, 0.06, 0.1}, {0.0, 0.0, 0.2}, true);
    box.modes = std::move(modes);
    Event event(box, EventKind::kSlipped);
    const std::vector<ChangeCoordinate>& coordinates = event.events().coordinates();
    return std::any_of(coordinates.begin(), coordinates.end(),
                       [](const ChangeCoordinate& one) { return one.name == "height of the place"; });
  };
  EXPECT_TRUE(may_be_higher({}));
  // The heaviest particle is one of the few.
  EXPECT_TRUE(may_be_higher({{0.4, MotionMode::kMoving}, {0.3, MotionMode::kHeld}, {0.3, MotionMode::kHeld}}));
  EXPECT_FALSE(may_be_higher({{0.4, MotionMode::kHeld}, {0.3, MotionMode::kResting}, {0.3, MotionMode::kMoving}}));
}

/// By fresh draws that nothing had.
void expect_true(Event& event, const SmallestChange& change, const LatentPoint& about, double spread) {
  ASSERT_TRUE(change.found) << change.probability << " of " << change.instances;
  EXPECT_GE(change.low, 0.9);
  // Parts that are less than a tenth of the whole are not told.
  EXPECT_GE(event.share(event.shift_of(change), event.draws(about, spread, 400, 4242)), 0.9);
}

TEST(SmallestChange, OfACartonThatIsLetGoOverTheEdgeBringsItsCentreOntoTheTable) {
  Event event(box_of({0.07, 0.07, 0.12}, {0.53, 0.0, 0.02}, true), EventKind::kSlipped);
  const LatentPoint about = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  const SmallestChange change = event.smallest(about, 0.1);
  expect_true(event, change, about, 0.1);
  EXPECT_LT(change.unchanged_probability, 0.05);
  const ChangedPart* along_x = Event::part(change, "place along x");
  ASSERT_NE(along_x, nullptr);
  EXPECT_NEAR(along_x->from, 0.53, 0.005);
  // Its centre was 3 cm beyond the edge. It must come onto the table, and no further than a side of it.
  EXPECT_LT(along_x->to, 0.5);
  EXPECT_GT(along_x->to, 0.5 - 0.05);
}

TEST(SmallestChange, OfAPushOverTheEdgeIsNotMuchLongerThanWhatAScanFinds) {
  Event event(box_of({0.08, 0.08, 0.06}, {0.40, 0.0, 0.0}, false), EventKind::kPushed);
  // Towards the edge (directions count from W's x here), low, at 0.4 m/s for 0.55 s.
  const LatentPoint about = {0.0, 0.0, -0.4, 0.0, std::log(0.4 / 0.25) / 0.6, std::log(0.55 / 0.45) / 0.5};
  const SmallestChange change = event.smallest(about, 0.1);
  expect_true(event, change, about, 0.1);
  EXPECT_LT(change.unchanged_probability, 0.05);
  // No other direction does it with less.
  EXPECT_LT(event.most_at(change.size / 1.3, {"direction", "speed", "duration", "place along x"},
                          event.draws(about, 0.1, 20, 77)),
            0.9);
}

TEST(SmallestChange, OfASlimThingThatTopplesIsALowerRelease) {
  Event event(box_of({0.045, 0.045, 0.24}, {0.0, 0.0, 0.20}, true), EventKind::kSlipped);
  // The hand adds 0.9 rad/s about y: it has turned by 10 degrees when it lands.
  const LatentPoint about = {0.0, 0.0, 0.0, 0.0, 0.0, 1.8, 0.0};
  const SmallestChange change = event.smallest(about, 0.1);
  expect_true(event, change, about, 0.1);
  EXPECT_LT(change.unchanged_probability, 0.2);
  // What helps is to let it go lower, or to turn it less.
  const ChangedPart* height = Event::part(change, "height of the place");
  const ChangedPart* turning = Event::part(change, "turning that the hand adds about y");
  ASSERT_TRUE(height != nullptr || turning != nullptr);
  if (height != nullptr) {
    EXPECT_LT(height->to, height->from);
  }
  if (turning != nullptr) {
    EXPECT_LT(turning->to, turning->from);
  }
}

TEST(SmallestChange, IsNoneFarFromTheTable) {
  Event event(box_of({0.07, 0.07, 0.12}, {0.8, 0.0, 0.02}, true), EventKind::kSlipped);
  const SmallestChange change = event.smallest({0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 0.1);
  EXPECT_FALSE(change.found);
  EXPECT_LT(change.probability, 0.9);
  EXPECT_GT(change.instances, 0);
}

TEST(SmallestChange, IsNoneWhereNothingHasToChange) {
  Event event(box_of({0.08, 0.08, 0.06}, {0.0, 0.0, 0.0}, false), EventKind::kPushed);
  const SmallestChange change = event.smallest({0.0, 0.0, -0.4, 0.0, 0.0, 0.0}, 0.1);
  EXPECT_TRUE(change.found);
  EXPECT_EQ(change.size, 0.0);
  EXPECT_TRUE(change.parts.empty());
}

}  // namespace
}  // namespace prescene::queries::smallest_change_test
