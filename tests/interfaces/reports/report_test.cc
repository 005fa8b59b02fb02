// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/reports/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>

#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/reports/overlay.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using geometry::ColorImage;
using geometry::Rgb;
using testing::HasSubstr;
using testing::Not;

/// Names every tag that is not closed in order, and every attribute without quotes, of a page written as XML.
std::string markup_problem(const std::string& page) {
  std::vector<std::string> open;
  for (std::size_t at = page.find('<'); at != std::string::npos; at = page.find('<', at)) {
    const std::size_t end = page.find('>', at);
    if (end == std::string::npos) return "a tag without an end at " + page.substr(at, 40);
    std::string tag = page.substr(at + 1, end - at - 1);
    at = end;
    if (tag.starts_with("!DOCTYPE")) continue;
    if (std::count(tag.begin(), tag.end(), '"') % 2 != 0) return "unpaired quotes in <" + tag;
    const std::string name = tag.substr(0, tag.find_first_of(" /", 1));
    if (tag.starts_with('/')) {
      if (open.empty() || "/" + open.back() != tag)
        return "<" + tag + "> closes " + (open.empty() ? "nothing" : open.back());
      open.pop_back();
    } else if (!tag.ends_with('/')) {
      open.push_back(name);
    }
  }
  return open.empty() ? "" : "never closed: " + open.back();
}

std::vector<std::uint8_t> from_base64(const std::string& text) {
  std::vector<std::uint8_t> bytes;
  std::uint32_t word = 0;
  int bits = 0;
  for (const char c : text) {
    int digit = -1;
    if (c >= 'A' && c <= 'Z') digit = c - 'A';
    if (c >= 'a' && c <= 'z') digit = c - 'a' + 26;
    if (c >= '0' && c <= '9') digit = c - '0' + 52;
    if (c == '+') digit = 62;
    if (c == '/') digit = 63;
    if (digit < 0) break;
    word = word << 6 | static_cast<std::uint32_t>(digit);
    bits += 6;
    if (bits >= 8) {
      bits -= 8;
      bytes.push_back(static_cast<std::uint8_t>(word >> bits & 255u));
    }
  }
  return bytes;
}

/// The pictures of a page, decoded.
std::vector<ColorImage> pictures_of(const std::string& page) {
  static const std::string kPrefix = "data:image/png;base64,";
  std::vector<ColorImage> pictures;
  for (std::size_t at = page.find(kPrefix); at != std::string::npos; at = page.find(kPrefix, at)) {
    at += kPrefix.size();
    const std::vector<std::uint8_t> bytes = from_base64(page.substr(at, page.find('"', at) - at));
    auto picture = decode_png_color(bytes);
    if (!picture) {
      ADD_FAILURE() << core::to_string(picture.status());
      continue;
    }
    pictures.push_back(*std::move(picture));
  }
  return pictures;
}

ColorImage gradient(int width, int height) {
  ColorImage image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image(x, y) = {static_cast<std::uint8_t>(x * 7), static_cast<std::uint8_t>(y * 11), 128};
  return image;
}

belief::HeatMap small_map() {
  belief::HeatMap map;
  map.x0 = -0.1;
  map.y0 = 0.3;
  map.nx = 5;
  map.ny = 4;
  map.mass.assign(20, 0.0);
  map.mass[7] = 0.75;
  map.mass[8] = 0.25;
  return map;
}

/// One block of every kind; every text is `text`.
ReportContents everything(const std::string& text) {
  ReportContents contents;
  contents.title = contents.subtitle = text;
  contents.facts = {{text, text}};
  ReportSection section;
  section.title = text;
  section.blocks.push_back(TextBlock{text});
  section.blocks.push_back(PictureBlock{{{text, gradient(9, 6), true}, {text, gradient(16, 4), false}}});
  section.blocks.push_back(OutcomeBlock{text, {{text, text, 0.623, 0.598, 0.649}, {text, "", 0.0, 0.0, 0.04}}});
  section.blocks.push_back(TableBlock{text, {text, "mm"}, {{text, "1.5"}, {text}}});
  section.blocks.push_back(ChartBlock{text, text, text, {{text, {{0.0, 1.0}, {1.0, 3.0}, {2.0, 2.0}}}}, true});
  section.blocks.push_back(TimelineBlock{
      text,
      {{belief::Relation::kInside, text, text, 0.5, 1.5}, {belief::Relation::kMoving, text, "", 0.0, 1.0}},
      0.0,
      2.0});
  section.blocks.push_back(LinkBlock{text, text});
  section.blocks.push_back(HeatMapBlock{text, small_map(), {{text, {{0.0, 0.3}, {0.1, 0.3}, {0.1, 0.4}}}}});
  contents.sections.push_back(section);
  return contents;
}

