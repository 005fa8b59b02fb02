// SPDX-License-Identifier: Apache-2.0
// What is wrong in a scene file, one by one: for who shows it in another form than a text.
//
//   interfaces::FileReport report;
//   const auto scene = load_reported_scene(text, path, log, report);
//   for (const interfaces::Problem& problem : report.errors) ... problem.file, problem.line, problem.remedy
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "prescene/belief/scene.h"
#include "prescene/core/log.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "prescene/service/load_scene.h"

namespace prescene::service {

/// load_scene_text, with the problems that its status lists and those that were logged. What was tidied up in meshes is
/// logged of each. Remarks (Symmetries::kSuggested, which asks for those on simplified hulls, too) are in the report
/// and not logged.
core::Result<std::shared_ptr<const belief::Scene>> load_reported_scene(const std::string& text,
                                                                       const std::filesystem::path& path,
                                                                       const core::LogSink& log,
                                                                       interfaces::FileReport& report,
                                                                       Symmetries symmetries = Symmetries::kAsWritten);

/// Reads a model file, as `inspect` writes them, and its mesh, likewise.
core::Result<belief::ObjectModel> load_reported_model(const std::filesystem::path& path, const core::LogSink& log,
                                                      interfaces::FileReport& report,
                                                      Symmetries symmetries = Symmetries::kAsWritten);

}  // namespace prescene::service
