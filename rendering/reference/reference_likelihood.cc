// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/reference/reference_likelihood.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "object_raster.h"
#include "prescene/core/check.h"
#include "prescene/rendering/portable_math.h"
#include "prescene/rendering/sensor/camera_equations.h"
#include "prescene/rendering/sensor/near_plane.h"
#include "prescene/rendering/sensor/pixel_classes.h"

namespace prescene::rendering {
namespace {

class ReferenceWorkspace final : public LikelihoodWorkspace {
 public:
  ObjectRaster raster;
};

/// The logarithm of a product of many numbers with one logarithm in a while.
class LogProduct {
 public:
  void multiply(float factor) {
    product_ *= static_cast<double>(factor);
    // Factors lie between kMinRatio and 1e9, so 16 of them stay far from the ends of double precision.
    if (++count_ == 16) flush();
  }
  double log() {
    flush();
    return sum_;
  }

 private:
  void flush() {
    sum_ += portable_log(product_);
    product_ = 1.0;
    count_ = 0;
  }

  double product_ = 1.0;
  double sum_ = 0.0;
  int count_ = 0;
};

/// One covered pixel that no known surface hides.
struct Pixel {
  int x;
  int y;
  Vector3f ray;  ///< Through the pixel's centre, z = 1.
  float depth;   ///< Rendered.
  float inverse_depth;
  float measured;  ///< 0 = no return.
  float slope;     ///< n . ray of the ray with z = 1, < 0.
  float cosine;
  const FacePlane* face;
};

/// Adds up what the pixels of one hypothesis say.
class EvidenceSum {
 public:
  EvidenceSum(const FrameTerms& frame, const PoseHypothesis& hypothesis)
      : frame_(frame),
        hypothesis_(hypothesis),
        classes_(frame.model, *hypothesis.material, frame.step),
        precision_(frame.model.options()),
        min_depth_(static_cast<float>(frame.model.options().min_depth)) {
    if (hypothesis.color_model < 0 || frame.color_ratio.empty()) return;
    PRESCENE_CHECK(static_cast<std::size_t>(hypothesis.color_model) < frame.color_ratio.size());
    color_ratio_ = &frame.color_ratio[static_cast<std::size_t>(hypothesis.color_model)];
  }

  void add(const Pixel& pixel, bool outline) {
    const PixelClass& c = classes_.at(pixel.cosine, outline);
    const float absent_missing = frame_.absent_missing(pixel.x, pixel.y);
    ++evidence_.covered;
    if (pixel.measured == 0.0f) {
      missing_ +=
          absent_missing < 0.0f ? c.log_missing_ratio : portable_log(static_cast<double>(c.missing / absent_missing));
      return;
    }
    const float precision = precision_.scale * pixel.inverse_depth * pixel.inverse_depth *
                            std::clamp(pixel.cosine * precision_.per_cosine, precision_.least, 1.0f);
    const float deviation = (pixel.measured - pixel.depth) * precision;
    float density = c.outlier_density;
    if (std::abs(deviation) < kHitSigmas) {
      const float hit = c.hit * precision * portable_exp2(kNormalExponent * deviation * deviation);
      density += color_ratio_ != nullptr ? hit * (*color_ratio_)(pixel.x, pixel.y) : hit;
    }
    const float occluder = c.occluder / (pixel.depth - min_depth_);
    density += deviation < 0.0f ? occluder : 0.0f;
    const float returned =
        absent_missing < 0.0f ? c.returned_ratio : c.returned * frame_.inverse_returns(pixel.x, pixel.y);
    const float ratio = std::max(returned * (density * frame_.inverse_absent(pixel.x, pixel.y) + c.behind), kMinRatio);
    ++evidence_.measured;
    if (deviation < -kMatchSigmas) {
      occluded_.multiply(ratio);
      return;
    }
    ++evidence_.visible;
    visible_.multiply(ratio);
    if (deviation <= kMatchSigmas) ++evidence_.hits;
  }

