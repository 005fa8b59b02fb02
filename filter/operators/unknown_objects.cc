// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/unknown_objects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "prescene/core/check.h"

namespace prescene::filter {
namespace {

using belief::ObjectBelief;
using geometry::Matrix3d;

constexpr double kExplainedPixels = 0.015;  // m; measurements so near to a known surface are explained
constexpr double kNearKnown = 0.015;        // m; points so near to a known object may be its own ...
constexpr double kMostNearKnown = 0.2;      // ... and at most this share of a new object's are
constexpr double kSameSurface = 0.012;      // m between neighbouring pixels of one surface
constexpr int kFewestNeighbours = 3;        // of eight, on the same surface: fewer has what flies between two surfaces
constexpr std::size_t kFewestPoints = 10;
constexpr double kTrimmed = 0.01;     // share of the points that may lie outside at each end
constexpr int kDirections = 90;       // of a side, over a right angle
constexpr double kLeastEdge = 0.01;   // m; nothing that is seen is thinner
constexpr double kUnknownHits = 0.6;  // share of the visible pixels that must match
constexpr double kUnknownExistence = 0.8;
// kg/m^3: from a filled carton or a plastic cup to a full bottle; and what hands and tables are of.
constexpr double kLeastDensity = 100.0, kMostDensity = 1200.0;
constexpr double kLeastFriction = 0.2, kMostFriction = 0.9;
constexpr SearchOptions kSettleSearch = {.refine = {.steps = 10, .first_gate = 0.03}, .polish_candidates = 1};

/// Rows x, y, up.
Matrix3d upright(const Vector3d& up) {
  const Vector3d helper = std::abs(up.x()) < 0.7 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d y = up.cross(helper).normalized();
  Matrix3d R;
  R << y.cross(up).transpose(), y.transpose(), up.transpose();
  return R;
}

/// Ends of the middle share of the values, widened to what they would be of values that lie evenly.
std::array<double, 2> trimmed_ends(std::vector<double>& values) {
  const auto at = [&](double share) {
    const auto place = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  const double low = at(kTrimmed), high = at(1.0 - kTrimmed);
  const double widening = kTrimmed / (1.0 - 2.0 * kTrimmed) * (high - low);
  return {low - widening, high + widening};
}

/// Points of a cluster without those that fly between two surfaces.
std::vector<Vector3d> solid_points(const SampledDepth& sampled, const Cluster& cluster, const Pose& X_WC) {
  const int width = sampled.camera.width, height = sampled.camera.height;
  std::vector<Vector3d> points;
  for (const int i : cluster.pixels) {
    const int x = i % width, y = i / width;
    int same = 0;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const int u = x + dx, v = y + dy;
        if ((dx == 0 && dy == 0) || u < 0 || v < 0 || u >= width || v >= height) continue;
        const float z = sampled.depth(u, v);
        same += z > 0.0f && std::abs(z - sampled.depth(x, y)) < kSameSurface;
      }
    if (same >= kFewestNeighbours) points.push_back(X_WC * sampled.points_C[static_cast<std::size_t>(i)]);
  }
  return points;
}

bool ends_in_image(const SampledDepth& sampled, const Cluster& cluster) {
  const int width = sampled.camera.width, height = sampled.camera.height;
  return std::none_of(cluster.pixels.begin(), cluster.pixels.end(), [&](int i) {
    return i % width == 0 || i % width == width - 1 || i / width == 0 || i / width == height - 1;
  });
}

/// How far below `p_W` the nearest support is, if it is within `reach`.
std::optional<double> support_below(const SupportSurfaces& supports, const Vector3d& p_W, const Vector3d& up_W,
                                    double reach) {
  if (!supports.crosses(p_W, p_W - reach * up_W)) return std::nullopt;
  double above = 0.0, below = reach;
  for (int i = 0; i < 14; ++i) {
    const double middle = 0.5 * (above + below);
    (supports.crosses(p_W, p_W - middle * up_W) ? below : above) = middle;
  }
  return below;
}

UnknownShape shape_about(const SeenShape& shape, bool round) {
  const Vector3d& s = shape.size;
  if (round) return geometry::Cylinder{0.25 * (s.x() + s.y()), s.z()};
  return geometry::BoxShape{s};
}

/// Share of the points that lie in or about the bounding box of something known. `scene`: that of the belief to be.
double share_near_known(std::span<const Vector3d> points_W, const belief::Belief& belief, const belief::Scene& scene,
                        MeshCache& meshes) {
  std::size_t near = 0;
  std::vector<std::pair<Pose, geometry::Box>> boxes;
  for (const ObjectBelief& object : belief.objects) {
    if (object.state == belief::TrackState::kLost) continue;
    const belief::ObjectModel& model = scene.models[static_cast<std::size_t>(object.model)];
    const rendering::MeshHandle mesh = meshes.get(model.visual, model.collision, MeshDetail::kLikelihood);
    geometry::Box box;
    for (const auto& vertex : mesh->vertices) box.extend(vertex.cast<double>());
    box.extend((box.max().array() + kNearKnown).matrix());
    box.extend((box.min().array() - kNearKnown).matrix());
    boxes.emplace_back(belief::heaviest(object.particles).X_WO.inverse(), box);
  }
  for (const Vector3d& p : points_W)
    near +=
        std::any_of(boxes.begin(), boxes.end(), [&](const auto& one) { return one.second.contains(one.first * p); });
  return static_cast<double>(near) / static_cast<double>(std::max<std::size_t>(1, points_W.size()));
}

struct NewThing {
  belief::ObjectModel model;
  PoseCandidate pose;
};

/// The better of a box and an upright cylinder, if either explains the frame.
std::optional<NewThing> explained_by(const SeenShape& shape, const rendering::FrameTerms& terms,
                                     const FilterFrame& frame, const AugmentOptions& options, const FilterTools& tools,
                                     const core::RandomStream& stream) {
  std::optional<NewThing> best;
  for (const bool round : {false, true}) {
    auto model = unknown_object_model(shape_about(shape, round));
    if (!model.ok()) continue;
    const SearchTarget target = target_of(*model, frame, tools);
    const Pose starts[] = {frame.X_CW * shape.X_WO};
    PoseCandidate found = tools.search->run(terms, target, starts, kSettleSearch, stream).front();
    const rendering::PoseEvidence& e = found.evidence;
    if (e.log_ratio < options.unknown_log_ratio || e.hit_share() < kUnknownHits) continue;
    if (!best || e.log_ratio > best->pose.evidence.log_ratio) best = NewThing{*std::move(model), std::move(found)};
  }
  return best;
}

}  // namespace

bool is_unknown_object(const std::string& name) { return name.starts_with(kUnknownObject); }

core::Result<belief::ObjectModel> unknown_object_model(const UnknownShape& shape) {
  belief::ObjectModel model;
  double volume = 0.0;
  if (const auto* cylinder = std::get_if<geometry::Cylinder>(&shape)) {
    model.collision.push_back(belief::PrimitiveShape{*cylinder, Pose::identity()});
    model.symmetry = geometry::SymmetryGroup::continuous(Vector3d::UnitZ(), true);
    volume = std::numbers::pi * cylinder->radius * cylinder->radius * cylinder->length;
  } else {
    const auto& box = std::get<geometry::BoxShape>(shape);
    model.collision.push_back(belief::PrimitiveShape{box, Pose::identity()});
    model.symmetry = geometry::SymmetryGroup::cuboid();
    volume = box.size.prod();
  }
  model.mass = belief::UniformScalar{kLeastDensity * volume, kMostDensity * volume};
  model.contact.friction = belief::UniformScalar{kLeastFriction, kMostFriction};
  return belief::with_derived_properties(std::move(model));
}

std::optional<SeenShape> box_about(std::span<const Vector3d> points_W, const Vector3d& up_W, double base) {
  if (points_W.size() < kFewestPoints) return std::nullopt;
  const Matrix3d R_UW = upright(up_W);
  std::vector<Vector3d> points;
  for (const Vector3d& p : points_W) points.emplace_back(R_UW * p);
  std::vector<double> values(points.size());
  const auto ends = [&](const Vector3d& direction) {
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = direction.dot(points[i]);
    return trimmed_ends(values);
  };
  double least = 0.0, angle = 0.0;
  std::array<double, 2> x_ends{}, y_ends{};
  for (int i = 0; i < kDirections; ++i) {
    const double a = 0.5 * std::numbers::pi * i / kDirections;
    const auto x = ends({std::cos(a), std::sin(a), 0.0}), y = ends({-std::sin(a), std::cos(a), 0.0});
    const double area = (x[1] - x[0]) * (y[1] - y[0]);
    if (i > 0 && area >= least) continue;
    least = area, angle = a, x_ends = x, y_ends = y;
  }
  const double top = ends(Vector3d::UnitZ())[1];
  SeenShape shape;
  shape.size = Vector3d(x_ends[1] - x_ends[0], y_ends[1] - y_ends[0], top - base).cwiseMax(kLeastEdge);
  Matrix3d R_UO = Matrix3d::Identity();
  R_UO.col(0) = Vector3d(std::cos(angle), std::sin(angle), 0.0);
  R_UO.col(1) = Vector3d(-std::sin(angle), std::cos(angle), 0.0);
  const Vector3d middle(0.5 * (x_ends[0] + x_ends[1]), 0.5 * (y_ends[0] + y_ends[1]), base + 0.5 * shape.size.z());
  shape.X_WO.rotation = geometry::Quaterniond(Matrix3d(R_UW.transpose() * R_UO)).normalized();
  shape.X_WO.translation =
      R_UW.transpose() * (R_UO * middle.cwiseProduct(Vector3d(1, 1, 0)) + middle.z() * Vector3d::UnitZ());
  return shape;
}

int add_unknown_objects(const FilterFrame& frame, const belief::Observation& observation,
                        const geometry::DepthImage& known, const AugmentOptions& options,
                        const InitialiseOptions& spread, const FilterTools& tools, const core::RandomStream& stream,
                        belief::Belief& belief) {
  const SegmentationOptions& segmentation = options.detection.segmentation;
  const SampledDepth sampled = sample_depth(*observation.frame.depth, observation.frame.camera, segmentation);
  const Surroundings surroundings = surroundings_in(frame, sampled, *belief.scene, {}, segmentation, stream);
  auto mask = explained_pixels(sampled, known, frame.terms.camera, kExplainedPixels);
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (surroundings.background.data()[i] != 0 || surroundings.over_support.data()[i] == kNoSupport) mask.data()[i] = 1;
  rendering::FrameTerms terms;
  with_known_surfaces(frame.terms, known, &terms);
  const Vector3d& up_W = surroundings.up_W;
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  int added = 0;
  for (const Cluster& cluster : find_clusters(sampled, mask, segmentation)) {
    if (!ends_in_image(sampled, cluster)) continue;
    const std::vector<Vector3d> points_W = solid_points(sampled, cluster, frame.X_WC);
    if (points_W.size() < kFewestPoints || share_near_known(points_W, belief, *scene, *tools.meshes) > kMostNearKnown)
      continue;
    const auto lowest = std::min_element(points_W.begin(), points_W.end(), [&](const Vector3d& a, const Vector3d& b) {
      return up_W.dot(a) < up_W.dot(b);
    });
    const auto drop = support_below(surroundings.solid, *lowest, up_W, segmentation.max_height);
    if (!drop) continue;
    const auto shape = box_about(points_W, up_W, up_W.dot(*lowest) - *drop);
    if (!shape || shape->size.maxCoeff() > options.unknown_largest || shape->size.z() < options.unknown_lowest)
      continue;
    auto thing =
        explained_by(*shape, terms, frame, options, tools, stream.at(belief.step, static_cast<std::uint32_t>(added)));
    if (!thing) continue;
    int number = 1;
    std::string name;
    do name = kUnknownObject + std::to_string(number++);
    while (belief::find_object(*scene, name) || belief::find_support(*scene, name) ||
           belief::find_robot_body(*scene, name));
    thing->model.name = name;
    scene->models.push_back(std::move(thing->model));
    append_object(name, static_cast<int>(scene->models.size()) - 1, frame.X_WC * thing->pose.X_CO, thing->pose.evidence,
                  frame.stamp_ns, spread, stream, *scene, belief);
    belief.objects.back().existence = kUnknownExistence;
    ++added;
  }
  if (added > 0) belief.scene = std::move(scene);
  return added;
}

namespace {

/// What is kept by the number of an object: of those behind the one that is gone the number is another now, so that
/// runs of theirs could not be repeated.
void forget_motion_of(std::size_t gone, belief::Belief& belief) {
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    auto& episode = belief.objects[i].motion.episode;
    if (!episode) continue;
    if (i >= gone) {
      episode.reset();
    } else if (gone < episode->others.size()) {
      episode->others.erase(episode->others.begin() + static_cast<std::ptrdiff_t>(gone));
    }
  }
}

}  // namespace

