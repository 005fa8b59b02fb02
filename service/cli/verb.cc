// SPDX-License-Identifier: Apache-2.0
#include "verb.h"

#include <fcntl.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/clock.h"
#include "prescene/core/text.h"
#include "prescene/core/utf8.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/scene_files/problems.h"
#include "prescene/service/recording/recording.h"

namespace prescene::service {
namespace {

using core::fixed_text;

core::LogSink stderr_log(bool quiet) {
  auto logger = std::make_shared<spdlog::logger>("prescene", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  logger->set_pattern("%^%l%$: %v");
  logger->set_level(quiet ? spdlog::level::warn : spdlog::level::info);
  return [logger](core::LogLevel level, const std::string& text) {
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

std::optional<double> finite_number(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || end != text.c_str() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
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

/// Whether one of our own descriptors, such as standard output, is this pipe.
bool is_open_here(const struct stat& pipe) {
  constexpr int kMostDescriptors = 256;
  for (int descriptor = 0; descriptor < kMostDescriptors; ++descriptor) {
    struct stat of {};
    if (fstat(descriptor, &of) == 0 && of.st_dev == pipe.st_dev && of.st_ino == pipe.st_ino) return true;
  }
  return false;
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
  const std::string out = options_.json ? belief::json_text(document, 2) + "\n" : text;
  write_out(out);
  printed_ = true;
}

void VerbContext::print_line(const nlohmann::ordered_json& document, const std::string& text) {
  end_progress();
  write_out(options_.json ? belief::json_text(document) + "\n" : text);
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
  if (!status.ok()) std::fprintf(stderr, "prescene %s: %s\n", verb.c_str(), to_string(status).c_str());
  return exit_code_of(status);
}

std::string error_document(const core::Status& status) {
  return belief::json_text(belief::error_to_json(status), 2) + "\n";
}

CLI::Validator positive_number() {
  return {[](std::string& text) -> std::string {
            const std::optional<double> value = finite_number(text);
            return value && *value > 0.0 ? "" : "a number above 0 is needed, not '" + text + "'";
          },
          "POSITIVE"};
}

CLI::Validator number_between(double low, double high) {
  const std::string range = core::rounded_text(low) + " to " + core::rounded_text(high);
  return {[low, high, range](std::string& text) -> std::string {
            const std::optional<double> value = finite_number(text);
            return value && *value >= low && *value <= high
                       ? ""
                       : "a number from " + range + " is needed, not '" + text + "'";
          },
          range};
}

CLI::Validator in_range(const belief::ScalarRange& range) {
  return {[range](std::string& text) -> std::string {
            const std::optional<double> value = finite_number(text);
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

bool names_bag(const std::string& output) { return output.size() > 1 && output.ends_with('/'); }

std::filesystem::path folder_of_bag(const std::string& output) {
  const std::filesystem::path path = std::filesystem::path(output).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

std::filesystem::path first_file_of_bag(const std::filesystem::path& folder) {
  return folder / (folder.filename().string() + "_0.mcap");
}

core::Status check_part_limits(const std::string& output, const PartLimits& limits) {
  if (!names_bag(output) || limits.keep_bytes == 0) return core::ok_status();
  return core::invalid_input("--keep-megabytes bounds files beside each other, and " + output +
                             " is a folder of its own: name a file (without the slash)");
}

std::string live_recording_path(const std::string& asked, VerbContext& context) {
  if (names_bag(asked)) {
    const std::filesystem::path folder = folder_of_bag(asked);
    std::filesystem::path unused = folder;
    std::error_code none;
    for (int i = 2; std::filesystem::exists(std::filesystem::symlink_status(unused, none)); ++i)
      unused.replace_filename(folder.filename().string() + "-" + std::to_string(i));
    if (unused != folder)
      core::log(context.log(), core::LogLevel::kWarning, asked + " exists: recording to " + unused.string() + "/");
    return first_file_of_bag(unused).string();
  }
  std::string unused = unused_recording_path(asked).string();
  if (unused != asked) core::log(context.log(), core::LogLevel::kWarning, asked + " exists: recording to " + unused);
  return unused;
}

core::Status check_apart(const std::string& option, const std::string& output, const std::string& other_option,
                         const std::string& other) {
  if (output.empty() || other.empty()) return core::ok_status();
  std::error_code none;
  const auto place = [&](const std::string& file) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(file, none), none);
  };
  if (!std::filesystem::equivalent(output, other, none) && place(output) != place(other)) return core::ok_status();
  return core::invalid_input(option + " and " + other_option + " name the same file " + other + ": name two");
}

core::Status check_output(const std::string& option, const std::string& output,
                          const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code none;
    if (output.empty() || input.empty() || !std::filesystem::equivalent(output, input, none)) continue;
    return core::invalid_input(option + " " + output + " is the input too and would be overwritten: name another file");
  }
  if (output.empty()) return core::ok_status();
  const std::string wont = option + " " + output + ": can't be written: ";
  std::error_code none;
  if (std::filesystem::is_directory(output, none)) return core::unavailable(wont + "it is a folder; name a file in it");
  std::filesystem::path folder = std::filesystem::path(output).parent_path();
  if (folder.empty()) folder = ".";
  if (!std::filesystem::is_directory(folder, none))
    return core::unavailable(wont + "there is no folder " + folder.string() + "; make it, or name another place");
  if (std::filesystem::is_character_file(output, none)) {
    // A device that takes nothing says so when nothing is written.
    const int device = open(output.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY);
    const bool takes = device >= 0 && write(device, "", 0) == 0;
    const std::string why = std::strerror(errno);
    if (device >= 0) close(device);
    return takes ? core::ok_status() : core::unavailable(wont + why + "; name another file");
  }
  struct stat there {};
  if (stat(output.c_str(), &there) != 0 && errno != ENOENT)
    return core::unavailable(wont + std::strerror(errno) + "; name another place");
  if (std::filesystem::exists(output, none) && !S_ISREG(there.st_mode)) {
    // Nobody may read from a pipe with a name, and opening it would wait for ever. Standard output's is open already.
    if (S_ISFIFO(there.st_mode) && is_open_here(there)) return core::ok_status();
    return core::unavailable(wont + "it is no regular file; name one, or /dev/stdout to send it through a pipe");
  }
  if (std::filesystem::exists(output, none) && access(output.c_str(), W_OK) != 0)
    return core::unavailable(wont + std::strerror(errno) + "; name another place");
  const std::filesystem::path target = std::filesystem::weakly_canonical(output, none);
  const auto aside = interfaces::create_beside(none ? std::filesystem::path(output) : target, output);
  if (!aside) return core::unavailable(option + " " + aside.status().message());
  std::filesystem::remove(*aside, none);
  return core::ok_status();
}

core::Status check_png(const std::string& option, const std::string& output) {
  const std::filesystem::path extension = std::filesystem::path(output).extension();
  if (extension.empty() || extension == ".png" || extension == ".PNG") return core::ok_status();
  return core::invalid_input(option + " " + output +
                             ": the picture is written as PNG: give it a name that ends in .png");
}

core::Status check_recording(const std::string& option, const std::string& output,
                             const std::vector<std::string>& inputs) {
  if (output.empty()) return core::ok_status();
  std::error_code none;
  if (names_bag(output)) {
    const std::filesystem::path bag = folder_of_bag(output);
    const std::string name = bag.filename().string();
    if (name.empty() || name == "." || name == "..")
      return core::invalid_input(option + " " + output + ": names no new folder; a bag has one of its own");
    if (std::filesystem::exists(bag, none) && !std::filesystem::is_directory(bag, none))
      return core::invalid_input(option + " " + output + ": is no folder; name another, or a file (without the slash)");
    const std::filesystem::path above = bag.parent_path();
    if (!above.empty() && !std::filesystem::is_directory(above, none))
      return core::unavailable(option + " " + output + ": there is no folder " + above.string() + "; make it first");
    return core::ok_status();
  }
  const std::filesystem::path place = std::filesystem::absolute(output, none).lexically_normal();
  const std::filesystem::path folder = std::filesystem::weakly_canonical(place.parent_path(), none);
  const bool is_other = std::filesystem::exists(output, none) && !std::filesystem::is_regular_file(output, none);
  // Redirected to a file, /dev/stdout looks like one, but belongs to who redirected it.
  if (is_other || folder == "/dev" || folder == std::filesystem::weakly_canonical("/dev/fd", none))
    return core::invalid_input(option + " " + output + ": is no file: a recording is a file of its own; name one");
  return check_output(option, output, inputs);
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