  PoseEvidence result(int in_view) {
    evidence_.in_view = in_view;
    evidence_.visible_log_ratio = visible_.log();
    evidence_.log_ratio = evidence_.visible_log_ratio + occluded_.log() + missing_;
    temper(frame_, hypothesis_, &evidence_);
    return evidence_;
  }

 private:
  const FrameTerms& frame_;
  const PoseHypothesis& hypothesis_;
  PixelClasses classes_;
  const geometry::Image<float>* color_ratio_ = nullptr;
  HitPrecision precision_;
  float min_depth_;
  LogProduct visible_;
  LogProduct occluded_;
  double missing_ = 0.0;
  PoseEvidence evidence_;
};

/// Adds up the Gauss-Newton equations of one hypothesis in camera axes.
class EquationSum {
 public:
  EquationSum(const FrameTerms& frame, const PoseHypothesis& hypothesis, const LineariseOptions& options)
      : X_CO_(hypothesis.X_CO),
        p_CO_(hypothesis.X_CO.translation.cast<float>()),
        two_over_gate_(static_cast<float>(2.0 / options.gate)),
        min_cosine_(static_cast<float>(options.min_cosine)),
        precision_(HitPrecision(frame.model.options()).scale) {}

  void add(const Pixel& pixel) {
    if (pixel.measured == 0.0f || pixel.cosine < min_cosine_) return;
    // Measured and rendered point are on one ray, so their difference along the normal is the slope's share of it.
    const float residual = pixel.slope * (pixel.measured - pixel.depth);
    const float scaled = two_over_gate_ * residual;
    const float root = 1.0f / (1.0f + scaled * scaled);
    const float robust = root * root;
    const float precision = precision_ * pixel.inverse_depth * pixel.inverse_depth;
    const float weight = robust * precision * precision;
    const Vector3f& normal = pixel.face->normal;
    const Vector3f moment = (pixel.ray * pixel.depth - p_CO_).cross(normal);
    const std::array<float, 6> row = {moment.x(), moment.y(), moment.z(), normal.x(), normal.y(), normal.z()};
    std::size_t k = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      const float weighted = weight * row[i];
      sums_.g[i] += static_cast<double>(weighted * residual);
      for (std::size_t j = i; j < 6; ++j) sums_.H[k++] += static_cast<double>(weighted * row[j]);
    }
    ++sums_.pixels;
    sums_.weight += static_cast<double>(robust);
    sums_.squares += static_cast<double>(robust * residual * residual);
  }

  /// The sums with rotations turned from camera axes to the body's.
  PoseLinearisation result() const { return in_body_axes(sums_, X_CO_); }

 private:
  geometry::Pose X_CO_;
  Vector3f p_CO_;
  float two_over_gate_;
  float min_cosine_;
  float precision_;  // of a frontal hit at 1 m
  CameraEquations sums_;
};

/// Draws a hypothesis and calls visit(pixel) for each pixel that it covers before the end of the range and that no
/// known surface hides. Returns the number of pixels covered, hidden ones included.
template <class Visit>
int for_each_pixel(const FrameTerms& frame, const PoseHypothesis& hypothesis, ObjectRaster& raster, Visit&& visit) {
  const geometry::PinholeCamera& camera = frame.camera;
  const SensorModelOptions& options = frame.model.options();
  raster.draw(*hypothesis.mesh, hypothesis.X_CO, camera, nearest_drawn(options));
  const auto max_depth = static_cast<float>(options.max_depth);
  const auto inverse_fx = static_cast<float>(1.0 / camera.fx);
  const auto inverse_fy = static_cast<float>(1.0 / camera.fy);
  const PixelRect& rect = raster.rect();
  int in_view = 0;
  for (int y = rect.y_first; y <= rect.y_last; ++y) {
    const float ray_y = (static_cast<float>(y) - static_cast<float>(camera.cy)) * inverse_fy;
    for (int x = rect.x_first; x <= rect.x_last; ++x) {
      const float inverse_depth = raster.inverse_depth(x, y);
      if (inverse_depth == 0.0f) continue;
      const float depth = 1.0f / inverse_depth;
      if (depth >= max_depth) continue;
      ++in_view;
      const float known = frame.known(x, y);
      if (known > 0.0f && known < depth) continue;
      const float ray_x = (static_cast<float>(x) - static_cast<float>(camera.cx)) * inverse_fx;
      const FacePlane& face = raster.face(x, y);
      const float slope = face.distance * inverse_depth;
      const float cosine = std::max(-slope * frame.inverse_ray(x, y), 1e-6f);
      visit(Pixel{x, y, Vector3f(ray_x, ray_y, 1.0f), depth, inverse_depth, frame.depth(x, y), slope, cosine, &face});
    }
  }
  return in_view;
}

class ReferenceLikelihoodBatch final : public LikelihoodBatch {
 public:
  LikelihoodBatchInfo info() const override { return {"reference", true}; }

