// SPDX-License-Identifier: Apache-2.0
#include "why_frames.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#include "prescene/filter/operators/track_state.h"
#include "prescene/filter/proposals/learned_colors.h"

namespace prescene::queries {
namespace {

using belief::Pose;
using geometry::DepthImage;
using geometry::Image;
using geometry::Vector3d;

// Images of doubles that the work on one frame takes, about.
constexpr std::size_t kImagesOfWork = 24;
// Share of half the object's width, or height, in the image from which on its pixels lie on one side.
constexpr double kOnOneSide = 0.3;

/// The object at one pose.
struct SeenPose {
  Pose X_CO;
  rendering::FrameTerms terms;
  rendering::PoseEvidence evidence;
  Image<float> nats;      // NaN where it says nothing
  Image<float> by_depth;  // the same without colours
  DepthImage silhouette;  // of the object alone
};

double value_at(const Image<float>& nats, std::size_t i) {
  const auto value = static_cast<double>(nats.data()[i]);
  return std::isnan(value) ? 0.0 : value;
}

bool is_at_rim(const DepthImage& silhouette, int x, int y) {
  constexpr std::array<std::array<int, 2>, 4> kNeighbours = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  return std::any_of(kNeighbours.begin(), kNeighbours.end(), [&](const auto& to) {
    const int u = x + to[0], v = y + to[1];
    return u >= 0 && v >= 0 && u < silhouette.width() && v < silhouette.height() && !(silhouette(u, v) > 0.0F);
  });
}

/// `other` null: nothing is there.
JudgedComparison compared(const SeenPose& pose, const SeenPose* other) {
  JudgedComparison result;
  WhyFrame& frame = result.frame;
  const DepthImage& measured = pose.terms.depth;
  const int width = measured.width(), height = measured.height();
  result.nats = Image<float>(width, height, std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      if (std::isnan(pose.nats.data()[i]) && (other == nullptr || std::isnan(other->nats.data()[i]))) continue;
      double nats = value_at(pose.nats, i), by_depth = value_at(pose.by_depth, i);
      bool alone = other == nullptr && is_at_rim(pose.silhouette, x, y);
      if (other != nullptr) {
        nats -= value_at(other->nats, i);
        by_depth -= value_at(other->by_depth, i);
        alone = (pose.silhouette.data()[i] > 0.0F) != (other->silhouette.data()[i] > 0.0F);
      }
      result.nats.data()[i] = static_cast<float>(nats);
      if (measured.data()[i] == 0.0F) {
        frame.terms.missing += nats;
      } else {
        frame.terms.color += nats - by_depth;
        (alone ? frame.terms.outline : frame.terms.surface) += by_depth;
      }
      (nats > 0.0 ? frame.speaks_for : frame.speaks_against) += nats;
      frame.pixels_for += nats > 0.0;
      frame.pixels_against += nats < 0.0;
    }
  frame.log_ratio = pose.evidence.log_ratio - (other != nullptr ? other->evidence.log_ratio : 0.0);
  return result;
}

/// "on its left", ...: where `x`, `y` are within the box; "" = nowhere in particular.
std::string side_in(double x, double y, double left, double right, double top, double bottom) {
  const auto off = [](double value, double low, double high) {
    return high - low >= 2.0 ? (value - 0.5 * (low + high)) / (0.5 * (high - low)) : 0.0;
  };
  const double across = off(x, left, right), down = off(y, top, bottom);
  if (std::max(std::abs(across), std::abs(down)) < kOnOneSide) return {};
  if (std::abs(across) >= std::abs(down)) return across < 0.0 ? "on the left" : "on the right";
  return down < 0.0 ? "in the upper part" : "in the lower part";
}

/// Where the pixels lie that have the sign of the frame's sum.
std::optional<WhyPlace> place_of(const JudgedComparison& judged, const SeenPose& pose, const SeenPose* other) {
  const double sign = judged.frame.log_ratio < 0.0 ? -1.0 : 1.0;
  int left = judged.nats.width(), right = -1, top = judged.nats.height(), bottom = -1;
  double weight = 0.0, x_sum = 0.0, y_sum = 0.0, on_it = 0.0;
  Vector3d p_sum = Vector3d::Zero();
  for (int y = 0; y < judged.nats.height(); ++y)
    for (int x = 0; x < judged.nats.width(); ++x) {
      const bool covers = pose.silhouette(x, y) > 0.0F;
      if (!covers && (other == nullptr || !(other->silhouette(x, y) > 0.0F))) continue;
      left = std::min(left, x), right = std::max(right, x);
      top = std::min(top, y), bottom = std::max(bottom, y);
      const auto nats = static_cast<double>(judged.nats(x, y));
      if (std::isnan(nats) || !(sign * nats > 0.0)) continue;
      weight += std::abs(nats);
      x_sum += std::abs(nats) * x;
      y_sum += std::abs(nats) * y;
      if (!covers) continue;
      on_it += std::abs(nats);
      p_sum += std::abs(nats) * pose.terms.camera.unproject(x, y, static_cast<double>(pose.silhouette(x, y)));
    }
  if (!(weight > 0.0)) return std::nullopt;
  WhyPlace place;
  place.in_image = side_in(x_sum / weight, y_sum / weight, left, right, top, bottom);
  if (on_it > 0.0) place.p_OQ = pose.X_CO.inverse() * Vector3d(p_sum / on_it);
  return place;
}

/// Which known thing stands before the object at each pixel that is hidden.
std::vector<HiddenBy> hidden_by(const SeenPose& pose, const filter::FilterFrame& frame,
                                std::span<const DepthImage> others, std::span<const std::string> names) {
  std::vector<HiddenBy> found(others.size() + 2);
  for (std::size_t k = 0; k < others.size(); ++k) found[k].name = names[k];
  found[others.size()].kind = HiddenBy::Kind::kRobot;
  found[others.size() + 1].kind = HiddenBy::Kind::kSupport;
  for (std::size_t i = 0; i < pose.silhouette.size(); ++i) {
    const float depth = pose.silhouette.data()[i], known = pose.terms.known.data()[i];
    if (!(depth > 0.0F) || !(known > 0.0F) || !(known < depth)) continue;
    std::size_t who = others.size() + (frame.robot.data()[i] == known ? 0U : 1U);
    for (std::size_t k = 0; k < others.size(); ++k)
      if (others[k].data()[i] == known) who = k;
    ++found[who].pixels;
  }
  std::erase_if(found, [](const HiddenBy& by) { return by.pixels == 0; });
  std::stable_sort(found.begin(), found.end(),
                   [](const HiddenBy& a, const HiddenBy& b) { return a.pixels > b.pixels; });
  return found;
}

}  // namespace

core::Result<JudgedFrame> FrameJudge::judge(const WindowFrame& seen, std::size_t object, const Pose& X_WO,
                                            std::span<const std::optional<Pose>> others, std::size_t kept) {
  const belief::Belief& belief = *seen.belief;
  const int camera = seen.observation.camera;
  const filter::FilterSettings& settings = context_.explain.settings;
  const filter::FrameColors colors{settings.colors, filter::learned_models(belief, settings.frame.colors, camera)};
  filter::FilterFrame frame;
  PRESCENE_RETURN_IF_ERROR(filter::prepare_frame(belief.scene, seen.observation, belief.robot, colors, settings.frame,
                                                 tools_, caches_[camera], &frame));
  frame.terms.step *= seen.sampled;
  const std::size_t pixels = frame.terms.depth.size();
  const std::size_t bytes = pixels * (kept * sizeof(float) + kImagesOfWork * sizeof(double));
  if (bytes > context_.explain.simulation.most_bytes)
    return core::resource_exhausted("the images of " + std::to_string(pixels) + " pixels take " +
                                    std::to_string(bytes >> 20) + " MiB, more than a question may: ask for fewer");
  // As the filter weighs it: all else is where the belief has it.
  std::vector<DepthImage> depths;
  std::vector<std::string> names;
  for (std::size_t j = 0; j < belief.objects.size(); ++j) {
    const belief::ObjectBelief& neighbour = belief.objects[j];
    if (j == object || neighbour.particles.empty() || !filter::hides_others(neighbour)) continue;
    const filter::SearchTarget target = filter::target_of(neighbour, *belief.scene, frame, tools_);
    depths.push_back(filter::depth_of(target, frame.X_CW * belief::heaviest(neighbour.particles).X_WO,
                                      frame.terms.camera, *tools_.renderer));
    names.push_back(neighbour.name);
  }
  std::vector<const DepthImage*> known;
  for (const DepthImage& depth : depths) known.push_back(&depth);

  const filter::SearchTarget target = filter::target_of(belief.objects[object], *belief.scene, frame, tools_);
  const auto look = [&](const Pose& X_WQ) {
    SeenPose at;
    at.X_CO = frame.X_CW * X_WQ;
    at.terms =
        filter::terms_for_object(frame, known, at.X_CO * target.centre(), static_cast<double>(target.mesh->radius));
    rendering::PoseHypothesis pose = filter::hypothesis(target, at.X_CO);
    const rendering::WorkspacePool::Loan workspace(tools_.search->workspaces());
    tools_.search->batch().evaluate(at.terms, std::span(&pose, 1), *workspace, std::span(&at.evidence, 1));
    at.nats = context_.pixels(at.terms, pose);
    at.by_depth = at.nats;
    if (pose.color_model >= 0 && !at.terms.color_ratio.empty()) {
      pose.color_model = -1;
      at.by_depth = context_.pixels(at.terms, pose);
    }
    at.silhouette = filter::depth_of(target, at.X_CO, at.terms.camera, *tools_.renderer);
    return at;
  };
  const SeenPose pose = look(X_WO);
  JudgedFrame judged;
  judged.view = {seen.observation.stamp_ns, camera, X_WO, pose.evidence, hidden_by(pose, frame, depths, names)};
  judged.tempering = frame.terms.tempering.weight;
  judged.step = frame.terms.step;
  judged.pixels = pose.evidence.measured;
  for (const std::optional<Pose>& X_WQ : others) {
    std::optional<SeenPose> other;
    if (X_WQ) other = look(*X_WQ);
    if (other) judged.pixels = std::max(judged.pixels, static_cast<double>(other->evidence.measured));
    JudgedComparison& one = judged.comparisons.emplace_back(compared(pose, other ? &*other : nullptr));
    one.place = place_of(one, pose, other ? &*other : nullptr);
  }
  return judged;
}

}  // namespace prescene::queries
