// SPDX-License-Identifier: Apache-2.0
#include "explain_answer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "explain_text.h"
#include "prescene/geometry/dense_solvers.h"
#include "unseen_ends.h"

namespace prescene::queries {
namespace {

using belief::EventKind;
using belief::Pose;

constexpr std::uint64_t kPlaceDraws = 32;  // from each part of a place's distribution
constexpr double kLeastDetailed = 0.002;   // probability from which on the parameters of an event are worked out

/// Quantiles of weighted values.
double value_quantile(std::vector<std::pair<double, double>> values, double share) {
  std::sort(values.begin(), values.end());
  double all = 0.0, sum = 0.0;
  for (const auto& [value, weight] : values) all += weight;
  for (const auto& [value, weight] : values)
    if ((sum += weight) >= share * all) return value;
  return values.empty() ? 0.0 : values.back().first;
}

/// A part of where an object may be.
struct PossiblePlace {
  geometry::Vector3d mean;
  geometry::Matrix3d covariance;
  double weight;
};

/// Where an object may be, and whether it is there at all.
struct PossiblePlaces {
  std::vector<PossiblePlace> there;
  double gone = 0.0, all = 0.0;  // weights

  void add(const std::optional<Pose>& X_WO, double weight,
           const geometry::Matrix3d& covariance = geometry::Matrix3d::Zero(),
           const geometry::Vector3d& off = geometry::Vector3d::Zero()) {
    all += weight;
    if (!X_WO) gone += weight;
    if (X_WO) there.push_back({X_WO->translation + off, covariance, weight});
  }
};

/// Within which it is with a probability of `share`, by draws from each part.
double place_radius(const std::vector<PossiblePlace>& places, const geometry::Vector3d& mean, double share) {
  const core::RandomStream stream(kPlaceDraws, core::Purpose::kNearbyStart);
  std::vector<std::pair<double, double>> distances;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto eigen = geometry::symmetric_eigen_3(places[i].covariance);
    core::RandomStream random = stream.at(i);
    for (std::uint64_t d = 0; d < kPlaceDraws; ++d) {
      geometry::Vector3d off;
      for (double& x : off) x = random.normal();
      off = eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().cwiseProduct(off);
      distances.emplace_back((places[i].mean + off - mean).norm(), places[i].weight);
    }
  }
  return value_quantile(std::move(distances), share);
}

class AnswerBuilder {
 public:
  explicit AnswerBuilder(JudgedEvents& events)
      : window_(events.window),
        events_(&events.events),
        likelihood_(&events.likelihood),
        times_(events.times),
        nothings_(events.nothings),
        judged_(events.judged),
        frames_(events.frames),
        most_points_(events.points) {}

  ExplainAnswer answer() {
    for (Judged& nothing : nothings_) work_out(nothing);
    for (Judged& judged : judged_)
      if (judged.probability >= kLeastDetailed) work_out(judged);
    const std::vector<const Judged*> all = by_probability();
    ExplainAnswer answer = counted();
    for (const Judged* judged : all) answer.explanations.push_back(explanation_of(*judged));
    std::vector<const Judged*> probable;
    for (const Judged* judged : all)
      if (judged->probability >= kLeastDetailed) probable.push_back(judged);
    for (std::size_t i = 0; i < events_->objects().size(); ++i)
      if (events_->is_present(i) || !events_->track(i).times.empty()) answer.objects.push_back(where(i, probable));
    const auto frame_means = [&](const Judged* judged, std::size_t k) {
      double nothing = 0.0;
      for (const Judged& n : nothings_)
        if (n.object == judged->object) nothing = n.frame_means[k];
      return is_reference(*judged) || judged->frame_means.empty() ? 0.0 : judged->frame_means[k] - nothing;
    };
    const ScenePath best = most_probable_path(*all.front());
    for (std::size_t k = 0; k < times_.size(); ++k) {
      DecidingFrame frame;
      frame.time = times_[k];
      frame.frame = frames_[k];
      for (const WhereItIs& object : answer.objects) frame.X_WO.push_back(pose_in_frame(best, object.object, k));
      frame.against_nothing = frame_means(all[0], k);
      const bool known = all.size() > 1 && (!all[1]->frame_means.empty());
      frame.against_second = known ? frame.against_nothing - frame_means(all[1], k) : 0.0;
      answer.frames.push_back(frame);
    }
    answer.remarks = events_->remarks();
    answer.text = paragraph_of(answer);
    return answer;
  }

