// SPDX-License-Identifier: Apache-2.0
// Options, questions and texts of what cameras will see, and the images of an answer as files.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/image.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's own
class App;
}

namespace prescene::service {

struct ViewQuestionOptions {
  std::vector<std::string> look_from;  ///< "X,Y,Z", m.
  std::string look_at;                 ///< The same.
  std::string about;                   ///< Of next_view; "" = place.
  std::string images;                  ///< Folder; "" = none.
  friend bool operator==(const ViewQuestionOptions&, const ViewQuestionOptions&) = default;
};
/// --look-from, --look-at, --about and --images.
void add_view_question_options(CLI::App& verb, ViewQuestionOptions& options);
/// {"view": {...}} of now, or after `time` s.
core::Result<nlohmann::ordered_json> view_question(const ViewQuestionOptions& options);
/// {"next_view": {...}}.
core::Result<nlohmann::ordered_json> next_view_question(const std::string& object, const ViewQuestionOptions& options);

/// An image of an answer, of any encoding that answers have, as numbers. kDataLoss for another form.
core::Result<geometry::Image<float>> image_of_answer(const nlohmann::ordered_json& image, const std::string& name);

/// What the answers say, in sentences; `answer` as in the task of an answer.
std::string view_text(const nlohmann::ordered_json& answer);
std::string next_view_text(const nlohmann::ordered_json& answer);
/// The images of a `view` as PNG files: depths in mm and deviations in 0.1 mm of 16 bits, probabilities of 8 bits, and
/// colour. Makes the folder. kDataLoss for an answer of another form.
core::Status write_view_images(const nlohmann::ordered_json& answer, const std::string& folder);

}  // namespace prescene::service
