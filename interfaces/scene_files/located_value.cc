// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/located_value.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <exception>
#include <map>
#include <optional>
#include <sstream>

#include "prescene/core/utf8.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

// Paths are for messages: the end of a long one says enough.
constexpr std::size_t kLongestPath = 200;
constexpr std::size_t kLongestKey = 256;
constexpr std::size_t kMostKeys = 1024;  // of one map: each new one is compared with all

// Carries a status out of the parser's callbacks; caught in parse_yaml.
struct Stop : std::exception {
  Stop(core::StatusCode c, Problem p) : code(c), problem(std::move(p)) {}
  core::StatusCode code;
  Problem problem;
};

class TreeBuilder final : public YAML::EventHandler {
 public:
  TreeBuilder(const std::string& file, const YamlLimits& limits, Problems* problems)
      : file_(std::make_shared<const std::string>(file)), limits_(limits), problems_(problems) {}

  bool has_document() const { return has_root_; }
  LocatedValue take() {
    root_.path.clear();
    name_paths(root_);
    return std::move(root_);
  }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (has_root_)
      stop(place_of(mark), "a second document begins here", "put one document into the file, without '---'");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    LocatedValue value;
    value.place = place_of(mark);
    finish(std::move(value), anchor);
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& text) override {
    LocatedValue value;
    value.place = place_of(mark);
    value.kind = LocatedValue::Kind::kScalar;
    value.text = text;
    value.quoted = tag == "!";
    count(value);
    finish(std::move(value), anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto known = anchors_.find(anchor);
    if (known == anchors_.end())
      stop(place_of(mark), "the alias refers to a value that is not complete", "refer to a value that ends above");
    count(known->second);
    check_depth(known->second, stack_.size() + 1);
    finish(known->second, 0);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, anchor, LocatedValue::Kind::kList);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, anchor, LocatedValue::Kind::kMap);
  }
  void OnMapEnd() override { close(); }

 private:
  struct Open {
    LocatedValue value;
    YAML::anchor_t anchor;
    bool has_key = false;
    bool key_is_repeated = false;  // the next value is left out
  };

  FilePlace place_of(const YAML::Mark& mark) const { return {file_, mark.line + 1, mark.column + 1}; }

  [[noreturn]] void stop(const FilePlace& place, std::string reason, std::string remedy,
                         core::StatusCode code = core::StatusCode::kInvalidInput) const {
    throw Stop(code, {*place.file, place.line, place.column, "", std::move(reason), std::move(remedy)});
  }

  // Of a value and everything in it.
  void count(const LocatedValue& value) {
    ++values_;
    bytes_ += value.text.size();
    for (const LocatedValue::Key& key : value.keys) bytes_ += key.name.size();
    if (values_ > limits_.max_values || bytes_ > limits_.max_bytes)
      stop(value.place,
           "the document holds more than " + std::to_string(limits_.max_values) + " values or " +
               size_text(limits_.max_bytes) + " with its aliases expanded",
           "make it smaller", core::StatusCode::kResourceExhausted);
    for (const LocatedValue& item : value.items) count(item);
  }

  void open(const YAML::Mark& mark, YAML::anchor_t anchor, LocatedValue::Kind kind) {
    LocatedValue value;
    value.place = place_of(mark);
    value.kind = kind;
    count(value);
    check_depth(value, stack_.size() + 1);
    stack_.push_back({std::move(value), anchor});
  }

  void close() {
    Open done = std::move(stack_.back());
    stack_.pop_back();
    finish(std::move(done.value), done.anchor);
  }

  void check_depth(const LocatedValue& value, std::size_t depth) const {
    if (depth > static_cast<std::size_t>(limits_.max_depth))
      stop(value.place, "values are nested deeper than " + std::to_string(limits_.max_depth),
           "make the document flatter", core::StatusCode::kResourceExhausted);
    for (const LocatedValue& item : value.items) check_depth(item, depth + 1);
  }

  void finish(LocatedValue value, YAML::anchor_t anchor) {
    if (anchor != 0) {
      count(value);  // the copy that aliases are made from
      anchors_[anchor] = value;
    }
    if (stack_.empty()) {
      root_ = std::move(value);
      has_root_ = true;
      return;
    }
    Open& parent = stack_.back();
    if (parent.value.kind == LocatedValue::Kind::kMap && !parent.has_key) {
      add_key(parent, value);
    } else {
      if (!parent.key_is_repeated) parent.value.items.push_back(std::move(value));
      parent.has_key = parent.key_is_repeated = false;
    }
  }

  void add_key(Open& map, const LocatedValue& key) {
    if (key.kind != LocatedValue::Kind::kScalar) stop(key.place, "a key is not a word", "write 'key: value'");
    if (key.text.size() > kLongestKey)
      stop(key.place, "a key is longer than " + std::to_string(kLongestKey) + " characters", "shorten it");
    if (map.value.keys.size() == kMostKeys)
      stop(key.place, "a map has more than " + std::to_string(kMostKeys) + " keys", "make it smaller",
           core::StatusCode::kResourceExhausted);
    const auto same = std::find_if(map.value.keys.begin(), map.value.keys.end(),
                                   [&](const LocatedValue::Key& other) { return other.name == key.text; });
    map.has_key = true;
    if (same == map.value.keys.end()) {
      map.value.keys.push_back({key.text, key.place});
      return;
    }
    std::string reason =
        "the key " + interfaces::quote(key.text) + " is here twice, first on line " + std::to_string(same->place.line);
    const char* remedy = "remove or rename one";
    if (!problems_) stop(key.place, std::move(reason), remedy);
    problems_->add(key.place, "", std::move(reason), remedy);
    map.key_is_repeated = true;
  }

  static std::string shown(const std::string& key) {
    const std::string safe = interfaces::quote(key, 40);
    return safe.substr(1, safe.size() - 2);
  }

  void name_paths(LocatedValue& value) {
    for (std::size_t i = 0; i < value.items.size(); ++i) {
      std::string path = value.path;
      if (value.kind == LocatedValue::Kind::kMap)
        path.append(path.empty() ? "" : ".").append(shown(value.keys[i].name));
      else
        path.append("[").append(std::to_string(i)).append("]");
      if (path.size() > kLongestPath) path = "..." + path.substr(path.size() - kLongestPath + 3);
      value.items[i].path = std::move(path);
      name_paths(value.items[i]);
    }
  }

  std::shared_ptr<const std::string> file_;
  const YamlLimits limits_;
  Problems* problems_;
  LocatedValue root_;
  bool has_root_ = false;
  std::vector<Open> stack_;
  std::map<YAML::anchor_t, LocatedValue> anchors_;
  std::size_t values_ = 0;
  std::size_t bytes_ = 0;
};