  ExplainAnswer so_far() const {
    ExplainAnswer answer = counted();
    for (const Judged* judged : by_probability()) answer.explanations.push_back(explanation_of(*judged));
    answer.text = paragraph_of(answer);
    return answer;
  }

 private:
  std::vector<const Judged*> by_probability() const {
    std::vector<const Judged*> all;
    for (const Judged& judged : judged_) all.push_back(&judged);
    all.push_back(&nothings_.front());
    std::stable_sort(all.begin(), all.end(),
                     [](const Judged* a, const Judged* b) { return a->probability > b->probability; });
    return all;
  }

  /// Without explanations.
  ExplainAnswer counted() const {
    ExplainAnswer answer;
    answer.duration = events_->duration();
    answer.simulated = events_->simulated();
    answer.failed = events_->failed();
    answer.stepper = events_->stepper();
    return answer;
  }

  /// Nothing, from where the belief begins: what others are compared with.
  static bool is_reference(const Judged& judged) {
    return judged.hypothesis.kind == EventKind::kNothing && !judged.hypothesis.begins_otherwise;
  }

  /// At most so many of equal weights, every so many of them by weight.
  void thin_out(std::vector<TemperedPoint>& points) const {
    if (points.size() <= most_points_) return;
    std::vector<TemperedPoint> kept;
    double reached = 0.0;
    for (const TemperedPoint& point : points) {
      reached += point.weight * static_cast<double>(most_points_);
      while (kept.size() < most_points_ && static_cast<double>(kept.size()) + 0.5 < reached) kept.push_back(point);
    }
    for (TemperedPoint& point : kept) point.weight = 1.0 / static_cast<double>(kept.size());
    points = std::move(kept);
  }

  /// What follows from the posterior of a hypothesis: its points, once more, with all that is reported.
  void work_out(Judged& judged) {
    if (judged.hypothesis.kind == EventKind::kOther) return;
    thin_out(judged.posterior.points);
    std::vector<LatentPoint> points;
    for (const TemperedPoint& point : judged.posterior.points) points.push_back(point.z);
    judged.paths.resize(points.size());
    judged.draws.resize(points.size());
    judged.runs.resize(points.size());
    events_->simulate(judged.hypothesis, points, judged.paths, judged.draws, judged.runs);
    std::vector<double> ratios(points.size() * times_.size());
    likelihood_->evaluate(judged.paths, ratios);
    for (ScenePath& path : judged.paths) likelihood_->settle(path);
    judged.frame_means.assign(times_.size(), 0.0);
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t k = 0; k < times_.size(); ++k)
        judged.frame_means[k] += judged.posterior.points[i].weight * ratios[i * times_.size() + k];
    judged.unseen_ends = unseen_ends(*events_, *likelihood_, times_, judged, ratios);
  }

