// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <tuple>

#include "prescene/interfaces/scene_files/learned_file.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/scene_report.h"
#include "verb.h"

namespace prescene::service {
namespace {

struct Checked {
  core::Status status;
  nlohmann::ordered_json document;
  std::string text;
};

/// Keeps the warnings about a file, besides saying them.
class Warnings {
 public:
  explicit Warnings(core::LogSink log) : log_(std::move(log)) {}

  core::LogSink sink() {
    return [this](core::LogLevel level, const std::string& text) {
      if (level >= core::LogLevel::kWarning) texts_.push_back(text);
      core::log(log_, level, text);
    };
  }
  const std::vector<std::string>& texts() const { return texts_; }
  /// Appended to the line that says that the file is valid.
  std::string count() const { return texts_.empty() ? "" : ", " + counted(texts_.size(), "warning"); }

 private:
  core::LogSink log_;
  std::vector<std::string> texts_;
};

std::vector<std::string> texts_of(const std::vector<interfaces::Problem>& problems) {
  std::vector<std::string> texts;
  for (const interfaces::Problem& problem : problems) texts.push_back(problem.text());
  return texts;
}

/// Lines below the one that says that a file is valid.
std::string lines_of(const std::vector<std::string>& remarks) {
  std::string lines;
  for (const std::string& remark : remarks) lines += "\nremark: " + remark;
  return lines;
}

/// Each mistake by itself; a file that could not be read is one.
Checked bad(const std::string& file, const core::Status& status, const interfaces::FileReport& report,
            const std::vector<std::string>& warnings) {
  nlohmann::ordered_json errors = nlohmann::ordered_json::array();
  std::vector<interfaces::Problem> problems = report.errors;
  std::stable_sort(problems.begin(), problems.end(), [](const interfaces::Problem& a, const interfaces::Problem& b) {
    return std::tie(a.file, a.line, a.column) < std::tie(b.file, b.line, b.column);
  });
  for (const interfaces::Problem& problem : problems) {
    const std::string key = problem.key.empty() ? "" : problem.key + ": ";
    errors.push_back({{"file", problem.file},
                      {"line", problem.line > 0 ? nlohmann::ordered_json(problem.line) : nlohmann::ordered_json()},
                      {"message", key + problem.reason},
                      {"remedy", problem.remedy}});
  }
  if (errors.empty())
    errors.push_back({{"file", file}, {"line", nullptr}, {"message", status.message()}, {"remedy", ""}});
  return {status,
          {{"file", file},
           {"valid", false},
           {"errors", std::move(errors)},
           {"warnings", warnings},
           {"remarks", texts_of(report.remarks)}},
          status.message()};
}

Checked check_scene(const std::string& file, VerbContext& context) {
  Warnings warnings(context.log());
  interfaces::FileReport report;
  const auto text = read_scene_text(file);
  if (!text) return bad(file, text.status(), report, {});
  const auto scene = load_reported_scene(*text, file, warnings.sink(), report, Symmetries::kSuggested);
  if (!scene) return bad(file, scene.status(), report, warnings.texts());
  const int dimensions = start_dimensions(**scene);
  const std::vector<std::string> remarks = texts_of(report.remarks);
  return {{},
          {{"file", file},
           {"valid", true},
           {"name", (*scene)->name},
           {"models", (*scene)->models.size()},
           {"objects", (*scene)->objects.size()},
           {"actions", (*scene)->actions.size()},
           {"uncertain_dimensions", dimensions},
           {"errors", nlohmann::ordered_json::array()},
           {"warnings", warnings.texts()},
           {"remarks", remarks}},
          file + ": valid: " + counted((*scene)->objects.size(), "object") + ", " +
              counted(static_cast<std::size_t>(dimensions), "uncertain dimension") + warnings.count() +
              lines_of(remarks)};
}

Checked check_model(const std::string& file, VerbContext& context) {
  Warnings warnings(context.log());
  interfaces::FileReport report;
  const auto model = load_reported_model(file, warnings.sink(), report, Symmetries::kSuggested);
  if (!model) return bad(file, model.status(), report, warnings.texts());
  const std::vector<std::string> remarks = texts_of(report.remarks);
  return {{},
          {{"file", file},
           {"valid", true},
           {"model", model->name},
           {"errors", nlohmann::ordered_json::array()},
           {"warnings", warnings.texts()},
           {"remarks", remarks}},
          file + ": valid: a model file" + warnings.count() + lines_of(remarks)};
}

Checked check_learned(const std::string& file) {
  interfaces::FileReport report;
  const auto text = read_scene_text(file);
  if (!text) return bad(file, text.status(), report, {});
  const auto learned = interfaces::parse_learned(*text, file, &report);
  if (!learned) return bad(file, learned.status(), report, {});
  return {{},
          {{"file", file},
           {"valid", true},
           {"learned_models", learned->models.size()},
           {"learned_objects", learned->objects.size()},
           {"errors", nlohmann::ordered_json::array()},
           {"warnings", nlohmann::ordered_json::array()},
           {"remarks", nlohmann::ordered_json::array()}},
          file + ": valid: what was learned of " + counted(learned->models.size(), "model") + " and " +
              counted(learned->objects.size(), "object")};
}

Checked check_file(const std::string& file, VerbContext& context) {
  if (is_learned_file(file)) return check_learned(file);
  return is_model_file(file) ? check_model(file, context) : check_scene(file, context);
}

}  // namespace

Verb add_validate_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("validate",
                                  "Check scene, model and learned files: every mistake with its line and the remedy");
  auto files = std::make_shared<std::vector<std::string>>();
  verb->add_option("FILE", *files, "Scene, model or learned files (docs/reference/scene_files.md)")->required();
  verb->footer("Example: prescene validate scenarios/milk_on_bin.yaml");
  return {verb, [files](VerbContext& context) -> core::Status {
            nlohmann::ordered_json documents = nlohmann::ordered_json::array();
            std::string text;
            core::Status first_bad;
            for (const std::string& file : *files) {
              const Checked checked = check_file(file, context);
              documents.push_back(checked.document);
              text += checked.text + "\n";
              if (first_bad.ok()) first_bad = checked.status;
            }
            context.print({{"files", documents}}, text);
            if (first_bad.ok()) return first_bad;
            // The mistakes are on stdout already.
            return core::Status(first_bad.code(), "not all files are valid");
          }};
}

}  // namespace prescene::service
