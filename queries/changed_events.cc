// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/changed_events.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "prescene/belief/body_names.h"
#include "simulated_changes.h"

namespace prescene::queries {
namespace {

using belief::EventKind;
using geometry::Vector3d;

constexpr double kKeptTilt = std::numbers::pi / 6.0;  // rad
constexpr double kKeptDrop = 0.05;                    // m; of what stood
constexpr double kKeptFall = 0.3;                     // m; of what was held, above where it comes to stand
constexpr double kInEachOther = 0.005;                // m; what is deeper in something at first can't be there

double part_of_added(const EventDraw& draw, std::size_t axis) {
  return axis < 3 ? draw.added.linear[static_cast<Eigen::Index>(axis)]
                  : draw.added.angular[static_cast<Eigen::Index>(axis) - 3];
}

class SimulatedChanges final : public ChangedEvents {
 public:
  SimulatedChanges(EventPaths& events, const Hypothesis& hypothesis, std::optional<WantedOutcome> wanted,
                   double goes_on, std::unique_ptr<EventPaths> owned)
      : owned_(std::move(owned)),
        events_(events),
        hypothesis_(hypothesis),
        wanted_(std::move(wanted)),
        goes_on_(goes_on),
        up_(belief::up_of(events.scene())),
        held_(events.is_held(hypothesis.object)) {
    const Vector3d x = horizontal_x(up_);
    axes_ = {x, up_.cross(x), up_};
    name_coordinates();
  }

  const std::vector<ChangeCoordinate>& coordinates() const override { return coordinates_; }
  int dimensions() const override { return events_.dimensions(hypothesis_); }

  std::vector<std::uint8_t> outcomes(std::span<const ChangedDraw> draws,
                                     std::vector<std::vector<double>>* values) override {
    std::vector<LatentPoint> points;
    std::vector<Vector3d> moved;
    for (const ChangedDraw& draw : draws) {
      LatentPoint& z = points.emplace_back(draw.draw);
      Vector3d& shift = moved.emplace_back(Vector3d::Zero());
      for (std::size_t c = 0; c < draw.shift.size(); ++c) {
        if (c < of_event_.size())
          z[of_event_[c]] += draw.shift[c];
        else
          shift += kPlaceDeviation * draw.shift[c] * axes_[c - of_event_.size()];
      }
    }
    std::vector<ScenePath> paths(points.size());
    std::vector<EventDraw> events(points.size());
    std::vector<belief::Trajectory> runs(points.size());
    events_.go_on_for(goes_on_);
    events_.simulate(hypothesis_, points, paths, events, runs, moved);
    events_.go_on_for(0.0);
    std::vector<std::uint8_t> wanted(points.size(), 0);
    if (!events_.failure().ok()) return wanted;  // a run that failed ends where it began
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (paths[i].impossible || runs[i].states.empty() || runs[i].deepest_overlap > kInEachOther) continue;
      wanted[i] = (wanted_ ? wanted_->holds(events_.scene(), runs[i]) : stays(runs[i])) ? 1 : 0;
    }
    if (values != nullptr) {
      values->clear();
      for (std::size_t i = 0; i < points.size(); ++i) values->push_back(values_of(points[i], events[i], moved[i]));
    }
    return wanted;
  }