TEST(Report, IsWellFormedAndSelfContained) {
  const std::string page = report_html(everything("carton"));
  EXPECT_EQ(markup_problem(page), "");
  EXPECT_THAT(page, HasSubstr("62.3 %"));
  EXPECT_THAT(page, HasSubstr("59.8 – 64.9 %"));
  // Nothing is loaded: the only address is the name of SVG's namespace.
  std::string rest = page;
  for (std::size_t at; (at = rest.find("http://www.w3.org/2000/svg")) != std::string::npos;) rest.erase(at, 26);
  EXPECT_THAT(rest, Not(HasSubstr("http://")));
  EXPECT_THAT(rest, Not(HasSubstr("https://")));
  EXPECT_THAT(rest, Not(HasSubstr("<script")));
  EXPECT_THAT(rest, Not(HasSubstr("<link")));
}

TEST(Report, PicturesComeBackAsTheyWentIn) {
  const std::vector<ColorImage> pictures = pictures_of(report_html(everything("carton")));
  ASSERT_EQ(pictures.size(), 3u);
  EXPECT_EQ(pictures[0], gradient(9, 6));
  EXPECT_EQ(pictures[1], gradient(16, 4));
  EXPECT_EQ(pictures[2], heat_map_picture(small_map()));
}

TEST(Report, EveryTextIsEscaped) {
  const std::string nasty = "</title><script>alert(\"1\")</script> & 'x' onload=\"y\"";
  const std::string page = report_html(everything(nasty));
  EXPECT_EQ(markup_problem(page), "");
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("onload=\"")));
  EXPECT_THAT(page, Not(HasSubstr("& 'x'")));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;alert(&quot;1&quot;)&lt;/script&gt; &amp; &#39;x&#39;"));
}

TEST(Report, BytesThatAreNoTextAreReplaced) {
  ReportContents contents;
  contents.title = std::string(
                       "a\x01"
                       "b\x1b[31m\xff\xc3(\xed\xa0\x80\xf5 gr\xc3\xbc\xc3\x9f \xf0\x9f\xa5\x9b") +
                   '\0' + "end";
  const std::string page = report_html(contents);
  EXPECT_THAT(page, HasSubstr("ab[31m\xef\xbf\xbd\xef\xbf\xbd(\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd "
                              "gr\xc3\xbc\xc3\x9f \xf0\x9f\xa5\x9b"
                              "end"));
  EXPECT_EQ(page.find('\0'), std::string::npos);
  EXPECT_EQ(page.find('\x1b'), std::string::npos);
}

TEST(Report, ValuesThatAreNoNumbersDoNoHarm) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  ReportContents contents;
  ReportSection section;
  section.blocks.push_back(OutcomeBlock{"", {{"o", "", nan, -inf, inf}}});
  section.blocks.push_back(ChartBlock{"", "", "", {{"c", {{0.0, nan}, {inf, 1.0}}}, {"d", {}}}, false});
  section.blocks.push_back(ChartBlock{"", "", "", {{"c", {{2.0, 5.0}}}}, false});
  section.blocks.push_back(TimelineBlock{"", {{belief::Relation::kMoving, "a", "", 3.0, 3.0}}});
  section.blocks.push_back(TimelineBlock{});
  section.blocks.push_back(HeatMapBlock{});
  section.blocks.push_back(PictureBlock{{{"none", ColorImage{}}}});
  section.blocks.push_back(TableBlock{});
  section.blocks.push_back(TextBlock{});
  contents.sections.push_back(section);
  const std::string page = report_html(contents);
  EXPECT_EQ(markup_problem(page), "");
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  EXPECT_THAT(page, Not(HasSubstr("inf")));
}

