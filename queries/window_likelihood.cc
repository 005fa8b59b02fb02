// SPDX-License-Identifier: Apache-2.0
#include "window_likelihood.h"

#include <algorithm>
#include <cmath>

#include "prescene/belief/body_names.h"
#include "prescene/filter/proposals/learned_colors.h"
#include "prior.h"

namespace prescene::queries {
namespace {

using belief::Pose;

// Shapes, starts and what stands still are known to some millimetres: the spread of a hit is so many times the
// sensor's. Chosen on generated episodes (docs/reference/explain.md).
constexpr double kHitSpread = 2.5;
// What is put where another stood stands there to 1 cm, 3 mm in height, 0.03 rad of tilt and 0.5 rad of turn.
constexpr double kPutShift = 0.01, kPutLift = 0.003, kPutTilt = 0.03, kPutTurn = 0.5;
// Share of the variance of a depth that is the same in all frames (docs/reference/sensor_model.md): frames average out
// only the rest.
constexpr double kLastingError = 0.25;
// A path is at a frame's peak up to this squared distance (95 % of chi-squared with six degrees of freedom): what the
// image says of further ones is looked at.
constexpr double kAtPeak = 12.6;
// A path is known so much better than a frame shows, by this sum of ratios of variances, that the image itself weighs
// it: what the spread of the path adds is less than a quarter of a nat then.
constexpr double kKnownWell = 0.5;
constexpr float kBehindSupport = 0.02F;  // m; so far behind a support's surface an object is hidden by it
constexpr double kFarFromOutline = 1e3;  // px

/// A known surface that is seen at a slant returns as little as an object's would: the more holes are to be expected
/// where the object is absent, the less they speak for an object.
void expect_holes_at_slants(filter::FilterFrame& frame) {
  rendering::FrameTerms& terms = frame.terms;
  const rendering::SensorModelOptions& sensor = terms.model.options();
  const auto point = [&](int x, int y) { return terms.camera.unproject(x, y, frame.supports(x, y)); };
  for (int y = 1; y + 1 < terms.camera.height; ++y)
    for (int x = 1; x + 1 < terms.camera.width; ++x) {
      float& missing = terms.absent_missing(x, y);
      const bool known = frame.supports(x - 1, y) > 0.0F && frame.supports(x + 1, y) > 0.0F &&
                         frame.supports(x, y - 1) > 0.0F && frame.supports(x, y + 1) > 0.0F;
      if (!(missing >= 0.0F) || !known) continue;
      const geometry::Vector3d normal =
          (point(x + 1, y) - point(x - 1, y)).cross(point(x, y + 1) - point(x, y - 1)).normalized();
      const double cosine = std::abs(normal.dot(terms.camera.unproject(x, y, 1.0).normalized()));
      if (cosine > sensor.incidence_cosine.back()) continue;
      missing = std::max(missing, static_cast<float>(terms.model.missing_probability({}, cosine, kFarFromOutline)));
      terms.inverse_returns(x, y) = 1.0F / (1.0F - missing);
    }
}

}  // namespace

namespace {

/// Of a camera that has a noise of its own.
void widen(belief::DepthNoiseSettings& noise) {
  if (noise.sigma_per_depth_squared) *noise.sigma_per_depth_squared *= kHitSpread;
}

}  // namespace

double window_tempering(const rendering::Tempering& tempering, double pixels, int step, std::size_t frames) {
  return rendering::tempering(tempering, pixels, step) / (1.0 + kLastingError * static_cast<double>(frames - 1));
}

WindowLikelihood::WindowLikelihood(const belief::Belief& start, std::span<const belief::SceneObject> objects,
                                   std::span<const WindowFrame> frames, const ExplainContext& context,
                                   const filter::FilterTools& tools)
    : start_(start),
      objects_(objects),
      window_(frames),
      context_(context),
      tools_(tools),
      peaks_(objects.size()),
      shapes_(objects.size()) {}

void WindowLikelihood::set_peaks(std::size_t object, std::vector<FramePeak> peaks) {
  shapes_[object].clear();
  for (const FramePeak& peak : peaks) shapes_[object].emplace_back(peak);
  peaks_[object] = std::move(peaks);
}

core::Status WindowLikelihood::prepare() {
  auto scene = std::make_shared<belief::Scene>(*start_.scene);
  const filter::FrameOptions& options = context_.settings.frame;
  scene->depth_noise.sigma_per_depth_squared =
      kHitSpread * scene->depth_noise.sigma_per_depth_squared.value_or(options.sensor.sigma_per_depth_squared);
  if (scene->camera) widen(scene->camera->depth_noise);
  for (belief::SceneCamera& camera : scene->more_cameras) widen(camera.depth_noise);
  std::map<int, filter::FrameCache> caches;  // by camera
  for (const WindowFrame& seen : window_) {
    filter::FilterFrame& frame = frames_.emplace_back();
    const filter::FrameColors colors{context_.settings.colors,
                                     filter::learned_models(start_, options.colors, seen.observation.camera)};
    PRESCENE_RETURN_IF_ERROR(filter::prepare_frame(std::shared_ptr<const belief::Scene>(scene), seen.observation,
                                                   seen.belief->robot, colors, options, tools_,
                                                   caches[seen.observation.camera], &frame));
    frame.terms.step *= seen.sampled;
    expect_holes_at_slants(frame);
    stamps_.push_back(seen.observation.stamp_ns);
    std::vector<filter::SearchTarget>& targets = targets_.emplace_back();
    for (const belief::SceneObject& object : objects_) {
      belief::ObjectBelief named;
      named.name = object.name;
      named.model = object.model;
      targets.push_back(filter::target_of(named, *start_.scene, frame, tools_));
    }
  }
  for (const belief::SceneObject& object : objects_) {
    geometry::Matrix6d& error = start_errors_.emplace_back(geometry::Matrix6d::Zero());
    const auto index = belief::find_object(start_, object.name);
    if (!index || !is_present(start_.objects[static_cast<std::size_t>(*index)])) continue;
    const auto estimate = belief::estimate(start_, start_.objects[static_cast<std::size_t>(*index)]);
    error = turns_about_W(estimate.mean, estimate.covariance);
  }
  return core::ok_status();
}

void WindowLikelihood::set_base(std::vector<ObjectPath> base) {
  base_ = std::move(base);
  backgrounds_.clear();
  // One number for all, so that all compare: by the largest object.
  double pixels = 1.0;
  for (std::size_t k = 0; k < frames_.size(); ++k)
    for (std::size_t i = 0; i < objects_.size(); ++i)
      if (base_[i][k])
        pixels = std::max(pixels, static_cast<double>(evidence(k, frames_[k].terms, i, *base_[i][k]).measured));
  share_ = window_tempering(frames_.front().terms.tempering.weight, pixels, frames_.front().terms.step, frames_.size());
}

geometry::DepthImage WindowLikelihood::depth_of(std::size_t frame, std::size_t object, const Pose& X_WO) const {
  const filter::FilterFrame& f = frames_[frame];
  return filter::depth_of(targets_[frame][object], f.X_CW * X_WO, f.terms.camera, *tools_.renderer);
}

rendering::FrameTerms WindowLikelihood::terms_with(std::size_t frame, const geometry::DepthImage& known) const {
  const filter::FilterFrame& f = frames_[frame];
  rendering::FrameTerms terms;
  rendering::with_known_surfaces(f.terms, known, &terms);
  for (std::size_t i = 0; i < terms.known.size(); ++i) {
    const float support = f.supports.data()[i];
    if (!(support > 0.0F)) continue;
    float& nearest = terms.known.data()[i];
    const float hides = support + kBehindSupport;
    if (nearest == 0.0F || hides < nearest) nearest = hides;
  }
  return terms;
}

rendering::PoseEvidence WindowLikelihood::evidence(std::size_t frame, const rendering::FrameTerms& terms,
                                                   std::size_t object, const Pose& X_WO) const {
  const rendering::WorkspacePool::Loan workspace(tools_.search->workspaces());
  const rendering::PoseHypothesis h = filter::hypothesis(targets_[frame][object], frames_[frame].X_CW * X_WO);
  rendering::PoseEvidence result;
  tools_.search->batch().evaluate(terms, std::span(&h, 1), *workspace, std::span(&result, 1));
  return result;
}

const WindowLikelihood::Background& WindowLikelihood::background(std::size_t frame,
                                                                 const std::vector<std::size_t>& moved) {
  const std::pair key(frame, moved);
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = backgrounds_.find(key); known != backgrounds_.end()) return *known->second;
  }
  auto made = std::make_unique<Background>();
  made->depth = frames_[frame].robot;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (!base_[i][frame] || std::binary_search(moved.begin(), moved.end(), i)) continue;
    made->log_ratio += evidence(frame, terms_with(frame, made->depth), i, *base_[i][frame]).log_ratio;
    filter::merge_nearest(depth_of(frame, i, *base_[i][frame]), &made->depth);
  }
  made->terms = terms_with(frame, made->depth);
  const std::lock_guard lock(mutex_);  // Another thread may have made the same.
  return *backgrounds_.emplace(key, std::move(made)).first->second;
}