 private:
  void name_coordinates() {
    const auto add = [&](std::size_t at, std::string name, std::string unit) {
      of_event_.push_back(at);
      coordinates_.push_back({std::move(name), std::move(unit)});
    };
    const bool pushed = hypothesis_.kind == EventKind::kPushed, bumped = hypothesis_.kind == EventKind::kBumped;
    if (pushed || bumped) {
      // Not the time: where all lies still it changes nothing.
      add(1, "direction", "deg");
      add(2, "height of the touch", "m");
      add(3, "touch to the side", "of its half width");
      add(4, "speed", "m/s");
      if (pushed) add(5, "duration", "s");
    } else if (hypothesis_.kind == EventKind::kSlipped) {
      if (!events_.is_still()) add(0, "time", "s");
      for (std::size_t axis = 0; axis < 6; ++axis) {
        const std::string of(1, static_cast<char>('x' + axis % 3));
        add(1 + axis, axis < 3 ? "velocity that the hand adds along " + of : "turning that the hand adds about " + of,
            axis < 3 ? "m/s" : "rad/s");
      }
    }
    // What a moving hand carries is where the robot took it.
    if (!events_.is_present(hypothesis_.object) || (held_ && !events_.is_still())) return;
    if (hypothesis_.kind == EventKind::kNothing && events_.is_still()) return;
    if (belief::joint_of(events_.scene(), events_.objects()[hypothesis_.object].name)) return;
    coordinates_.push_back({"place along x", "m"});
    coordinates_.push_back({"place along y", "m"});
    if (held_) coordinates_.push_back({"height of the place", "m"});
  }

  std::vector<double> values_of(const LatentPoint& z, const EventDraw& draw, const Vector3d& moved) const {
    std::vector<double> values;
    for (const std::size_t at : of_event_) {
      if (hypothesis_.kind == EventKind::kSlipped) {
        values.push_back(at == 0 ? draw.time : part_of_added(draw, at - 1));
        continue;
      }
      const std::array<double, 6> of_touch = {draw.time,           180.0 / std::numbers::pi * draw.direction,
                                              draw.touched_height, draw.sideways,
                                              draw.speed,          draw.duration};
      values.push_back(of_touch[at]);
    }
    if (values.size() == coordinates_.size()) return values;
    const Vector3d at = events_.start_at(hypothesis_, z).translation + moved;
    for (std::size_t axis = 0; values.size() < coordinates_.size(); ++axis) values.push_back(axes_[axis].dot(at));
    return values;
  }

  bool stays(const belief::Trajectory& run) const {
    const std::size_t object = hypothesis_.object;
    const belief::Pose& begin = run.states.front().objects[object].X_WO;
    const belief::Pose& end = run.states.back().objects[object].X_WO;
    const Vector3d com = belief::mean(events_.model(object).center_of_mass);
    const double tilt =
        std::acos(std::clamp((begin.rotation.conjugate() * up_).dot(end.rotation.conjugate() * up_), -1.0, 1.0));
    return tilt <= kKeptTilt && up_.dot(begin * com - end * com) <= (held_ ? kKeptFall : kKeptDrop);
  }

  std::unique_ptr<EventPaths> owned_;  // where nobody else has it
  EventPaths& events_;
  Hypothesis hypothesis_;
  std::optional<WantedOutcome> wanted_;
  double goes_on_;
  Vector3d up_;
  bool held_;
  std::array<Vector3d, 3> axes_;
  std::vector<std::size_t> of_event_;  // coordinates of a point
  std::vector<ChangeCoordinate> coordinates_;
};

}  // namespace

std::unique_ptr<ChangedEvents> changed_events(EventPaths& events, const Hypothesis& hypothesis,
                                              std::optional<WantedOutcome> wanted, double goes_on) {
  return std::make_unique<SimulatedChanges>(events, hypothesis, std::move(wanted), goes_on, nullptr);
}

core::Result<std::unique_ptr<ChangedEvents>> changed_events(const ExplainWindow& window, const ExplainQuery& query,
                                                            const ExplainContext& context, belief::EventKind kind) {
  PRESCENE_TRY(auto events, EventPaths::create(window, context, query.priors, query.seed));
  Hypothesis hypothesis{kind, events->objects().size(), {}, 1.0};
  for (std::size_t i = 0; i < events->present(); ++i)
    if (events->objects()[i].name == query.object) hypothesis.object = i;
  if (hypothesis.object == events->objects().size())
    return core::not_found("'" + query.object + "' is not there at the window's start");
  events->set_times({});
  events->base();
  EventPaths& kept = *events;
  return std::unique_ptr<ChangedEvents>(
      std::make_unique<SimulatedChanges>(kept, hypothesis, std::nullopt, kChangeGoesOn, std::move(events)));
}

}  // namespace prescene::queries