/// Lines of a text, each without its end.
std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

/// The parser notices what is missing at the end of a line when it reads on: an open bracket, or a key without its
/// colon. The line (from 1) on which it is missing, with what to do; nothing if the mistake is where the parser noticed
/// it.
std::optional<std::pair<int, std::string>> mistake_before(const YAML::Exception& error, std::string_view text) {
  const bool open_bracket = error.msg.find("flow not found") != std::string::npos;
  if (error.mark.is_null() || (!open_bracket && error.msg != "illegal map value")) return std::nullopt;
  const std::vector<std::string_view> lines = lines_of(text);
  const auto noticed = std::min(static_cast<std::size_t>(error.mark.line), lines.size());
  std::size_t line = noticed;  // from 1, the last one above that says something
  const auto says_nothing = [](std::string_view of) {
    const std::size_t first = of.find_first_not_of(" \t\r");
    return first == std::string_view::npos || of[first] == '#';
  };
  while (line > 0 && says_nothing(lines[line - 1])) --line;
  if (line == 0) return std::nullopt;
  if (open_bracket) return std::pair(static_cast<int>(line), std::string("close the bracket that is open here"));
  const std::string_view here = noticed < lines.size() ? lines[noticed] : std::string_view();
  const std::string_view before_mark = here.substr(0, static_cast<std::size_t>(std::max(0, error.mark.column)));
  const bool key_alone = before_mark.find(':') == std::string_view::npos && here.find('\t') == std::string_view::npos;
  if (!key_alone || lines[line - 1].find(':') != std::string_view::npos) return std::nullopt;
  return std::pair(static_cast<int>(line), std::string("write ':' and a space after the key"));
}