double WindowLikelihood::log_ratio(const ScenePath& path, std::size_t frame, std::size_t m, const Pose& X_WO,
                                   const Background& known) const {
  bool first = true;
  geometry::DepthImage depth;
  for (std::size_t before = 0; before < m; ++before) {
    const auto& X_WB = path.paths[before][frame];
    if (!X_WB) continue;
    if (first) depth = known.depth;
    first = false;
    filter::merge_nearest(depth_of(frame, path.moved[before], *X_WB), &depth);
  }
  // Not by a conditional expression, whose value would be a copy of all of the frame's terms.
  if (first) return evidence(frame, known.terms, path.moved[m], X_WO).log_ratio;
  return evidence(frame, terms_with(frame, depth), path.moved[m], X_WO).log_ratio;
}

template <class Direct>
double WindowLikelihood::weigh(std::size_t object, const FramePeak* peak, PathError& error,
                               const Direct& direct) const {
  if (peak == nullptr) return direct(error.pose());
  const PathFit fit = error.fit(*peak, shapes_[object][static_cast<std::size_t>(peak - peaks_[object].data())]);
  const bool near = fit.mahalanobis < kAtPeak;
  // A peak is a Gaussian of some dozens of draws. It stands for paths that are nearly there, not for those of which the
  // image can be asked.
  if (fit.spread < kKnownWell) {
    const double image = direct(error.pose());
    if (near) error.learn(*peak);
    return image;
  }
  if (!near) {
    const double image = direct(error.pose());
    if (fit.log_likelihood <= image) return image;
  }
  error.learn(*peak);
  return fit.log_likelihood;
}

