// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/recorded_page.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "json_fields.h"
#include "page_files.h"
#include "prescene/belief/json.h"
#include "prescene/core/check.h"
#include "prescene/core/text.h"
#include "prescene/service/outside_json.h"
#include "sha256.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

constexpr int kPagePictureWidth = 480, kPagePictureQuality = 70;

std::string base64_of(const std::string& bytes) {
  return core::base64({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

/// The texts are documents already: an array of them without reading them.
template <class List, class TextOf>
std::string array_of(const List& list, const TextOf& text_of) {
  std::string array = "[";
  for (const auto& one : list) {
    if (array.size() > 1) array += ',';
    array += text_of(one);
  }
  return array + "]";
}

std::string file_of(const std::string& path) {
  for (const interfaces::WebFile& file : page_files())
    if (file.path == path) return file.body;
  PRESCENE_CHECK_MSG(false, "the page has no file " + path);
  return "";
}

/// A module's text for a script that holds all modules: without its imports, its exports plain.
std::string merged_module(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string line = text.substr(at, end - at);
    at = end + 1;
    if (line.starts_with("import ")) continue;
    if (line.starts_with("export ")) line.erase(0, 7);
    out += line + "\n";
  }
  return out;
}

void replace_once(std::string& text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  PRESCENE_CHECK_MSG(at != std::string::npos, "the page has no " + what);
  text.replace(at, what.size(), by);
}

std::string counted_left_out(const ThinnedTexts& texts, const std::string& what) {
  if (texts.kept().size() == texts.added()) return "";
  const std::string changes = texts.marked_left_out() > 0
                                  ? " (" + std::to_string(texts.marked_left_out()) + " of these are left out, too)."
                                  : ".";
  return "Of " + std::to_string(texts.added()) + " " + what + " " + std::to_string(texts.kept().size()) +
         " are kept here: one in " + std::to_string(texts.stride()) + ", and those at which a state changed" + changes;
}

}  // namespace

void ThinnedTexts::add(std::string text, bool is_marked) {
  if (!wants_next(is_marked)) return skip();
  bytes_ += text.size();
  kept_.push_back({added_++, std::move(text), is_marked, is_marked});
  while (bytes_ > most_bytes_) {
    if (kept_.size() == 1) {  // it alone is larger than all the room
      bytes_ = 0;
      marked_left_out_ += kept_.front().was_marked ? 1 : 0;
      kept_.clear();
      return;
    }
    const auto marked = std::count_if(kept_.begin(), kept_.end(), [](const Text& one) { return one.is_marked; });
    if (2 * static_cast<std::size_t>(marked) >= kept_.size()) {
      // Too many are marked: every second of them is as the others from here on.
      bool every_second = false;
      for (Text& one : kept_)
        if (one.is_marked && (every_second = !every_second)) one.is_marked = false;
    } else {
      stride_ *= 2;  // two at least are multiples of it, so it stays in the range of the numbers
    }
    std::erase_if(kept_, [this](const Text& one) {
      const bool goes = !one.is_marked && one.number % stride_ != 0;
      if (!goes) return false;
      bytes_ -= one.text.size();
      marked_left_out_ += one.was_marked ? 1 : 0;
      return true;
    });
  }
}

RecordedPage::RecordedPage(RecordedPageOptions options)
    : options_(std::move(options)), steps_(options_.most_step_bytes), pictures_(options_.most_picture_bytes) {}

void RecordedPage::add(const ShownStep& given) {
  ShownStep step = given;
  const int camera = step.observation.camera;
  scene_ = step.belief->scene;
  if (!scene_->more_cameras.empty()) frames_[camera] = step.observation;
  step.frames = frames_;
  const BeliefSummary summary = summary_of(step);
  const std::uint64_t revision = history_.revision();
  const std::size_t runs = history_.runs().size();
  history_.add(summary, count_);
  const bool is_change = history_.revision() != revision || history_.runs().size() != runs;
  time_ = history_.seconds_of(summary.stamp_ns);
  if (steps_.wants_next(is_change)) {
    ordered_json document = step_document(step, summary, count_);
    document["time"] = time_;
    steps_.add(belief::json_text(document), is_change);
  } else {
    steps_.skip();
  }
  add_picture(step.observation, is_change);
  ++count_;
}

void RecordedPage::add_picture(const belief::Observation& observation, bool is_change) {
  if (!observation.frame.color && !observation.frame.depth) return;
  if (!pictures_.wants_next(is_change)) return pictures_.skip();  // encoding takes longer than all else of a step
  const std::string jpeg = picture_jpeg(observation, kPagePictureWidth, kPagePictureQuality);
  if (jpeg.empty()) return;
  pictures_.add(belief::json_text(JsonFields()
                                      .count("index", count_)
                                      .count("camera", static_cast<std::uint64_t>(observation.camera))
                                      .text("jpeg", base64_of(jpeg))
                                      .take()),
                is_change);
}

void RecordedPage::add_answer(const std::string& json) {
  const ordered_json answer = parse_or_discard(json);
  if (!answer.is_object()) return;
  std::string text = belief::json_text(JsonFields()
                                           .number("time", time_)
                                           .count("index", count_ > 0 ? count_ - 1 : 0)
                                           .field("answer", ordered_json(answer))
                                           .take());
  if (answer_bytes_ + text.size() > options_.most_answer_bytes) {
    ++answers_left_out_;
    return;
  }
  answer_bytes_ += text.size();
  answers_.push_back(std::move(text));
}

std::string RecordedPage::data() const {
  std::vector<std::string> remarks;
  for (std::string remark : {counted_left_out(steps_, "steps"), counted_left_out(pictures_, "pictures")})
    if (!remark.empty()) remarks.push_back(std::move(remark));
  if (history_.forgotten_steps() > 0)
    remarks.push_back(
        "Of the first " + std::to_string(history_.forgotten_steps()) +
        " steps there are no curves: an object or a parameter was no longer there, or the clock went back.");
  if (history_.left_out_objects() > 0)
    remarks.push_back(std::to_string(history_.left_out_objects()) +
                      " objects have no curves and states: there are too many, or their names are too long.");
  if (answers_left_out_ > 0) remarks.push_back(std::to_string(answers_left_out_) + " long answers are left out.");
  const auto as_is = [](const std::string& text) { return text; };
  const auto kept = [](const ThinnedTexts::Text& one) { return one.text; };
  std::string data = belief::json_text(JsonFields()
                                           .text("title", options_.title)
                                           .count("count", count_)
                                           .texts("remarks", remarks)
                                           .field("history", to_json(history_))
                                           .field("scene", scene_ ? scene_document(*scene_) : ordered_json())
                                           .take());
  data.pop_back();
  return data + ",\"steps\":" + array_of(steps_.kept(), kept) + ",\"pictures\":" + array_of(pictures_.kept(), kept) +
         ",\"answers\":" + array_of(answers_, as_is) + "}";
}

interfaces::PageBlock RecordedPage::page() const {
  return count_ > 0 ? page_with_data(data()) : interfaces::PageBlock();
}

interfaces::PageBlock page_with_data(const std::string& data) {
  std::string script;
  for (const char* module : {"/drawing.js", "/scene3d.js", "/panels.js", "/bands.js", "/recorded.js", "/view.js"})
    script += merged_module(file_of(module));
  std::string embedded;
  embedded.reserve(data.size());
  for (const char c : data) embedded += c == '<' ? std::string("\\u003c") : std::string(1, c);
  std::string html = file_of("/");
  replace_once(html, "<link rel=\"icon\" href=\"icon.svg\">\n", "");
  replace_once(html, "<link rel=\"stylesheet\" href=\"view.css\">", "<style>\n" + file_of("/view.css") + "</style>");
  replace_once(html, "<script type=\"module\" src=\"view.js\"></script>\n", "");
  replace_once(html, "</body>",
               "<script type=\"application/json\" id=\"recorded\">" + embedded + "</script>\n<script type=\"module\">" +
                   script + "</script>\n</body>");
  return {"", std::move(html), {core::base64(sha256(script))}};
}

}  // namespace prescene::service