TEST(Report, ACurveHasAGapWhereThereIsNoValue) {
  ReportContents contents;
  contents.sections.push_back(
      {"",
       {ChartBlock{
           "", "t, s", "error, mm", {{"c", {{0.0, 1.0}, {1.0, 1.0}, {2.0, std::nan("")}, {3.0, 1.0}, {4.0, 1.0}}}}}}});
  const std::string page = report_html(contents);
  const std::size_t begin = page.find("<path d=\"") + 9;
  const std::string path = page.substr(begin, page.find('"', begin) - begin);
  EXPECT_EQ(std::count(path.begin(), path.end(), 'M'), 2);
  EXPECT_EQ(std::count(path.begin(), path.end(), 'L'), 2);
  EXPECT_THAT(page, HasSubstr("error, mm"));
}

TEST(Report, AFileIsWrittenWholeOrNotAtAll) {
  tests::ScratchDir scratch;
  const std::filesystem::path path = scratch.path() / "report.html";
  ASSERT_TRUE(write_report(path, everything("carton")).ok());
  std::ifstream file(path, std::ios::binary);
  const std::string read{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(read, report_html(everything("carton")));
  const core::Status status = write_report(scratch.path() / "none" / "report.html", {});
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(status.message(), HasSubstr("none"));
}

TEST(Report, ASectionIsAddedAsIfItHadBeenThere) {
  const tests::ScratchDir scratch;
  const std::filesystem::path path = scratch.path() / "report.html";
  ReportContents contents = everything("carton");
  ASSERT_TRUE(write_report(path, contents).ok());
  const ReportSection section{"Asked <beside> it", {TextBlock{"where?"}, LinkBlock{"Here & there.", "achieve.html"}}};
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(add_section(path, section).ok());
    contents.sections.push_back(section);
    std::ifstream file(path, std::ios::binary);
    const std::string read{std::istreambuf_iterator<char>(file), {}};
    EXPECT_EQ(read, report_html(contents));
    EXPECT_THAT(read, HasSubstr("<p>Here &amp; there. <a href=\"./achieve.html\">achieve.html</a></p>"));
  }
  EXPECT_EQ(add_section(scratch.path() / "none.html", section).code(), core::StatusCode::kNotFound);
  std::ofstream(scratch.path() / "other.html") << "<html></html>\n";
  const core::Status other = add_section(scratch.path() / "other.html", section);
  EXPECT_EQ(other.code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(other.message(), HasSubstr("other.html: it does not end as a report"));
}

TEST(Report, ALinkLeadsToAFileBesideThePage) {
  ReportContents contents;
  contents.sections.push_back({"", {LinkBlock{"", "javascript:alert(1)"}, LinkBlock{"", "a#b?c\"d%.html"}}});
  const std::string page = report_html(contents);
  EXPECT_THAT(page, HasSubstr("href=\"./javascript%3Aalert%281%29\""));
  EXPECT_THAT(page, HasSubstr("href=\"./a%23b%3Fc%22d%25.html\""));
}

std::shared_ptr<belief::Scene> bin_scene() {
  auto scene = std::make_shared<belief::Scene>();
  belief::Support bin;
  bin.name = "bin";
  bin.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{{0.2, 0.3, 0.1}}, {}});
  bin.X_WS = geometry::Pose::from_translation({1.0, 0.0, 0.05});
  bin.hollow = belief::Hollow{{}, {0.18, 0.28, 0.1}};
  scene->supports.push_back(bin);
  return scene;
}

TEST(SupportOutlines, AreWhatSupportsCoverAndTheirHollows) {
  const auto outlines = support_outlines(*bin_scene());
  ASSERT_EQ(outlines.size(), 2u);
  EXPECT_EQ(outlines[0].name, "bin");
  const auto area = [](const HeatMapBlock::Outline& outline) {
    double sum = 0.0;
    for (std::size_t i = 0; i < outline.corners.size(); ++i) {
      const Eigen::Vector2d& a = outline.corners[i];
      const Eigen::Vector2d& b = outline.corners[(i + 1) % outline.corners.size()];
      sum += 0.5 * (a.x() * b.y() - b.x() * a.y());
    }
    return sum;
  };
  EXPECT_EQ(outlines[0].corners.size(), 4u);
  EXPECT_NEAR(area(outlines[0]), 0.06, 1e-12);
  EXPECT_NEAR(area(outlines[1]), 0.18 * 0.28, 1e-12);
}

