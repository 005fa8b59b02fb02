// SPDX-License-Identifier: Apache-2.0
// Runs the built program as a user does.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace prescene::tests {

struct Finished {
  int exit_code = -1;  ///< 128 + signal when it was killed by one.
  std::string out;
  std::string err;
  std::int64_t most_memory = 0;  ///< Bytes that were in memory at once, at most.
};

/// Runs `prescene args...` to its end. `environment` is added to ours ("NAME=value").
Finished run_program(const std::vector<std::string>& args, const std::vector<std::string>& environment = {});

/// The exit code of a run whose standard output goes to that file.
int run_program_writing_to(const std::string& out, const std::vector<std::string>& args);

/// What a run writes to its standard error where that is a terminal of so many columns.
std::string run_program_in_terminal(const std::vector<std::string>& args, int columns);

/// A program that runs beside the test; killed with the object if it still runs.
class BackgroundProgram {
 public:
  /// `prescene args...`, its output thrown away.
  explicit BackgroundProgram(const std::vector<std::string>& args, const std::vector<std::string>& environment = {});
  /// Another program; its standard error goes to the file `err`.
  BackgroundProgram(const std::filesystem::path& program, const std::vector<std::string>& args,
                    const std::vector<std::string>& environment, const std::string& err);
  ~BackgroundProgram();
  BackgroundProgram(const BackgroundProgram&) = delete;
  BackgroundProgram& operator=(const BackgroundProgram&) = delete;

  /// -1 once it was stopped.
  pid_t pid() const { return pid_; }
  void signal(int signal_number) const;
  /// Whether it has ended by itself. stop() then gives its exit code.
  bool has_ended() const;
  /// Sends a signal and waits for the end; the exit code as above.
  int stop(int signal_number);

 private:
  pid_t pid_ = -1;
};

void write_file(const std::filesystem::path& path, const std::string& text);
std::string read_file(const std::filesystem::path& path);

/// The domain of this process (tests/support/bus_domain.h) for the environment: "ROS_DOMAIN_ID=n".
std::string own_bus();

}  // namespace prescene::tests
