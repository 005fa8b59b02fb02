// SPDX-License-Identifier: Apache-2.0
#include "verb.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/clock.h"
#include "prescene/core/text.h"
#include "prescene/core/utf8.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/scene_files/problems.h"

namespace prescene::service {
namespace {

using core::fixed_text;

core::LogSink stderr_log(bool quiet) {
  auto logger = std::make_shared<spdlog::logger>("prescene", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  logger->set_pattern("%^%l%$: %v");
  logger->set_level(quiet ? spdlog::level::warn : spdlog::level::info);
  return [logger](core::LogLevel level, const std::string& said) {
    const std::string text = interfaces::printable_lines(said);
    switch (level) {
      case core::LogLevel::kDebug:
        logger->debug("{}", text);
        break;
      case core::LogLevel::kInfo:
        logger->info("{}", text);
        break;
      case core::LogLevel::kWarning:
        logger->warn("{}", text);
        break;
      case core::LogLevel::kError:
        logger->error("{}", text);
        break;
    }
  };
}

/// How wide the terminal on stderr is; 80 where it does not say, or is none.
std::size_t terminal_columns() {
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

/// The line, cut where it is too wide. Each character of UTF-8 counts as one column.
std::string fitted(const std::string& line, std::size_t columns) {
  const auto begins_character = [](char byte) { return (static_cast<unsigned char>(byte) & 0xc0U) != 0x80U; };
  const auto width = static_cast<std::size_t>(std::count_if(line.begin(), line.end(), begins_character));
  if (width <= columns) return line;
  const std::string dots = columns > 10 ? "..." : "";
  std::size_t left = columns - dots.size();
  std::size_t end = 0;
  while (end < line.size() && (left > 0 || !begins_character(line[end]))) left -= begins_character(line[end++]) ? 1 : 0;
  return line.substr(0, end) + dots;
}

std::string duration_text(double seconds) {
  if (seconds < 90.0) return fixed_text(seconds, 0) + " s";
  return fixed_text(seconds / 60.0, 1) + " min";
}

}  // namespace

ExitCode exit_code_of(const core::Status& status) {
  switch (status.code()) {
    case core::StatusCode::kOk:
      return ExitCode::kDone;
    case core::StatusCode::kInvalidInput:
    case core::StatusCode::kNotFound:
    case core::StatusCode::kDataLoss:
    case core::StatusCode::kUnsupported:
    case core::StatusCode::kResourceExhausted:  // by what was given: larger than a limit
      return ExitCode::kBadInput;
    case core::StatusCode::kUnavailable:
    case core::StatusCode::kCancelled:
      return ExitCode::kFailed;
  }
  return ExitCode::kFailed;
}

VerbContext::VerbContext(const CommonOptions& options, const core::Cancellation& cancellation)
    : options_(options), cancellation_(cancellation), log_(stderr_log(options.quiet)) {}

VerbContext::~VerbContext() { end_progress(); }

core::ThreadPool& VerbContext::pool() {
  if (!pool_) {
    pool_ = std::make_unique<core::ThreadPool>(options_.threads);
    if (pool_->threads() < options_.threads) {
      core::log(log_, core::LogLevel::kWarning,
                "the system allows no more than " + counted(static_cast<std::size_t>(pool_->threads()), "thread") +
                    ", not --threads " + std::to_string(options_.threads) + ": raise `ulimit -u` for more");
    }
  }
  return *pool_;
}

core::ProgressSink VerbContext::progress(const std::string& what) {
  if (options_.quiet) return {};
  const bool terminal = isatty(STDERR_FILENO) != 0;
  return [this, what, terminal, last = -1, since = core::Stopwatch()](const core::Progress& progress) mutable {
    const double fraction = std::clamp(progress.fraction, 0.0, 1.0);
    const int step = static_cast<int>(std::floor(fraction * (terminal ? 100.0 : 10.0)));
    // The share may stand still for long, where the work turns out to be more than was expected.
    if (step == last && since.seconds() < (terminal ? 1.0 : 30.0)) return;
    last = step;
    since = core::Stopwatch();
    std::string left = progress.seconds_left ? ", about " + duration_text(*progress.seconds_left) + " left" : "";
    if (!progress.text.empty()) left += ", " + progress.text;
    const std::string percent = fixed_text(100.0 * fraction, 0) + " %";
    // The last column stays free: some terminals begin a new line behind it, which the bar could not take back.
    const std::size_t columns = terminal_columns() - 1;
    if (!terminal) {
      std::fprintf(stderr, "%s\n", fitted(what + ": " + percent + left, columns).c_str());
      return;
    }
    // The bar gives way to the words.
    const std::size_t words = what.size() + percent.size() + left.size() + 4;
    const std::size_t bar_width = std::min<std::size_t>(30, columns - std::min(columns, words));
    std::string bar;
    if (bar_width >= 10) {
      const auto filled = static_cast<std::size_t>(std::lround(fraction * static_cast<double>(bar_width)));
      bar = "[" + std::string(filled, '#') + std::string(bar_width - filled, '.') + "] ";
    }
    std::fprintf(stderr, "\r\033[K%s", fitted(what + " " + bar + percent + left, columns).c_str());
    std::fflush(stderr);
    bar_open_ = true;
  };
}

void VerbContext::end_progress() {
  if (std::exchange(bar_open_, false)) std::fprintf(stderr, "\n");
}

void VerbContext::print(const nlohmann::ordered_json& document, const std::string& text) {
  end_progress();
  // Bytes that are not UTF-8 (a file name, say) are replaced, not thrown on.
  write_out(options_.json ? belief::json_text(document, 2) + "\n" : interfaces::printable_lines(text));
  printed_ = true;
}

void VerbContext::print_line(const nlohmann::ordered_json& document, const std::string& text) {
  end_progress();
  write_out(options_.json ? belief::json_text(document) + "\n" : interfaces::printable_lines(text));
  printed_lines_ = true;
}

void VerbContext::write_out(const std::string& out) {
  const bool written = std::fwrite(out.data(), 1, out.size(), stdout) == out.size();
  if (!written || std::fflush(stdout) != 0) print_failed_ = true;
}

ExitCode VerbContext::finish(const std::string& verb, core::Status status) {
  end_progress();
  if (!status.ok() && options_.json && !printed_) {
    // Where each document is a line, the error is one, too.
    write_out(printed_lines_ ? belief::json_text(belief::error_to_json(status)) + "\n" : error_document(status));
  }
  if (print_failed_) {
    const std::string text = "standard output can't be written: is the disk full, or was the pipe closed?";
    if (status.ok())
      status = core::unavailable(text);
    else
      std::fprintf(stderr, "prescene %s: %s\n", verb.c_str(), text.c_str());
  }
  if (!status.ok())
    std::fprintf(stderr, "prescene %s: %s\n", verb.c_str(), interfaces::printable_lines(to_string(status)).c_str());
  return exit_code_of(status);
}

std::string error_document(const core::Status& status) {
  return belief::json_text(belief::error_to_json(status), 2) + "\n";
}

CLI::Validator positive_number() {
  return {[](std::string& text) -> std::string {
            const std::optional<double> value = interfaces::finite_number(text);
            return value && *value > 0.0 ? "" : "a number above 0 is needed, not '" + text + "'";
          },
          "POSITIVE"};
}

CLI::Validator number_between(double low, double high) {
  const std::string range = core::rounded_text(low) + " to " + core::rounded_text(high);
  return {[low, high, range](std::string& text) -> std::string {
            const std::optional<double> value = interfaces::finite_number(text);
            return value && *value >= low && *value <= high
                       ? ""
                       : "a number from " + range + " is needed, not '" + text + "'";
          },
          range};
}

CLI::Validator in_range(const belief::ScalarRange& range) {
  return {[range](std::string& text) -> std::string {
            const std::optional<double> value = interfaces::finite_number(text);
            if (!value) return "a number is needed, not '" + text + "'";
            return belief::check_number(*value, range).message();
          },
          core::rounded_text(range.low) + " to " + core::rounded_text(range.high)};
}

CLI::Validator one_of(std::vector<std::string> words) {
  std::string known;
  for (const std::string& word : words) known += (known.empty() ? "{" : ",") + word;
  return {[words = std::move(words)](std::string& text) -> std::string {
            if (std::find(words.begin(), words.end(), text) != words.end()) return "";
            return interfaces::quote(text) + " is not known here: " + interfaces::suggestion(text, words);
          },
          known + "}"};
}

CLI::Validator utf8_text() {
  return {[](std::string& text) -> std::string {
            const std::optional<std::size_t> byte = core::not_utf8_at(text);
            return byte ? interfaces::quote(text) + " is not UTF-8 (byte " + std::to_string(*byte) +
                              "): give text in that encoding"
                        : "";
          },
          "", "UTF-8"};
}

CLI::Validator file_name() {
  return {[](std::string& text) -> std::string {
            if (text.empty()) return "a file name is needed, not ''";
            if (text.front() != '-') return "";
            return "a file name is needed before the option " + text + "; a file of that name is ./" + text;
          },
          "", "file name"};
}

std::string counted(std::size_t number, const std::string& thing) {
  return std::to_string(number) + " " + thing + (number == 1 ? "" : "s");
}

std::string table(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::string line;
    for (std::size_t i = 0; i < rows[r].size(); ++i) {
      line += rows[r][i];
      if (i + 1 < rows[r].size()) line += std::string(widths[i] - rows[r][i].size() + 2, ' ');
    }
    text += line + "\n";
    if (r > 0) continue;
    for (std::size_t i = 0; i < widths.size(); ++i) {
      text += std::string(widths[i], '-') + (i + 1 < widths.size() ? "  " : "\n");
    }
  }
  return text;
}

}  // namespace prescene::service