Problem syntax_error(const std::string& file, const YAML::Exception& error, std::string_view text) {
  Problem problem{file, error.mark.is_null() ? 0 : error.mark.line + 1, error.mark.column + 1,
                  "",   "this is not YAML (" + error.msg + ")",         ""};
  problem.remedy =
      "check the indentation (spaces, no tabs), a space after each ':' and '-', and pairs of quotes and brackets";
  if (auto before = mistake_before(error, text)) {
    problem.line = before->first;
    problem.column = 0;
    problem.remedy = std::move(before->second);
  }
  return problem;
}

/// What ends the reading, alone or after what was collected.
core::Status failure(core::StatusCode code, const Problem& problem, Problems* problems) {
  if (!problems) return core::Status(code, problem.text());
  const bool alone = problems->empty();
  problems->add({std::make_shared<const std::string>(problem.file), problem.line, problem.column}, problem.key,
                problem.reason, problem.remedy);
  return alone ? core::Status(code, problem.text()) : problems->status();
}

}  // namespace

const LocatedValue* LocatedValue::find(std::string_view key) const {
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (keys[i].name == key) return &items[i];
  return nullptr;
}

namespace {

/// Begins as YAML in UTF-16 or UTF-32 does [YAML 1.2, section 5.2], which the parser turns into UTF-8.
bool is_wide(std::string_view text) {
  return text.substr(0, 2).find('\0') != std::string_view::npos || text.starts_with("\xfe\xff") ||
         text.starts_with("\xff\xfe");
}

}  // namespace

core::Result<LocatedValue> parse_yaml(std::string_view text, const std::string& file, const YamlLimits& limits,
                                      Problems* problems) {
  if (text.size() > limits.max_bytes)
    return core::resource_exhausted(file + ": " + size_text(text.size()) + " are more than the limit of " +
                                    size_text(limits.max_bytes) + ": make the file smaller");
  if (const std::optional<std::size_t> byte = core::not_utf8_at(text); byte && !is_wide(text))
    return core::invalid_input(
        file + ": byte " + std::to_string(*byte) + " (line " +
        std::to_string(1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(*byte), '\n')) +
        ") is not UTF-8: save the file in that encoding");
  try {
    std::istringstream stream{std::string(text)};
    YAML::Parser parser(stream);
    TreeBuilder builder(file, limits, problems);
    while (parser.HandleNextDocument(builder)) {
    }
    if (!builder.has_document()) return core::invalid_input(file + ": the file is empty: write at least one key");
    return builder.take();
  } catch (const Stop& stop) {
    return failure(stop.code, stop.problem, problems);
  } catch (const YAML::Exception& error) {
    return failure(core::StatusCode::kInvalidInput, syntax_error(file, error, text), problems);
  } catch (const std::exception& error) {
    return core::invalid_input(file + ": this is not YAML (" + std::string(error.what()) + "): check the file");
  }
}

core::Result<LocatedValue> read_yaml(const std::filesystem::path& path, const YamlLimits& limits, Problems* problems) {
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, read_file(path, limits.max_bytes));
  return parse_yaml(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()), path.string(), limits,
                    problems);
}

}  // namespace prescene::interfaces
