// SPDX-License-Identifier: Apache-2.0
#include "prescene/tests/support/pinned.h"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

#include "prescene/core/hash.h"
#include "prescene/tests/support/paths.h"

namespace prescene::tests {
namespace {

void write_text(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

// The first line in which two texts differ, as "expected 'a', got 'b'".
std::string first_difference(const std::string& expected, const std::string& actual) {
  std::istringstream expected_lines(expected);
  std::istringstream actual_lines(actual);
  std::string a;
  std::string b;
  for (;;) {
    const bool has_a = static_cast<bool>(std::getline(expected_lines, a));
    const bool has_b = static_cast<bool>(std::getline(actual_lines, b));
    if (!has_a) a = "the end";
    if (!has_b) b = "the end";
    if (a != b || (!has_a && !has_b)) return "expected '" + a + "', got '" + b + "'";
  }
}

}  // namespace

std::string trace_text(std::span<const TraceEntry> trace) {
  std::ostringstream text;
  for (const TraceEntry& entry : trace) {
    text << entry.step << ' ' << entry.stage << ' ' << entry.particle << ' ' << core::hash_text(entry.hash) << '\n';
  }
  return text.str();
}

testing::AssertionResult matches_pinned(std::string_view name, std::span<const TraceEntry> trace) {
  const std::string file_name = std::string(name) + ".trace";
  const std::filesystem::path pinned = source_dir() / "tests" / "scenarios" / "pinned" / file_name;
  const std::string actual = trace_text(trace);
  if (std::getenv("PRESCENE_BLESS") != nullptr) {
    write_text(pinned, actual);
    return testing::AssertionSuccess() << "wrote " << pinned.string();
  }
  std::ifstream file(pinned);
  if (!file) {
    return testing::AssertionFailure() << "nothing is pinned in " << pinned.string() << "; see ./dev bless";
  }
  const std::string expected{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (expected == actual) return testing::AssertionSuccess();
  const std::filesystem::path kept = build_dir() / "traces" / file_name;
  write_text(kept, actual);
  return testing::AssertionFailure() << "the step trace differs from the pinned one: "
                                     << first_difference(expected, actual) << "\n  ./dev trace-diff " << pinned.string()
                                     << " " << kept.string() << "\n  If the change is meant: ./dev bless REASON";
}

}  // namespace prescene::tests
