// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/reports/report.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <string_view>

#include "charts.h"
#include "html_text.h"
#include "prescene/interfaces/bytes/file.h"

namespace prescene::interfaces {
namespace {

constexpr const char* kStyle = R"css(
:root { --ink: #1c2330; --soft: #5b6576; --paper: #f5f6f8; --card: #ffffff; --line: #dfe3ea; --accent: #2d7dc8;
  --track: #e8ecf2; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ef; --soft: #9aa5b5; --paper: #14181f; --card: #1d232d;
  --line: #323b49; --accent: #5aa7ee; --track: #2b3442; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "DejaVu Sans", sans-serif; }
main { max-width: 980px; margin: 0 auto; padding: 2.2rem 1.2rem 4rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0; letter-spacing: -0.01em; }
h2 { font-size: 1.2rem; margin: 0 0 0.8rem; }
.subtitle { color: var(--soft); margin: 0.3rem 0 0; }
dl.facts { display: grid; grid-template-columns: repeat(auto-fill, minmax(11rem, 1fr)); gap: 0.6rem 1.4rem;
  margin: 1.4rem 0 0; }
dl.facts dt { color: var(--soft); font-size: 0.8rem; }
dl.facts dd { margin: 0; font-weight: 600; overflow-wrap: anywhere; }
section { background: var(--card); border: 1px solid var(--line); border-radius: 10px; padding: 1.3rem 1.4rem;
  margin-top: 1.4rem; }
figure { margin: 0 0 1.2rem; }
section > :last-child { margin-bottom: 0; }
figcaption, caption { color: var(--soft); font-size: 0.88rem; text-align: left; padding: 0.35rem 0; }
.pictures { display: flex; flex-wrap: wrap; gap: 1rem; }
.pictures figure { flex: 1 1 380px; max-width: 100%; }
.pictures img { width: 100%; height: auto; border-radius: 6px; display: block; }
.pixelated { image-rendering: pixelated; }
iframe.page { width: min(96vw, 1600px); margin-left: calc(50% - min(48vw, 800px)); height: min(92vh, 62rem); border: 1px solid var(--line);
  border-radius: 10px; display: block; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; margin: 0 0 1.2rem; font-variant-numeric: tabular-nums; }
th { text-align: left; font-size: 0.8rem; color: var(--soft); font-weight: 600; }
th, td { padding: 0.32rem 0.9rem 0.32rem 0; border-bottom: 1px solid var(--line); vertical-align: middle; }
td.number, th.number { text-align: right; }
tr.group th { padding-top: 0.9rem; color: var(--ink); font-size: 0.95rem; }
a { color: var(--accent); }
svg { max-width: 100%; height: auto; display: block; }
td svg { min-width: 130px; }
svg text { fill: var(--ink); font-size: 12px; font-family: inherit; }
svg .tick { fill: var(--soft); font-size: 11.5px; }
svg .middle { text-anchor: middle; }
svg .end { text-anchor: end; }
svg .grid { stroke: var(--line); stroke-width: 1; }
svg .track { fill: var(--track); }
svg .bar { fill: var(--accent); }
svg .whisker { stroke: var(--ink); stroke-width: 1.5; }
svg .outline { fill: none; stroke: #ffffff; stroke-width: 1.5; stroke-opacity: 0.85; }
footer { color: var(--soft); font-size: 0.82rem; margin-top: 2rem; }
@media print { iframe.page { display: none; } body { background: none; } section { break-inside: avoid; } }
)css";

constexpr std::string_view kEnd = "<footer>Made by Prescene.</footer>\n</main>\n</body>\n</html>\n";
constexpr std::size_t kMostBytes = std::size_t{256} << 20;  // of a page that something is added to

bool looks_like_a_number(const std::string& cell) {
  const bool has_digit = std::any_of(cell.begin(), cell.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  return cell == "–" || (has_digit && cell.find_first_not_of("0123456789.,+-–%± ") == std::string::npos);
}

std::string figure(const std::string& content, const std::string& caption) {
  return "<figure>\n" + content + (caption.empty() ? "" : "<figcaption>" + escaped(caption) + "</figcaption>\n") +
         "</figure>\n";
}

std::string html_of(const TextBlock& block) {
  std::string out;
  for (std::size_t at = 0; at < block.text.size();) {
    const std::size_t end = std::min(block.text.find("\n\n", at), block.text.size());
    if (end > at) out += "<p>" + escaped(std::string_view(block.text).substr(at, end - at)) + "</p>\n";
    at = end + 2;
  }
  return out;
}

/// Whatever the name is, it is that of a file beside the page: neither a scheme nor an anchor.
std::string address_beside(const std::string& file) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  std::string out = "./";
  for (const char c : file) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '.' || c == '-' || c == '_')
      out += c;
    else
      out.append("%").append(1, kDigits[byte / 16]).append(1, kDigits[byte % 16]);
  }
  return out;
}

std::string html_of(const LinkBlock& block) {
  return "<p>" + escaped(block.text) + " <a href=\"" + address_beside(block.file) + "\">" + escaped(block.file) +
         "</a></p>\n";
}

std::string html_of(const PictureBlock& block) {
  std::string out = "<div class=\"pictures\">\n";
  for (const PictureBlock::Picture& picture : block.pictures) {
    if (picture.image.empty()) continue;
    const std::string image = std::string("<img") + (picture.pixelated ? " class=\"pixelated\"" : "") + " alt=\"" +
                              escaped(picture.caption) + "\" width=\"" + std::to_string(picture.image.width()) +
                              "\" height=\"" + std::to_string(picture.image.height()) + "\" src=\"" +
                              png_data_uri(picture.image) + "\"/>\n";
    out += figure(image, picture.caption);
  }
  return out + "</div>\n";
}

std::string html_of(const OutcomeBlock& block) {
  std::string out = "<div class=\"scroll\"><table>\n";
  if (!block.caption.empty()) out += "<caption>" + escaped(block.caption) + "</caption>\n";
  out +=
      "<thead><tr><th>outcome</th><th></th><th class=\"number\">probability</th><th class=\"number\">interval</th></tr>"
      "</thead>\n<tbody>\n";
  const std::string* group = nullptr;
  for (const belief::OutcomeProbability& outcome : block.outcomes) {
    const bool other_group = group == nullptr ? !outcome.group.empty() : *group != outcome.group;
    if (other_group)
      out += "<tr class=\"group\"><th colspan=\"4\">" +
             escaped(outcome.group.empty() ? "each for itself" : outcome.group) + "</th></tr>\n";
    group = &outcome.group;
    out += "<tr><td>" + escaped(outcome.name) + "</td><td>" + probability_bar(outcome) + "</td><td class=\"number\">" +
           percent(outcome.probability) + "</td><td class=\"number\">" + decimal(100.0 * outcome.low, 1) + " – " +
           percent(outcome.high) + "</td></tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string html_of(const TableBlock& block) {
  const auto cell = [](const std::string& text, const char* tag, bool number) {
    return std::string("<") + tag + (number ? " class=\"number\">" : ">") + escaped(text) + "</" + tag + ">";
  };
  std::vector<bool> numeric(block.columns.size(), !block.rows.empty());
  for (const std::vector<std::string>& row : block.rows)
    for (std::size_t c = 0; c < numeric.size() && c < row.size(); ++c)
      numeric[c] = numeric[c] && (row[c].empty() || looks_like_a_number(row[c]));
  std::string out = "<div class=\"scroll\"><table>\n";
  if (!block.caption.empty()) out += "<caption>" + escaped(block.caption) + "</caption>\n";
  out += "<thead><tr>";
  for (std::size_t c = 0; c < block.columns.size(); ++c) out += cell(block.columns[c], "th", numeric[c]);
  out += "</tr></thead>\n<tbody>\n";
  for (const std::vector<std::string>& row : block.rows) {
    out += "<tr>";
    for (std::size_t c = 0; c < block.columns.size(); ++c) out += cell(c < row.size() ? row[c] : "", "td", numeric[c]);
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string html_of(const ChartBlock& block) { return figure(chart_svg(block) + "\n", block.caption); }
std::string html_of(const TornadoBlock& block) {
  return block.rows.empty() ? "" : figure(tornado_svg(block) + "\n", block.caption);
}
std::string html_of(const TimelineBlock& block) {
  if (block.timeline.empty()) return "";
  return figure(timeline_svg(block) + "\n", block.caption);
}
std::string html_of(const StateBandBlock& block) {
  return block.lanes.empty() ? "" : figure(state_band_svg(block) + "\n", block.caption);
}
std::string html_of(const HeatMapBlock& block) { return figure(heat_map_svg(block) + "\n", block.caption); }

/// In an attribute. What is in it is as large as a page can be, so that quotes, of which it is full, stay as they are.
std::string html_of(const PageBlock& block) {
  if (block.html.empty()) return "";
  std::string document;
  document.reserve(block.html.size() + block.html.size() / 16);
  for (const char c : block.html) {
    switch (c) {
      case '&':
        document += "&amp;";
        break;
      case '<':
        document += "&lt;";
        break;
      case '\'':
        document += "&#39;";
        break;
      default:
        document += c;
    }
  }
  return figure("<iframe class=\"page\" title=\"" + escaped(block.caption) + "\" srcdoc='" + document + "'></iframe>\n",
                block.caption);
}

std::string html_of(const ReportSection& section) {
  std::string out = "<section>\n";
  if (!section.title.empty()) out += "<h2>" + escaped(section.title) + "</h2>\n";
  for (const ReportBlock& block : section.blocks)
    out += std::visit([](const auto& one) { return html_of(one); }, block);
  return out + "</section>\n";
}

/// " script-src 'sha256-...';" for those that the pages in the report run; "" where none does.
std::string script_policy(const ReportContents& contents) {
  std::string policy;
  for (const ReportSection& section : contents.sections) {
    for (const ReportBlock& block : section.blocks) {
      const auto* page = std::get_if<PageBlock>(&block);
      if (page == nullptr || page->html.empty()) continue;
      for (const std::string& hash : page->script_hashes) policy += " 'sha256-" + escaped(hash) + "'";
    }
  }
  return policy.empty() ? "" : " script-src" + policy + ";";
}

}  // namespace

std::string report_html(const ReportContents& contents) {
  // The policy keeps the promise that nothing is loaded or run, should a text ever slip through unescaped.
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none';" +
      script_policy(contents) +
      " style-src 'unsafe-inline'; img-src data:\"/>\n<meta name=\"viewport\" content=\"width=device-width, "
      "initial-scale=1\"/>\n<title>" +
      escaped(contents.title) + "</title>\n<style>" + kStyle + "</style>\n</head>\n<body>\n<main>\n<header>\n<h1>" +
      escaped(contents.title) + "</h1>\n";
  if (!contents.subtitle.empty()) out += "<p class=\"subtitle\">" + escaped(contents.subtitle) + "</p>\n";
  if (!contents.facts.empty()) {
    out += "<dl class=\"facts\">\n";
    for (const auto& [name, value] : contents.facts)
      out += "<div><dt>" + escaped(name) + "</dt><dd>" + escaped(value) + "</dd></div>\n";
    out += "</dl>\n";
  }
  out += "</header>\n";
  for (const ReportSection& section : contents.sections) out += html_of(section);
  return out.append(kEnd);
}

core::Status write_report(const std::filesystem::path& path, const ReportContents& contents) {
  return write_file(path, std::string_view(report_html(contents)));
}

core::Status add_section(const std::filesystem::path& path, const ReportSection& section) {
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, read_file(path, kMostBytes));
  std::string page(bytes.begin(), bytes.end());
  if (!page.ends_with(kEnd))
    return core::invalid_input(path.string() + ": it does not end as a report of Prescene does: write it anew");
  page.insert(page.size() - kEnd.size(), html_of(section));
  return write_file(path, std::string_view(page));
}

}  // namespace prescene::interfaces
