// SPDX-License-Identifier: Apache-2.0
// What a benchmark has to say: targets with what was wanted and what was reached, and tables of raw figures. Becomes a
// table to read, a JSON file, CSV files and plots.
//
//   Report report("collision", "AVX3");
//   report.add({.work = "boolean vs FCL", .must = at_least(20), .aim = at_least(40), .reached = 31.5, .unit = "x"});
//   std::fputs(report.text().c_str(), stdout);
//   PRESCENE_RETURN_IF_ERROR(report.write("build/bench/collision.json"));
//
// JSON: {"name", "machine", "simd_target", "notes": [...], "targets": [{"work", "must", "aim", "reached", "better",
// "unit", "n", "baseline", "why"?}], "raw": {TABLE: [{COLUMN: value}]}}. "better" is "higher", "lower" or "within";
// then must and aim are [low, high]. must and aim are null where nothing was asked; reached is null only with "why".
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "benchmarks/plot.h"
#include "prescene/core/status.h"

namespace prescene::benchmarks {

enum class Better { kHigher, kLower, kWithin };

/// A bound: at least `low` (kHigher), at most `high` (kLower), or both (kWithin).
struct Goal {
  double low = 0.0;
  double high = 0.0;
};

struct Target {
  std::string work;
  Better better = Better::kHigher;
  std::optional<Goal> must;  ///< Nothing: reported only.
  std::optional<Goal> aim;
  std::optional<double> reached;  ///< Nothing only with `why`.
  std::string unit;               ///< "x" for ratios.
  std::int64_t n = 0;             ///< How many measurements it rests on.
  std::string baseline = {};      ///< What was compared with, and how.
  std::string why = {};           ///< Why it was not measured, or what to know about the figure.
};

inline Goal at_least(double low) { return {low, 0.0}; }
inline Goal at_most(double high) { return {0.0, high}; }

/// Whether a target that was measured meets a goal.
bool meets(const Target& target, const Goal& goal);

using Figure = std::variant<std::string, double, std::int64_t>;  ///< NaN is written as null, empty in CSV.

struct Table {
  std::string name;  ///< Lower case, for file names.
  std::vector<std::string> columns;
  std::vector<std::vector<Figure>> rows;  ///< As many as columns (checked).
};

/// The best instruction set that the machine has and the kernels are compiled for.
std::string best_simd_target();

class Report {
 public:
  /// `simd_target`: the widest instruction set that the kernels ran with, or what else they ran on.
  Report(std::string name, std::string simd_target);

  /// Checks that a target without a figure says why.
  void add(Target target);
  void add(Table table);
  void add(Plot plot);
  /// A sentence for the reader.
  void note(std::string sentence);

  const std::vector<Target>& targets() const { return targets_; }

  /// The targets as a table with a mark each: "aim", "must", "MISSED", "-" where nothing was asked or measured.
  std::string text() const;
  /// `path` and, for each table with rows, `path` with ".TABLE.csv" instead of its extension;
  /// plots likewise with ".PLOT.svg". Fails as writing does.
  core::Status write(const std::filesystem::path& path) const;
  /// write() where a path is given, a failure to stderr; the benchmark's exit status.
  int finish(const std::filesystem::path& path) const;

 private:
  std::string name_;
  std::string simd_target_;
  std::string machine_;
  std::vector<std::string> notes_;
  std::vector<Target> targets_;
  std::vector<Table> tables_;
  std::vector<Plot> plots_;
};

/// Aligned columns, numbers to four digits.
std::string text_of(const Table& table);
/// The processor's name and the number of processors, as the operating system tells them.
std::string machine_name();

}  // namespace prescene::benchmarks
