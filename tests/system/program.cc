// SPDX-License-Identifier: Apache-2.0
#include "program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/support/bus_domain.h"
#include "tests/support/paths.h"

extern char** environ;

namespace prescene::tests {
namespace {

std::filesystem::path prescene() { return build_dir() / "prescene"; }

pid_t start(const std::string& program, const std::vector<std::string>& args,
            const std::vector<std::string>& environment, const std::string& out, const std::string& err) {
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& arg : args) argv.push_back(const_cast<char*>(arg.c_str()));
  argv.push_back(nullptr);
  std::vector<char*> envp;
  for (const std::string& entry : environment) envp.push_back(const_cast<char*>(entry.c_str()));
  for (char** entry = environ; *entry != nullptr; ++entry) envp.push_back(*entry);
  envp.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  pid_t pid = -1;
  const int failed = posix_spawn(&pid, program.c_str(), &actions, nullptr, argv.data(), envp.data());
  posix_spawn_file_actions_destroy(&actions);
  EXPECT_EQ(failed, 0) << "can't start " << program;
  return failed == 0 ? pid : -1;
}

int wait_for_end(pid_t pid, std::int64_t* most_memory = nullptr) {
  int status = 0;
  rusage used{};
  if (pid <= 0 || wait4(pid, &status, 0, &used) != pid) return -1;
  if (most_memory != nullptr) *most_memory = std::int64_t{1024} * used.ru_maxrss;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

Finished run_program(const std::vector<std::string>& args, const std::vector<std::string>& environment) {
  const ScratchDir folder;
  Finished finished;
  finished.exit_code = wait_for_end(
      start(prescene(), args, environment, (folder.path() / "out").string(), (folder.path() / "err").string()),
      &finished.most_memory);
  finished.out = read_file(folder.path() / "out");
  finished.err = read_file(folder.path() / "err");
  return finished;
}

int run_program_writing_to(const std::string& out, const std::vector<std::string>& args) {
  return wait_for_end(start(prescene(), args, {}, out, "/dev/null"));
}

std::string run_program_in_terminal(const std::vector<std::string>& args, int columns) {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  EXPECT_TRUE(terminal >= 0 && grantpt(terminal) == 0 && unlockpt(terminal) == 0);
  winsize size{};
  size.ws_row = 24;
  size.ws_col = static_cast<unsigned short>(columns);
  EXPECT_EQ(ioctl(terminal, TIOCSWINSZ, &size), 0);
  const pid_t pid = start(prescene(), args, {}, "/dev/null", ptsname(terminal));
  std::string seen;
  // Reading fails when the program has ended and nothing is left.
  char bytes[4096];
  for (ssize_t count = 0; (count = read(terminal, bytes, sizeof bytes)) > 0;)
    seen.append(bytes, static_cast<std::size_t>(count));
  EXPECT_EQ(wait_for_end(pid), 0) << seen;
  close(terminal);
  return seen;
}

BackgroundProgram::BackgroundProgram(const std::vector<std::string>& args, const std::vector<std::string>& environment)
    : BackgroundProgram(prescene(), args, environment, "/dev/null") {}

BackgroundProgram::BackgroundProgram(const std::filesystem::path& program, const std::vector<std::string>& args,
                                     const std::vector<std::string>& environment, const std::string& err)
    : pid_(start(program, args, environment, "/dev/null", err)) {}

BackgroundProgram::~BackgroundProgram() { stop(SIGKILL); }

void BackgroundProgram::signal(int signal_number) const {
  if (pid_ > 0) kill(pid_, signal_number);
}

bool BackgroundProgram::has_ended() const {
  siginfo_t info{};
  return pid_ <= 0 ||
         (waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_signo == SIGCHLD);
}

int BackgroundProgram::stop(int signal_number) {
  if (pid_ <= 0) return -1;
  kill(pid_, signal_number);
  const int code = wait_for_end(pid_);
  pid_ = -1;
  return code;
}

void write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  ASSERT_TRUE(file.good()) << path;
}

std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string own_bus() { return "ROS_DOMAIN_ID=" + std::to_string(own_domain()); }

}  // namespace prescene::tests
