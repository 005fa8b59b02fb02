// SPDX-License-Identifier: Apache-2.0
// Reports: one self-contained HTML page for people who would rather look. Everything is inside the file: style,
// pictures, drawings; it loads nothing, and runs no script but those of a PageBlock.
//
//   ReportContents report;
//   report.title = "Milk on bin";
//   ReportSection& section = report.sections.emplace_back();
//   section.title = "What happens if the carton is released";
//   section.blocks.push_back(OutcomeBlock{"", answer.outcomes});
//   PRESCENE_RETURN_IF_ERROR(write_report("report.html", report));
//
// The page shows what it is given: pictures come rendered, numbers computed. All text may hold any bytes; it is
// escaped.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "prescene/belief/query.h"
#include "prescene/belief/scene.h"
#include "prescene/core/status.h"
#include "prescene/geometry/image.h"

namespace prescene::interfaces {

/// A few sentences. Empty lines begin a new paragraph.
struct TextBlock {
  std::string text;
};
/// A few sentences and a link to another page in the same folder.
struct LinkBlock {
  std::string text;
  std::string file;  ///< Its name.
};
/// Pictures side by side, where the page is wide enough.
struct PictureBlock {
  struct Picture {
    std::string caption;
    geometry::ColorImage image;
    bool pixelated = false;  ///< Enlarged without smoothing: for small images.
  };
  std::vector<Picture> pictures;
};
/// Probabilities as bars with their intervals.
struct OutcomeBlock {
  std::string caption;
  std::vector<belief::OutcomeProbability> outcomes;
};
/// A table. Cells that are numbers are aligned to the right.
struct TableBlock {
  std::string caption;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  ///< Shorter ones are filled up with nothing.
};
/// Curves over a common x axis. Points that are not finite leave a gap.
struct ChartBlock {
  struct Curve {
    std::string name;
    std::vector<std::pair<double, double>> points;     ///< Ascending x.
    std::vector<std::pair<double, double>> band = {};  ///< Low and high about each point; empty = none.
  };
  std::string caption;
  std::string x_label, y_label;  ///< With their units.
  std::vector<Curve> curves;
  bool from_zero = true;  ///< The y axis includes 0.
};
/// What moves a probability most: for each input a bar from its value where the input is small to where it is large.
struct TornadoBlock {
  struct Row {
    std::string input;
    double small = 0.0, large = 0.0;           ///< Probability in the lowest and highest fifth of the input.
    double share = 0.0, standard_error = 0.0;  ///< Of the variance that it explains alone.
  };
  std::string caption;
  double overall = 0.0;  ///< The probability.
  std::vector<Row> rows;
};
/// Intervals of relations as bars in lanes over time.
struct TimelineBlock {
  std::string caption;
  belief::Timeline timeline;
  double begin = 0.0, end = 0.0;  ///< s; end <= begin: what the intervals cover.
};
/// The state that things are in, as a band over time for each of them.
struct StateBandBlock {
  struct Segment {
    double begin = 0.0, end = 0.0;  ///< s
    std::string state;              ///< One of `states`; what is none is left empty.
  };
  struct Lane {
    std::string name;
    std::vector<Segment> segments;
  };
  std::string caption;
  std::vector<std::string> states;  ///< In the order of their colours.
  std::vector<Lane> lanes;
};
/// Where something ends, seen from above, in metres.
struct HeatMapBlock {
  struct Outline {
    std::string name;
    std::vector<Eigen::Vector2d> corners;  ///< x, y in W, m; closed.
  };
  std::string caption;
  belief::HeatMap map;
  std::vector<Outline> outlines;
};
/// A document that runs by itself, in a frame of its own; an empty one is left out. The report's policy allows the
/// scripts with these hashes (SHA-256 in base64) and no other.
struct PageBlock {
  std::string caption;
  std::string html;
  std::vector<std::string> script_hashes;
};
using ReportBlock = std::variant<TextBlock, PictureBlock, OutcomeBlock, TableBlock, ChartBlock, TornadoBlock,
                                 TimelineBlock, StateBandBlock, HeatMapBlock, LinkBlock, PageBlock>;

struct ReportSection {
  std::string title;
  std::vector<ReportBlock> blocks;
};

struct ReportContents {
  std::string title;
  std::string subtitle;
  /// Name and value, shown at the top: file, seed, instances...
  std::vector<std::pair<std::string, std::string>> facts;
  std::vector<ReportSection> sections;
};

/// The page as text.
std::string report_html(const ReportContents& contents);
/// Writes it; fails with kUnavailable when the file can't be written, and keeps what was there.
core::Status write_report(const std::filesystem::path& path, const ReportContents& contents);
/// Adds a section at the end of a page that write_report() wrote. Errors of read_file(); kInvalidInput for another
/// file; kUnavailable when it can't be written, and keeps what was there. The page's policy stays what it was: scripts
/// of a PageBlock that is added do not run.
core::Status add_section(const std::filesystem::path& path, const ReportSection& section);

/// Sections that show an answer: outcomes, heat maps (with the outlines of the scene's supports), final poses,
/// timelines of typical runs; or positions, stability, the foreseen view. An answer with an error becomes its text.
std::vector<ReportSection> answer_sections(const belief::Answer& answer, const belief::Scene& scene);
/// What the scene's supports cover, seen from above: the convex outline of each of their connected parts, and of
/// hollows.
std::vector<HeatMapBlock::Outline> support_outlines(const belief::Scene& scene);

}  // namespace prescene::interfaces