int forget_unknown_objects(belief::Belief& belief) {
  const auto is_gone = [](const ObjectBelief& object) {
    return is_unknown_object(object.name) && object.state == belief::TrackState::kLost;
  };
  if (std::none_of(belief.objects.begin(), belief.objects.end(), is_gone)) return 0;
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  int forgotten = 0;
  for (std::size_t i = belief.objects.size(); i-- > 0;) {
    if (!is_gone(belief.objects[i])) continue;
    const int model = belief.objects[i].model;
    const auto at = static_cast<std::ptrdiff_t>(i);
    belief.objects.erase(belief.objects.begin() + at);
    scene->objects.erase(scene->objects.begin() + at);
    forget_motion_of(i, belief);
    ++forgotten;
    // A model that the scene names, or that another object has, stays.
    const bool mine = is_unknown_object(scene->models[static_cast<std::size_t>(model)].name) &&
                      std::none_of(scene->objects.begin(), scene->objects.end(),
                                   [&](const belief::SceneObject& other) { return other.model == model; });
    if (!mine) continue;
    scene->models.erase(scene->models.begin() + model);
    for (belief::SceneObject& other : scene->objects) other.model -= other.model > model ? 1 : 0;
    for (ObjectBelief& other : belief.objects) other.model -= other.model > model ? 1 : 0;
  }
  belief.scene = std::move(scene);
  return forgotten;
}

}  // namespace prescene::filter