  Explanation explanation_of(const Judged& judged) const {
    Explanation e;
    const EventKind kind = judged.hypothesis.kind;
    e.kind = kind;
    e.probability = judged.probability;
    e.low = judged.low;
    e.high = judged.high;
    if (!is_reference(judged)) {
      e.object = events_->objects()[judged.object].name;
      e.log_bayes_factor = judged.log_bayes;
    }
    if (judged.hypothesis.begins_otherwise) e.present_at_start = !events_->is_present(judged.object);
    if (judged.hypothesis.partner) e.partner = events_->objects()[*judged.hypothesis.partner].name;
    if (judged.draws.empty() || kind == EventKind::kNothing) {
      e.sentence = sentence_of(e, window_);
      return e;
    }
    const auto value = [&](const auto& of, double centre = 0.0) {
      std::vector<std::pair<double, double>> values;
      EventValue result;
      for (std::size_t i = 0; i < judged.draws.size(); ++i) {
        if (judged.paths[i].impossible) continue;
        const double weight = judged.posterior.points[i].weight;
        values.emplace_back(of(judged.draws[i]) - centre, weight);
      }
      double all = 0.0;
      for (const auto& [x, weight] : values) result.mean += weight * x, all += weight;
      result.mean = centre + result.mean / std::max(1e-300, all);
      result.low = centre + value_quantile(values, 0.05);
      result.high = centre + value_quantile(values, 0.95);
      return result;
    };
    e.time = value([](const EventDraw& d) { return d.time; });
    if (kind == EventKind::kPushed || kind == EventKind::kBumped) {
      double x = 0.0, y = 0.0;
      for (std::size_t i = 0; i < judged.draws.size(); ++i) {
        if (judged.paths[i].impossible) continue;
        x += judged.posterior.points[i].weight * std::cos(judged.draws[i].direction);
        y += judged.posterior.points[i].weight * std::sin(judged.draws[i].direction);
      }
      const double middle = std::atan2(y, x);
      EventValue off =
          value([&](const EventDraw& d) { return std::remainder(d.direction - middle, 2.0 * std::numbers::pi); });
      const double degrees = 180.0 / std::numbers::pi;
      e.towards = EventValue{degrees * middle, degrees * (middle + off.low), degrees * (middle + off.high)};
      e.speed = value([](const EventDraw& d) { return d.speed; });
      e.touched_at = value([](const EventDraw& d) { return d.touched_height; });
      if (kind == EventKind::kBumped) e.impulse = value([](const EventDraw& d) { return d.speed * d.mass; });
    }
    add_effects(judged, e);
    e.sentence = sentence_of(e, window_);
    return e;
  }

  void add_effects(const Judged& judged, Explanation& e) const {
    const geometry::Vector3d up = -events_->scene().gravity_W.normalized();
    const auto start = events_->start_pose(judged.object);
    if (!start) return;
    std::size_t best = 0;
    for (std::size_t i = 0; i < judged.paths.size(); ++i) {
      const TemperedPoint& point = judged.posterior.points[i];
      if (point.log_likelihood > judged.posterior.points[best].log_likelihood) best = i;
      const ScenePath& path = judged.paths[i];
      const ObjectPath* moves = path.of(judged.object);
      if (path.impossible || moves == nullptr) continue;
      const auto& end = moves->back();
      if (!end) continue;
      const geometry::Vector3d com = belief::mean(events_->model(judged.object).center_of_mass);
      const double tilt =
          std::acos(std::clamp((start->rotation.conjugate() * up).dot(end->rotation.conjugate() * up), -1.0, 1.0));
      if (tilt > std::numbers::pi / 6.0) e.tips += point.weight;
      if (up.dot(*start * com - *end * com) > 0.05) e.falls += point.weight;
    }
    if (!judged.runs.empty() && judged.runs[best].states.size() > 1) {
      for (belief::Interval& interval : belief::timeline_of(events_->scene(), judged.runs[best]))
        if (interval.subject == e.object || interval.other == e.object) e.timeline.push_back(std::move(interval));
    }
  }

  /// Of the most probable instance.
  static ScenePath most_probable_path(const Judged& judged) {
    if (judged.hypothesis.kind == EventKind::kOther) return path_of(judged.object, judged.other_path);
    if (judged.paths.empty()) return {};
    std::size_t most = 0;
    for (std::size_t i = 0; i < judged.paths.size(); ++i)
      if (judged.posterior.points[i].log_likelihood > judged.posterior.points[most].log_likelihood) most = i;
    return judged.paths[most];
  }

