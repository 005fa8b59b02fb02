// SPDX-License-Identifier: Apache-2.0
// Options, question and text of why a pose is believed, and the pixels that speak for it and against it as files.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "prescene/core/status.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's own
class App;
}

namespace prescene::service {

/// --against.
void add_why_options(CLI::App& verb, std::string& against);
/// {"why": {...}}. `against`: "absence", "alternative", a pose as "X,Y,Z,ROLL,PITCH,YAW" (m, degrees) or as JSON; "" =
/// absence, and the alternative where there is one. `last`, or `from` and `to`: the window, s.
core::Result<nlohmann::ordered_json> why_question(const std::string& object, const std::string& against,
                                                  std::optional<double> last, std::optional<double> from,
                                                  std::optional<double> to);
/// The paragraph and a table of frames; `why` as in the task of an answer.
std::string why_text(const nlohmann::ordered_json& why);
/// The images of an answer as PNG files, 8 x 8 pixels for each of the likelihood's: orange for the pose, blue against
/// it, 8 nats at the ends; grey where neither pose is in sight. Makes the folder. kDataLoss for an answer of another
/// form.
core::Status write_why_images(const nlohmann::ordered_json& why, const std::string& folder);

}  // namespace prescene::service