TEST(AnswerSections, ShowEveryKindOfAnswer) {
  const auto scene = bin_scene();
  const auto page_of = [&](const belief::Answer& answer) {
    ReportContents contents;
    contents.sections = answer_sections(answer, *scene);
    const std::string page = report_html(contents);
    EXPECT_EQ(markup_problem(page), "");
    return page;
  };
  belief::PredictAnswer predict;
  predict.outcomes = {{"in_bin", "where", 0.6, 0.57, 0.63}};
  belief::FinalPoses poses;
  poses.object = "carton";
  poses.heat_map = small_map();
  poses.components.push_back({1.0, "in_bin", {}, geometry::Matrix6d::Identity()});
  predict.final_poses.push_back(poses);
  belief::TypicalRun run;
  run.outcome = "in_bin";
  run.share = 0.6;
  run.timeline = {{belief::Relation::kFalling, "carton", "", 0.1, 0.4}};
  predict.typical_runs.push_back(run);
  predict.instances = 384;
  predict.step = 0.004;
  predict.simulated_seconds = 768.0;
  predict.remarks = {"The intervals are wider than asked for."};
  predict.history = {{64, {{0.5, 0.4, 0.6}}}, {384, {{0.6, 0.57, 0.63}}}};
  predict.inputs = {{"where", {{"carton: position x", 0.4, 0.05, {{"in_bin", 0.9, 0.2}}}}, 0.4, std::nullopt}};
  predict.contact_times = {0.0, 1.0};
  predict.contacts = {{"carton", "bin", 0.8, 0.75, 0.85, {0.1, 0.2, 0.3}, {0.25, 0.5, 0.875}, {0.0, 0.8}}};
  predict.chaos = {{"where", 64, 0.1, 0.5, 0.4, 0.6, true}};
  predict.model_error = belief::ModelError{
      256, {{belief::ModelError::Kind::kStep, "half the step", {{"in_bin", "where", 0.031, 0.01, 0.052}}}}};
  belief::Answer answer;
  answer.what = predict;
  const std::string predicted = page_of(answer);
  for (const char* shown :
       {"in_bin", "60.0 %", "384 simulated instances", "Where carton ends", "carton falls", "wider than asked",
        "192000 steps of 4.00 ms", "probability against instances", "carton: position x", "40.0 % \u00b1 5.0",
        "carton and bin", "0.25 to 0.88", "half the step", "own error, which the intervals do not contain",
        "384 instances are too few", "3.1 (1.0 to 5.2)", "Every instance ran to rest"})
    EXPECT_THAT(predicted, HasSubstr(shown));

  belief::StabilityAnswer stability;
  stability.object = "cup";
  stability.stable = {"stable", "", 0.25, 0.2, 0.3};
  stability.likely_event = "tips over";
  stability.remarks = {"3 of 64 instances failed"};
  answer.what = stability;
  EXPECT_THAT(page_of(answer), HasSubstr("3 of 64 instances failed"));
  EXPECT_THAT(page_of(answer), HasSubstr("it typically tips over."));

  belief::WhereAnswer where;
  where.items.push_back({"cup", "mug", {}, belief::TrackState::kDoubtful, 0.9});
  answer.what = where;
  EXPECT_THAT(page_of(answer), HasSubstr("doubtful"));

  belief::ViewAnswer view;
  view.depth = geometry::DepthImage(4, 3, 1.0f);
  view.labels = geometry::LabelImage(4, 3, 1);
  view.presence = geometry::Image<float>(4, 3, 0.5f);
  view.label_names = {"cup"};
  answer.what = view;
  EXPECT_EQ(pictures_of(page_of(answer)).size(), 2u);

  answer.error = core::not_found("there is no object 'mug'");
  EXPECT_THAT(page_of(answer), HasSubstr("there is no object &#39;mug&#39;"));
}

}  // namespace
}  // namespace prescene::interfaces