double WindowLikelihood::stays(std::size_t frame, std::size_t object, PathError& error) {
  const Background& known = background(frame, {object});
  const std::vector<FramePeak>& peaks = peaks_[object];
  const auto direct = [&](const Pose& X_WO) { return share_ * evidence(frame, known.terms, object, X_WO).log_ratio; };
  return share_ * known.log_ratio +
         weigh(object, !peaks.empty() && peaks[frame].seen ? &peaks[frame] : nullptr, error, direct);
}

void WindowLikelihood::follow(const ScenePath& path, std::span<double> log_ratios, std::size_t of,
                              std::vector<NearPath>* near) {
  // By how much simulated paths are off is not known: a filter for each share, and the frames weigh them.
  const std::size_t moved = path.moved.size(), shares = path.simulated ? kErrorShares.size() : 1;
  const geometry::Vector3d up = belief::up_of(*start_.scene);
  std::vector<PathError> errors;
  for (std::size_t s = 0; s < shares; ++s)
    for (const std::size_t object : path.moved) {
      const belief::ObjectModel& model = start_.scene->model_of(objects_[object]);
      errors.emplace_back(path.simulated ? kErrorShares[s] : 0.0, std::sqrt(0.5 * model.unit_inertia.trace()), up,
                          model.symmetry);
      errors.back().loosen(start_errors_[object]);
    }
  geometry::Matrix6d put_error = geometry::Matrix6d::Zero();
  const geometry::Matrix3d along = up * up.transpose(), across = geometry::Matrix3d::Identity() - along;
  put_error.topLeftCorner<3, 3>() = kPutTurn * kPutTurn * along + kPutTilt * kPutTilt * across;
  put_error.bottomRightCorner<3, 3>() = kPutLift * kPutLift * along + kPutShift * kPutShift * across;
  std::vector<std::uint8_t> stands(moved, 0), put_at_peak(moved, 0);
  std::vector<double> log_weight(shares, -std::log(static_cast<double>(shares))), in_frame(shares);
  // A peak is measured with all else where it was. Of two that change places, one would hide the other.
  const bool alone = !path.put_down_from || path.put_anywhere;
  for (std::size_t k = 0; k < log_ratios.size(); ++k) {
    const Background& known = background(k, path.moved);
    std::fill(in_frame.begin(), in_frame.end(), share_ * known.log_ratio);
    for (std::size_t m = 0; m < moved; ++m) {
      if (!path.paths[m][k]) continue;
      const std::vector<FramePeak>& peaks = peaks_[path.moved[m]];
      const bool put_down = path.put_down_from && k >= *path.put_down_from;
      const FramePeak* peak = alone && !peaks.empty() && peaks[k].seen ? &peaks[k] : nullptr;
      // It stands where it is seen first from when it is put down, whatever frames before that say of the place.
      if (put_down && path.put_anywhere && k == *path.put_down_from) {
        const auto first = std::find_if(peaks.begin() + static_cast<std::ptrdiff_t>(k), peaks.end(),
                                        [](const FramePeak& of_frame) { return of_frame.seen; });
        for (std::size_t s = 0; s < shares && first != peaks.end(); ++s) errors[s * moved + m].put_at(*first, true);
        if (first != peaks.end()) stands[m] = 1;
      }
      if (stands[m] != 0 && peak != nullptr && put_at_peak[m] == 0) {
        put_at_peak[m] = 1;
        for (std::size_t s = 0; s < shares; ++s) {
          errors[s * moved + m].put_at(*peak, true);
          in_frame[s] += peak->log_mass + peak->log_put_down;
        }
        continue;
      }
      std::optional<std::pair<Pose, double>> looked_at;  // Errors that are alike ask for the same.
      const auto direct = [&](const Pose& X_WO) {
        const bool again = looked_at && looked_at->first.translation == X_WO.translation &&
                           looked_at->first.rotation.coeffs() == X_WO.rotation.coeffs();
        if (!again) looked_at.emplace(X_WO, share_ * log_ratio(path, k, m, X_WO, known));
        return looked_at->second;
      };
      for (std::size_t s = 0; s < shares; ++s) {
        PathError& error = errors[s * moved + m];
        if (stands[m] == 0) error.move_to(*path.paths[m][k]);
        if (put_down && !path.put_anywhere && k == *path.put_down_from) error.loosen(put_error);
        in_frame[s] += weigh(path.moved[m], peak, error, direct);
      }
    }
    double top = -1e300, sum = 0.0;
    for (std::size_t s = 0; s < shares; ++s) top = std::max(top, log_weight[s] += in_frame[s]);
    for (const double w : log_weight) sum += std::exp(w - top);
    log_ratios[k] = top + std::log(sum);
    for (double& w : log_weight) w -= log_ratios[k];
  }
  const auto at = std::find(path.moved.begin(), path.moved.end(), of);
  if (near == nullptr || at == path.moved.end()) return;
  const auto m = static_cast<std::size_t>(at - path.moved.begin());
  const auto& last = path.paths[m][log_ratios.size() - 1];
  if (!last) return;
  for (std::size_t s = 0; s < shares; ++s) {
    const PathError& error = errors[s * moved + m];
    const Pose X_WO = error.pose();
    geometry::Vector6d off;
    off.head<3>() = geometry::log_rotation(X_WO.rotation * last->rotation.conjugate());
    off.tail<3>() = X_WO.translation - last->translation;
    near->push_back({std::exp(log_weight[s]), off, error});
  }
}

