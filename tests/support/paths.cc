// SPDX-License-Identifier: Apache-2.0
#include "tests/support/paths.h"

#include <cstdlib>
#include <stdexcept>
#include <system_error>

namespace prescene::tests {
namespace {

std::filesystem::path from_environment(const char* variable, std::filesystem::path fallback) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0' ? std::filesystem::path(value) : std::move(fallback);
}

std::filesystem::path data_root() {
  return from_environment("PRESCENE_DATA", source_dir().parent_path() / "shared" / "data");
}

}  // namespace

std::filesystem::path source_dir() { return from_environment("PRESCENE_SOURCE_DIR", PRESCENE_SOURCE_DIR); }

std::filesystem::path build_dir() { return from_environment("PRESCENE_BUILD_DIR", PRESCENE_BUILD_DIR); }

std::optional<std::filesystem::path> data_dir(std::string_view name) {
  std::filesystem::path path = data_root() / name;
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return std::nullopt;
  return path;
}

std::string missing_data_message(std::string_view name) {
  return "skipped: no folder '" + std::string(name) + "' in " + data_root().string() +
         "; set PRESCENE_DATA to the folder that holds it";
}

ScratchDir::ScratchDir() {
  std::string pattern = (std::filesystem::temp_directory_path() / "prescene_test_XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("cannot make a folder like " + pattern);
  path_ = pattern;
}

ScratchDir::~ScratchDir() {
  std::error_code error;
  std::filesystem::remove_all(path_, error);
}

}  // namespace prescene::tests
