// SPDX-License-Identifier: Apache-2.0
// The main job end to end, as a robot would use it: each step is this program, run as a user would run it.
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "demo_scene.h"
#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/reports/report.h"
#include "prescene/service/load_scene.h"
#include "verb.h"

extern char** environ;

namespace prescene::service {
namespace {

using core::fixed_text;
using Arguments = std::vector<std::string>;

constexpr const char* kThisMachine = "lo";                  // keeps the demo out of the robot's way
constexpr std::size_t kMostPrinted = std::size_t{1} << 20;  // bytes of an answer

struct DemoOptions {
  std::string folder = "prescene_demo";
};

/// A verb of this program in a process of its own, which is interrupted and waited for if nobody did.
class RunningVerb {
 public:
  /// Its answers go into the file `into`, if any, or to stderr with `quiet_stdout`.
  static core::Result<RunningVerb> start(const Arguments& arguments, bool quiet_stdout, const std::string& into = "") {
    Arguments words = {"prescene"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    if (!into.empty())
      posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, into.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    else if (quiet_stdout)
      posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
    pid_t process = -1;
    const int error = ::posix_spawn(&process, "/proc/self/exe", &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0)
      return core::unavailable("prescene " + arguments[0] + " cannot be started: " + std::strerror(error));
    return RunningVerb(process, arguments[0]);
  }
  RunningVerb(RunningVerb&& other) noexcept
      : process_(std::exchange(other.process_, -1)), name_(std::move(other.name_)) {}
  RunningVerb& operator=(RunningVerb&&) = delete;
  ~RunningVerb() {
    if (process_ > 0) static_cast<void>(stop());
  }

  core::Status stop() {
    ::kill(process_, SIGINT);
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
    return ended(status);
  }

  core::Status wait(const core::Cancellation& cancellation) {
    int status = 0;
    bool interrupted = false;
    while (true) {
      const pid_t done = ::waitpid(process_, &status, WNOHANG);
      if (done == process_) break;
      if (cancellation.requested() && !std::exchange(interrupted, true)) ::kill(process_, SIGINT);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    process_ = -1;
    if (interrupted) return core::cancelled("stopped on request");
    return ended(status);
  }

 private:
  RunningVerb(pid_t process, std::string name) : process_(process), name_(std::move(name)) {}
  core::Status ended(int status) const {
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return core::ok_status();
    return core::unavailable("prescene " + name_ + " did not end well: what it said is above");
  }

  pid_t process_;
  std::string name_;
};

/// What is asked while the recording is played: what happens if the hand lets go now, as the scene's robot does later.
std::string what_if_done_now(belief::Action action) {
  action.time = 0.0;
  return R"({"predict": {"actions": [)" + belief::json_text(belief::to_json(action)) +
         R"(], "effort": {"max_seconds": 0.8}}})";
}

/// The first lines, joined to one.
std::string first_lines(const std::string& text, int count) {
  std::string joined;
  std::size_t at = 0;
  for (int i = 0; i < count && at < text.size(); ++i) {
    const std::size_t begin = std::min(text.find_first_not_of(' ', at), text.size());
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    joined += (i == 0 ? "" : "; ") + text.substr(begin, end - begin);
    at = end + 1;
  }
  return joined;
}

class Demo {
 public:
  Demo(const std::string& folder, VerbContext& context) : folder_(folder), context_(context) {}

  core::Status run(const belief::Action& release) {
    const std::string scene = path("milk_on_bin.yaml"), milk = path("milk.mcap");
    PRESCENE_RETURN_IF_ERROR(step("what may happen, before anything was seen", {"predict", scene, "--seed", "1"}));
    const std::string where_to_let_go = "where must the hand let go, so that the carton lands in the bin?";
    PRESCENE_TRY(const std::string achieved,
                 answered(where_to_let_go,
                          {"achieve", scene, "--outcome", "in_bin", "--free", "position,pitch=-120:0,height=0:0.3",
                           "--first", "--seed", "1", "--report", path("achieve.html")}));
    PRESCENE_RETURN_IF_ERROR(step("record a simulated robot with an RGB-D camera",
                                  {"record", "--simulate", scene, "-o", milk, "--seed", "3"}));
    PRESCENE_RETURN_IF_ERROR(live(scene, milk, release));
    const std::string what_happened = "did anything happen about the release that the robot did not report?";
    PRESCENE_TRY(
        const std::string explained,
        answered(what_happened, {"explain", path("session.mcap"), "--from", fixed_text(release.time - 0.2, 2), "--to",
                                 fixed_text(release.time + 1.0, 2), "--seed", "1", "--report", path("explain.html")}));
    PRESCENE_RETURN_IF_ERROR(interfaces::add_section(
        path("report.html"),
        {"Asked of the scene, and of the recorded session",
         {interfaces::TextBlock{where_to_let_go}, interfaces::LinkBlock{first_lines(achieved, 2), "achieve.html"},
          interfaces::TextBlock{what_happened}, interfaces::LinkBlock{first_lines(explained, 1), "explain.html"}}}));
    return step("replay the session that the service recorded: the same bits", {"replay", path("session.mcap")});
  }

  std::string path(const std::string& name) const { return (std::filesystem::path(folder_) / name).string(); }

 private:
  void title(const std::string& text) const {
    std::FILE* out = context_.options().json ? stderr : stdout;
    std::fprintf(out, "\n== %s\n", text.c_str());
    std::fflush(out);
  }
  Arguments with_common(Arguments arguments) const {
    if (context_.options().threads > 0) {
      arguments.emplace_back("--threads");
      arguments.push_back(std::to_string(context_.options().threads));
    }
    if (context_.options().quiet) arguments.emplace_back("-q");
    return arguments;
  }
  core::Status verb(const Arguments& arguments) {
    PRESCENE_TRY(RunningVerb running, RunningVerb::start(with_common(arguments), context_.options().json));
    return running.wait(context_.cancellation());
  }
  core::Status step(const std::string& text, const Arguments& arguments) {
    title(text);
    return verb(arguments);
  }

  /// As step(); what the verb printed, which goes where it would have gone when it has ended.
  core::Result<std::string> answered(const std::string& text, const Arguments& arguments) {
    title(text);
    const std::string file = path(".printed_by_" + arguments[0]);
    PRESCENE_TRY(RunningVerb running, RunningVerb::start(with_common(arguments), context_.options().json, file));
    const core::Status ended = running.wait(context_.cancellation());
    const auto bytes = interfaces::read_file(file, kMostPrinted);
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
    if (!bytes) return ended.ok() ? bytes.status() : ended;
    const std::string printed(bytes->begin(), bytes->end());
    std::FILE* out = context_.options().json ? stderr : stdout;
    std::fputs(printed.c_str(), out);
    std::fflush(out);
    if (!ended.ok()) return ended;
    return printed;
  }

  core::Status live(const std::string& scene, const std::string& milk, const belief::Action& release) {
    const std::string on_the_way = fixed_text(0.5 * release.time, 2), just_before = fixed_text(release.time - 0.1, 2);
    title(
        "start the service and play the recording to it over DDS; it asks twice 'what if the carton is let go now?':\n"
        "at " +
        on_the_way + " s, still on the way to the bin, and at " + just_before +
        " s, just before the robot lets go of it at " + fixed_text(release.time, 1) + " s");
    std::error_code none;
    std::filesystem::remove(path("session.mcap"), none);
    PRESCENE_TRY(RunningVerb service, RunningVerb::start({"serve", "--scene", scene, "--seed", "1", "--record",
                                                          path("session.mcap"), "-q", "--interface", kThisMachine},
                                                         true));
    PRESCENE_RETURN_IF_ERROR(
        verb({"replay", milk, "--over-dds", "--interface", kThisMachine, "--report", path("report.html"), "--ask",
              R"(1.0:{"stability": {"object": "carton"}})", "--ask", on_the_way + ":" + what_if_done_now(release),
              "--ask", just_before + ":" + what_if_done_now(release), "--ask", R"(4.5:{"where": {}})"}));
    return service.stop();
  }

  std::string folder_;
  VerbContext& context_;
};

core::Status run(const DemoOptions& options, VerbContext& context) {
  std::error_code error;
  std::filesystem::create_directories(options.folder, error);
  if (error) return core::unavailable(options.folder + ": cannot be made: " + error.message());
  // A domain of its own keeps the demo out of that of a demo beside it.
  if (::setenv("ROS_DOMAIN_ID", std::to_string(100 + ::getpid() % 100).c_str(), 1) != 0)
    return core::unavailable("the environment cannot be changed");
  ::unsetenv("CYCLONEDDS_URI");  // how the robot's bus is set up is nothing to the demo
  Demo demo(options.folder, context);
  PRESCENE_RETURN_IF_ERROR(interfaces::write_file(demo.path("milk_on_bin.yaml"), demo_scene()));
  PRESCENE_TRY(const auto scene, load_scene(demo.path("milk_on_bin.yaml"), context.log()));
  PRESCENE_RETURN_IF_ERROR(demo.run(scene->actions.at(0)));
  const std::string report = demo.path("report.html");
  context.print({{"folder", options.folder},
                 {"scene", demo.path("milk_on_bin.yaml")},
                 {"recording", demo.path("milk.mcap")},
                 {"session", demo.path("session.mcap")},
                 {"report", report},
                 {"achieve_report", demo.path("achieve.html")},
                 {"explain_report", demo.path("explain.html")}},
                "\nreport: " + report + "\nof achieve and explain: " + demo.path("achieve.html") + ", " +
                    demo.path("explain.html") + "\n");
  return core::ok_status();
}

}  // namespace

Verb add_demo_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("demo",
                                  "Record a simulated robot that carries a carton over a bin, track it over DDS, ask "
                                  "what happens if it is let go");
  auto options = std::make_shared<DemoOptions>();
  verb->add_option("-o,--output", options->folder, "Folder for recordings and report")
      ->check(file_name())
      ->capture_default_str();
  verb->footer("Example: prescene demo -o /tmp/demo");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
