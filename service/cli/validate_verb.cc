// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "prescene/service/load_scene.h"
#include "verb.h"

namespace prescene::service {

Verb add_validate_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("validate", "Check scene files: every mistake with its line and the remedy");
  auto files = std::make_shared<std::vector<std::string>>();
  verb->add_option("FILE", *files, "Scene files (docs/scene_files.md)")->required();
  verb->footer("Example: prescene validate scenarios/milk_on_bin.yaml");
  return {verb, [files](VerbContext& context) -> core::Status {
            nlohmann::ordered_json documents = nlohmann::ordered_json::array();
            std::string text;
            core::Status first_bad;
            for (const std::string& file : *files) {
              const auto scene = load_scene(file, context.log());
              nlohmann::ordered_json document = {{"file", file}, {"valid", scene.ok()}};
              if (scene) {
                document["name"] = (*scene)->name;
                document["models"] = (*scene)->models.size();
                document["objects"] = (*scene)->objects.size();
                document["actions"] = (*scene)->actions.size();
                document["uncertain_dimensions"] = start_dimensions(**scene);
                text += file + ": valid: " + std::to_string((*scene)->objects.size()) + " objects, " +
                        std::to_string(start_dimensions(**scene)) + " uncertain dimensions\n";
              } else {
                document["errors"] = scene.status().message();
                text += scene.status().message() + "\n";
                if (first_bad.ok()) first_bad = scene.status();
              }
              documents.push_back(document);
            }
            context.print({{"files", documents}}, text);
            if (first_bad.ok()) return first_bad;
            // The mistakes are on stdout already.
            return core::Status(first_bad.code(), "not all files are valid");
          }};
}

}  // namespace prescene::service
