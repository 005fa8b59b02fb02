// SPDX-License-Identifier: Apache-2.0
#include "tests/support/pinned.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "prescene/core/hash.h"
#include "tests/support/paths.h"

namespace prescene::tests {
namespace {

constexpr std::string_view kPlatformRemark = "# platform: ";

bool blessing() { return std::getenv("PRESCENE_BLESS") != nullptr; }

std::filesystem::path pinned_file(const std::string& file_name) {
  return source_dir() / "tests" / "scenarios" / "pinned" / file_name;
}

std::optional<std::string> read_text(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) return std::nullopt;
  return std::string{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

testing::AssertionResult nothing_pinned(const std::filesystem::path& path) {
  return testing::AssertionFailure() << "nothing is pinned in " << path.string() << "; see ./dev bless";
}

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

testing::AssertionResult matches_pinned(std::string_view name, std::string_view platform,
                                        std::span<const TraceEntry> trace) {
  const std::string file_name = std::string(name) + ".trace";
  const std::filesystem::path pinned = pinned_file(file_name);
  const std::string first_line = std::string(kPlatformRemark) + std::string(platform) + "\n";
  const std::string actual = first_line + trace_text(trace);
  if (blessing()) {
    write_text(pinned, actual);
    return testing::AssertionSuccess() << "wrote " << pinned.string();
  }
  const std::optional<std::string> expected = read_text(pinned);
  if (!expected) return nothing_pinned(pinned);
  if (!expected->starts_with(first_line)) {
    return testing::AssertionSuccess() << "the bits of " << file_name
                                       << " are not compared, as they were pinned on another platform\n  pinned: "
                                       << expected->substr(0, expected->find('\n')) << "\n  here:   " << kPlatformRemark
                                       << platform;
  }
  if (*expected == actual) return testing::AssertionSuccess() << "the bits are the pinned ones";
  const std::filesystem::path kept = build_dir() / "traces" / file_name;
  write_text(kept, actual);
  return testing::AssertionFailure() << "the step trace differs from the pinned one: "
                                     << first_difference(*expected, actual) << "\n  ./dev trace-diff "
                                     << pinned.string() << " " << kept.string()
                                     << "\n  If the change is meant: ./dev bless REASON";
}

testing::AssertionResult matches_pinned(std::string_view name, std::span<const ReadableNumber> numbers) {
  const std::filesystem::path pinned = pinned_file(std::string(name) + ".json");
  const std::optional<std::string> text = read_text(pinned);
  if (!text && !blessing()) return nothing_pinned(pinned);
  const auto expected = nlohmann::ordered_json::parse(text.value_or("{}"), nullptr, false);
  if (!expected.is_object()) return testing::AssertionFailure() << pinned.string() << " is not a JSON object";

  nlohmann::ordered_json kept = nlohmann::ordered_json::object();
  std::string misfits;
  for (const ReadableNumber& number : numbers) {
    if (!std::isfinite(number.value) || !(number.tolerance > 0.0)) {
      return testing::AssertionFailure() << number.name << " is " << number.value << " with a tolerance of "
                                         << number.tolerance;
    }
    const nlohmann::ordered_json was = expected.value(number.name, nlohmann::ordered_json());
    const bool fits = was.is_object() && was.value("tolerance", 0.0) == number.tolerance &&
                      std::abs(was.value("value", 0.0) - number.value) <= number.tolerance;
    // Digits far below the tolerance would only look as if they meant something.
    const double digits = std::pow(10.0, 1.0 - std::floor(std::log10(number.tolerance)));
    kept[number.name] = fits ? was
                             : nlohmann::ordered_json{{"value", std::round(number.value * digits) / digits},
                                                      {"tolerance", number.tolerance}};
    if (!fits) {
      std::ostringstream line;
      line << "\n  " << number.name << ": " << number.value << " +- " << number.tolerance << ", pinned "
           << (was.is_null() ? "nothing" : was.dump());
      misfits += line.str();
    }
  }
  for (const auto& [key, value] : expected.items()) {
    if (!kept.contains(key)) misfits += "\n  " + key + ": pinned, but no longer stated by the test";
  }
  if (misfits.empty()) return testing::AssertionSuccess() << "the numbers are within their tolerances";
  if (blessing()) {
    write_text(pinned, kept.dump(2) + "\n");
    return testing::AssertionSuccess() << "wrote " << pinned.string();
  }
  return testing::AssertionFailure() << "numbers differ from " << pinned.string() << ":" << misfits
                                     << "\n  If the change is meant: ./dev bless REASON";
}

}  // namespace prescene::tests
