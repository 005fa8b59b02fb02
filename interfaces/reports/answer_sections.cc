// SPDX-License-Identifier: Apache-2.0
// Answers as sections of a report.
#include <algorithm>
#include <cmath>

#include "achieve_sections.h"
#include "html_text.h"
#include "prediction_sections.h"
#include "prescene/geometry/polygon.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/interfaces/reports/overlay.h"
#include "prescene/interfaces/reports/report.h"

namespace prescene::interfaces {
namespace {

std::vector<ReportSection> sections_of(const belief::PredictAnswer& answer, const belief::Scene& scene) {
  return prediction_sections(answer, scene);
}

std::vector<ReportSection> sections_of(const belief::WhereAnswer& answer, const belief::Scene&) {
  TableBlock table;
  table.columns = {"object",         "state",         "moves",  "x, y, z (m)",
                   "deviation (mm)", "deviation (°)", "exists", "confidence"};
  for (const belief::WhereAnswer::Item& item : answer.items) {
    const geometry::Matrix6d& P = item.estimate.covariance;
    table.rows.push_back({item.object, belief::to_string(item.state), belief::to_string(item.estimate.motion),
                          position_text(item.estimate.mean.translation),
                          in_millimetres(std::sqrt(P.bottomRightCorner<3, 3>().trace())),
                          in_degrees(std::sqrt(P.topLeftCorner<3, 3>().trace())), percent(item.existence),
                          percent(item.estimate.confidence)});
  }
  ReportSection section{"Where everything is", {std::move(table)}};
  std::string elsewhere;
  for (const belief::WhereAnswer::Item& item : answer.items)
    for (const belief::AlternativePose& other : item.alternatives)
      elsewhere +=
          (elsewhere.empty() ? "It may be otherwise: " : "; ") + item.object + " at " +
          position_text(other.X_WO.translation) + " m, turned by " +
          in_degrees(geometry::log_rotation(item.estimate.mean.rotation.conjugate() * other.X_WO.rotation).norm()) +
          "°, with " + percent(other.probability);
  if (!elsewhere.empty()) section.blocks.push_back(TextBlock{elsewhere + "."});
  return {std::move(section)};
}

std::vector<ReportSection> sections_of(const belief::StabilityAnswer& answer, const belief::Scene&) {
  ReportSection section{"Does " + answer.object + " stay?", {OutcomeBlock{"", {answer.stable}}}};
  std::string text = "From " + std::to_string(answer.instances) +
                     (answer.instances == 1 ? " simulated instance, " : " simulated instances, ") +
                     decimal(answer.simulated_seconds, 0) + " simulated seconds in " + decimal(answer.wall_seconds, 1) +
                     " s.";
  if (!answer.likely_event.empty()) text += " When it does not stay, it typically " + answer.likely_event + ".";
  section.blocks.push_back(TextBlock{std::move(text)});
  if (answer.margin) {
    const geometry::Vector3d& d = answer.margin->weakest_W;
    std::string margin =
        "It falls most easily along (" + decimal(d.x(), 2) + " " + decimal(d.y(), 2) + " " + decimal(d.z(), 2) + "):";
    for (const belief::FallImpulse& fall : answer.margin->falls)
      margin +=
          " in " + percent(fall.share) +
          (fall.impulse ? " of instances at " + decimal(*fall.impulse, 3) + " N s." : " of instances at none tried.");
    section.blocks.push_back(TextBlock{std::move(margin)});
  }
  if (answer.removal) {
    OutcomeBlock block{"Where it is taken away", {answer.removal->others_stay}};
    for (const belief::OutcomeProbability& other : answer.removal->moves) block.outcomes.push_back(other);
    for (std::size_t i = 1; i < block.outcomes.size(); ++i) block.outcomes[i].name += " moves";
    section.blocks.push_back(std::move(block));
  }
  for (const std::string& remark : answer.remarks) section.blocks.push_back(TextBlock{remark});
  return {std::move(section)};
}

std::vector<ReportSection> sections_of(const belief::ViewAnswer& answer, const belief::Scene&) {
  PictureBlock pictures;
  float near_depth = 1e9f, far_depth = 0.0f;
  for (int y = 0; y < answer.depth.height(); ++y) {
    for (int x = 0; x < answer.depth.width(); ++x) {
      const float z = answer.depth(x, y);
      if (!(z > 0.0f)) continue;
      near_depth = std::min(near_depth, z);
      far_depth = std::max(far_depth, z);
    }
  }
  geometry::ColorImage depth = depth_picture(answer.depth, near_depth, far_depth);
  std::vector<std::optional<geometry::Rgb>> colors;
  for (std::size_t i = 0; i < answer.label_names.size(); ++i) colors.emplace_back(series_color(i));
  geometry::ColorImage labelled = depth;
  draw_outlines(answer.labels, colors, 2, labelled);
  geometry::ColorImage presence = depth;
  // Darker, so that light colours stand out.
  for (int y = 0; y < presence.height(); ++y)
    for (int x = 0; x < presence.width(); ++x)
      for (std::uint8_t& channel : presence(x, y)) channel = static_cast<std::uint8_t>(channel / 2);
  tint(answer.presence, 0.9, presence);
  pictures.pictures.push_back({"The likeliest depth image, with outlines", std::move(labelled)});
  pictures.pictures.push_back({"Probability that an object is seen at a pixel", std::move(presence)});
  ReportSection section{"What the camera will see", {std::move(pictures)}};
  for (const std::string& remark : answer.remarks) section.blocks.push_back(TextBlock{remark});
  return {std::move(section)};
}

std::vector<ReportSection> sections_of(const belief::AchieveAnswer& answer, const belief::Scene&) {
  return achieve_sections(answer);
}

std::vector<ReportSection> sections_of(const belief::RelationsAnswer& answer, const belief::Scene&) {
  TableBlock table;
  table.columns = {"relation", "of", "and", "probability", "low", "high"};
  for (const belief::RelationProbability& one : answer.relations)
    table.rows.push_back({belief::to_string(one.relation), one.subject, one.other, decimal(one.probability, 3),
                          decimal(one.low, 3), decimal(one.high, 3)});
  ReportSection section{"How things are related", {std::move(table)}};
  for (const std::string& remark : answer.remarks) section.blocks.push_back(TextBlock{remark});
  return {std::move(section)};
}

std::vector<ReportSection> sections_of(const belief::NextViewAnswer& answer, const belief::Scene&) {
  TableBlock table;
  table.caption = "expected reduction of the entropy, nats, of " + decimal(answer.entropy, 3) + " now";
  table.columns = {"candidate", "reduction", "low", "high"};
  for (const belief::NextViewAnswer::View& view : answer.views)
    table.rows.push_back({view.name.empty() ? std::to_string(view.index + 1) : view.name, decimal(view.reduction, 3),
                          decimal(view.low, 3), decimal(view.high, 3)});
  ReportSection section{"Where to look next", {std::move(table)}};
  for (const std::string& remark : answer.remarks) section.blocks.push_back(TextBlock{remark});
  return {std::move(section)};
}

std::vector<ReportSection> sections_of(const belief::TimelineAnswer& answer, const belief::Scene&) {
  const belief::ObservedTimeline& timeline = answer.timeline;
  const auto since_first = [&](core::TimeNs stamp_ns) {
    return decimal(core::seconds_of(stamp_ns - timeline.session_ns), 2);
  };
  TableBlock table;
  table.columns = {"relation", "of", "and", "from (s)", "to (s)", "probability"};
  for (const belief::ObservedInterval& one : timeline.intervals)
    table.rows.push_back({belief::to_string(one.relation), one.subject, one.other, since_first(one.begin_ns),
                          one.goes_on ? "goes on" : since_first(one.end_ns), decimal(one.probability, 3)});
  ReportSection section{"What was observed", {std::move(table)}};
  if (answer.of_pairs) {
    TableBlock pairs;
    pairs.caption = "pairs of these, by the numbers of their rows";
    pairs.columns = {"first", "is", "second", "probability"};
    for (const belief::TimelineAnswer::Pair& pair : answer.pairs)
      pairs.rows.push_back({std::to_string(pair.first + 1), belief::to_string(pair.relation),
                            std::to_string(pair.second + 1), decimal(pair.probability, 3)});
    section.blocks.emplace_back(std::move(pairs));
  }
  return {std::move(section)};
}

std::vector<ReportSection> sections_of(const std::monostate&, const belief::Scene&) { return {}; }

}  // namespace

std::vector<HeatMapBlock::Outline> support_outlines(const belief::Scene& scene) {
  std::vector<HeatMapBlock::Outline> outlines;
  for (const belief::Support& support : scene.supports) {
    // Shape by shape and part by part, so that separate walls are seen as walls.
    for (const belief::CollisionShape& shape : support.collision) {
      for (const geometry::TriangleMesh& part : geometry::connected_components(belief::collision_mesh({shape}))) {
        std::vector<geometry::Vector2d> points;
        for (const geometry::Vector3d& p_SQ : part.vertices) {
          const geometry::Vector3d p_WQ = support.X_WS * p_SQ;
          points.push_back(p_WQ.head<2>());
        }
        outlines.push_back({support.name, geometry::convex_polygon(std::move(points))});
      }
    }
    if (!support.hollow) continue;
    std::vector<geometry::Vector2d> corners;
    for (int i = 0; i < 8; ++i) {
      const geometry::Vector3d sign(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0);
      const geometry::Vector3d p_WQ =
          support.X_WS * (support.hollow->X_OV * geometry::Vector3d(0.5 * sign.cwiseProduct(support.hollow->size)));
      corners.push_back(p_WQ.head<2>());
    }
    outlines.push_back({support.name + " (inside)", geometry::convex_polygon(std::move(corners))});
  }
  return outlines;
}

std::vector<ReportSection> answer_sections(const belief::Answer& answer, const belief::Scene& scene) {
  if (!answer.error.ok()) return {{"No answer", {TextBlock{core::to_string(answer.error)}}}};
  return std::visit([&](const auto& what) { return sections_of(what, scene); }, answer.what);
}

}  // namespace prescene::interfaces