  std::unique_ptr<LikelihoodWorkspace> make_workspace() const override {
    return std::make_unique<ReferenceWorkspace>();
  }

  void evaluate(const FrameTerms& frame, std::span<const PoseHypothesis> hypotheses, LikelihoodWorkspace& workspace,
                std::span<PoseEvidence> evidences) const override {
    PRESCENE_CHECK(hypotheses.size() == evidences.size());
    ObjectRaster& raster = static_cast<ReferenceWorkspace&>(workspace).raster;
    for (std::size_t i = 0; i < hypotheses.size(); ++i) {
      EvidenceSum sum(frame, hypotheses[i]);
      const int in_view = for_each_pixel(frame, hypotheses[i], raster, [&](const Pixel& pixel) {
        sum.add(pixel, raster.at_outline(pixel.x, pixel.y));
      });
      evidences[i] = sum.result(in_view);
    }
  }

  void linearise(const FrameTerms& frame, std::span<const PoseHypothesis> hypotheses, const LineariseOptions& options,
                 LikelihoodWorkspace& workspace, std::span<PoseLinearisation> linearisations) const override {
    PRESCENE_CHECK(hypotheses.size() == linearisations.size());
    PRESCENE_CHECK(options.gate > 0.0);
    ObjectRaster& raster = static_cast<ReferenceWorkspace&>(workspace).raster;
    for (std::size_t i = 0; i < hypotheses.size(); ++i) {
      EquationSum equations(frame, hypotheses[i], options);
      if (!options.with_evidence) {
        for_each_pixel(frame, hypotheses[i], raster, [&](const Pixel& pixel) { equations.add(pixel); });
        linearisations[i] = equations.result();
        continue;
      }
      EvidenceSum sum(frame, hypotheses[i]);
      const int in_view = for_each_pixel(frame, hypotheses[i], raster, [&](const Pixel& pixel) {
        equations.add(pixel);
        sum.add(pixel, raster.at_outline(pixel.x, pixel.y));
      });
      linearisations[i] = equations.result();
      linearisations[i].evidence = sum.result(in_view);
    }
  }
};

}  // namespace

std::unique_ptr<LikelihoodBatch> make_reference_likelihood_batch() {
  return std::make_unique<ReferenceLikelihoodBatch>();
}

geometry::Image<float> log_ratio_map(const FrameTerms& frame, const PoseHypothesis& hypothesis) {
  geometry::Image<float> map(frame.camera.width, frame.camera.height, std::numeric_limits<float>::quiet_NaN());
  ObjectRaster raster;
  const EvidenceSum nothing(frame, hypothesis);
  for_each_pixel(frame, hypothesis, raster, [&](const Pixel& pixel) {
    EvidenceSum one = nothing;
    one.add(pixel, raster.at_outline(pixel.x, pixel.y));
    map(pixel.x, pixel.y) = static_cast<float>(one.result(0).log_ratio);
  });
  return map;
}

}  // namespace prescene::rendering