void WindowLikelihood::evaluate(std::span<const ScenePath> paths, std::span<double> log_ratios) {
  const std::size_t count = frames_.size();
  tools_.search->threads().for_blocks(paths.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::span<double> of_path = log_ratios.subspan(i * count, count);
      if (paths[i].impossible)
        std::fill(of_path.begin(), of_path.end(), -1e6);
      else
        follow(paths[i], of_path);
    }
  });
}

void WindowLikelihood::settle(ScenePath& path) const {
  if (!path.put_down_from || !path.put_anywhere) return;
  const geometry::Vector3d up = belief::up_of(*start_.scene);
  for (std::size_t m = 0; m < path.moved.size(); ++m) {
    const std::vector<FramePeak>& peaks = peaks_[path.moved[m]];
    const std::size_t from = *path.put_down_from;
    for (std::size_t seen = from; seen < peaks.size(); ++seen) {
      if (!peaks[seen].seen) continue;
      PathError error(0.0, 1.0, up, start_.scene->model_of(objects_[path.moved[m]]).symmetry);
      error.put_at(peaks[seen], true);
      std::fill(path.paths[m].begin() + static_cast<std::ptrdiff_t>(from), path.paths[m].end(), error.pose());
      break;
    }
  }
}

std::vector<NearPath> WindowLikelihood::near(const ScenePath& path, std::size_t object, std::size_t frame) {
  std::vector<double> log_ratios(frame + 1);
  std::vector<NearPath> near;
  follow(path, log_ratios, object, &near);
  return near;
}