  std::optional<Pose> pose_in_frame(const ScenePath& path, const std::string& name, std::size_t frame) const {
    for (std::size_t i = 0; i < events_->objects().size(); ++i) {
      if (events_->objects()[i].name != name) continue;
      const ObjectPath* moves = path.of(i);
      return (moves != nullptr ? *moves : likelihood_->base()[i])[frame];
    }
    return std::nullopt;
  }

  WhereItIs where(std::size_t object, const std::vector<const Judged*>& all) const {
    WhereItIs result;
    result.object = events_->objects()[object].name;
    PossiblePlaces places;
    for (const Judged* judged : all) {
      if (judged->hypothesis.kind == EventKind::kOther) {
        const bool is_its = object == judged->object;
        const auto& X_WO = is_its ? judged->other_path.back() : likelihood_->base()[object].back();
        const FramePeak* peak = is_its ? &likelihood_->peaks(object).back() : nullptr;
        geometry::Matrix3d covariance = geometry::Matrix3d::Zero();
        if (peak != nullptr && peak->seen) covariance = peak->covariance.bottomRightCorner<3, 3>();
        places.add(X_WO, judged->probability, covariance);
        continue;
      }
      if (object == judged->object && !judged->unseen_ends.empty()) {
        for (const UnseenEnd& end : judged->unseen_ends) places.add(end.X_WO, judged->probability * end.weight);
        continue;
      }
      for (std::size_t i = 0; i < judged->paths.size(); ++i) {
        const ScenePath& path = judged->paths[i];
        if (path.impossible) continue;
        const ObjectPath* moves = path.of(object);
        const double weight = judged->probability * judged->posterior.points[i].weight;
        if (moves == nullptr) {
          places.add(likelihood_->base()[object].back(), weight);
          continue;
        }
        const auto& X_WO = moves->back();
        if (!X_WO) places.add(X_WO, weight);
        for (const NearPath& near : likelihood_->near(path, object, times_.size() - 1))
          places.add(X_WO, weight * near.weight, near.error.covariance().bottomRightCorner<3, 3>(), near.off.tail<3>());
      }
    }
    result.present = places.all > 0.0 ? 1.0 - places.gone / places.all : 0.0;
    double there = 0.0;
    for (const PossiblePlace& place : places.there) result.mean += place.weight * place.mean, there += place.weight;
    if (there > 0.0) result.mean /= there;
    result.radius_90 = place_radius(places.there, result.mean, 0.9);
    // Of an object that stays, hypotheses about others know only the most probable place: what the belief knows of it.
    if (const auto index = belief::find_object(*window_.start, result.object); index && events_->is_present(object)) {
      const auto estimate = belief::estimate(*window_.start, window_.start->objects[static_cast<std::size_t>(*index)]);
      constexpr double kChi90 = 6.251;  // 90 % quantile of chi-squared with 3 degrees of freedom
      result.radius_90 =
          std::max(result.radius_90, std::sqrt(kChi90 * estimate.covariance.bottomRightCorner<3, 3>().trace() / 3.0));
    }
    const ScenePath path = most_probable_path(*all.front());
    result.out_of_sight = result.present > 0.5;
    for (const std::size_t k : likelihood_->last_frames())
      result.out_of_sight = result.out_of_sight && likelihood_->visible_share(path, k, object) < kOutOfSight;
    return result;
  }

  const ExplainWindow& window_;
  EventPaths* events_;
  WindowLikelihood* likelihood_;
  const std::vector<double>& times_;
  std::vector<Judged>& nothings_;
  std::vector<Judged>& judged_;
  const std::vector<std::size_t>& frames_;
  std::size_t most_points_;
};

}  // namespace

ExplainAnswer explain_answer(JudgedEvents& events) { return AnswerBuilder(events).answer(); }

ExplainAnswer explained_so_far(JudgedEvents& events) { return AnswerBuilder(events).so_far(); }

}  // namespace prescene::queries