double WindowLikelihood::log_ratio(const ScenePath& path, std::size_t frame) {
  const Background& known = background(frame, path.moved);
  double sum = known.log_ratio;
  for (std::size_t m = 0; m < path.moved.size(); ++m)
    if (const auto& X_WO = path.paths[m][frame]) sum += log_ratio(path, frame, m, *X_WO, known);
  return share_ * sum;
}

void WindowLikelihood::evaluate(std::size_t frame, std::size_t object, std::span<const Pose> X_WO,
                                std::span<double> log_ratios) {
  const Background& known = background(frame, {object});
  tools_.search->threads().for_blocks(X_WO.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      log_ratios[i] = share_ * (known.log_ratio + evidence(frame, known.terms, object, X_WO[i]).log_ratio);
  });
}

double WindowLikelihood::visible_share(const ScenePath& path, std::size_t frame, std::size_t object) {
  const auto pose_of = [&](std::size_t i) -> const std::optional<Pose>& {
    const ObjectPath* moves = path.of(i);
    return (moves != nullptr ? *moves : base_[i])[frame];
  };
  const auto& X_WO = pose_of(object);
  if (!X_WO) return 0.0;
  geometry::DepthImage hides = frames_[frame].robot;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (i == object) continue;
    if (const auto& X_WI = pose_of(i)) filter::merge_nearest(depth_of(frame, i, *X_WI), &hides);
  }
  const rendering::PoseEvidence seen = evidence(frame, terms_with(frame, hides), object, *X_WO);
  // By how much of it would be in view if nothing stood before it, the image's edge included.
  return seen.in_view > 0 ? static_cast<double>(seen.covered) / seen.in_view : 0.0;
}

}  // namespace prescene::queries
