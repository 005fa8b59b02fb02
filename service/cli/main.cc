// SPDX-License-Identifier: Apache-2.0
// The program: reads the arguments, runs one verb, says how it went.
#include <fcntl.h>
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include "prescene/core/spelling.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/scene_files/problems.h"
#include "verb.h"

namespace {

prescene::core::Cancellation cancellation;

extern "C" void end_at_once(int signal_number) {
  prescene::interfaces::remove_files_beside();
  std::signal(signal_number, SIG_DFL);
  std::raise(signal_number);
}

// The first Ctrl-C asks the work to stop and keep what is done; a second one ends the program at once, without files
// that are no use to anybody.
extern "C" void on_interrupt(int signal_number) {
  cancellation.request();
  std::signal(signal_number, end_at_once);
}

// Where a terminal ends, its shell says so, and the kernel does once more: neither is a second wish.
extern "C" void on_hangup(int) { cancellation.request(); }

/// A file that is opened later would become standard output or error where that is closed, and what is printed would
/// go into it.
void open_standard_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) >= 0 || errno != EBADF) continue;
    // The lowest free number is this one: those below it are open.
    if (open("/dev/null", descriptor == STDIN_FILENO ? O_RDONLY : O_WRONLY) < 0) std::_Exit(1);
  }
}

void handle_signals() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  // nohup has it ignored, and so it stays.
  if (std::signal(SIGHUP, on_hangup) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // Writing beyond the limit is then an error like that of a full disk.
  std::signal(SIGCHLD, SIG_DFL);  // Whoever started us may ignore it, and no child's exit code could be had.
}

/// The libraries below throw where memory ends; everything else is a Status, or a bug that should not look like a
/// crash.
prescene::core::Status run(const prescene::service::Verb& verb, prescene::service::VerbContext& context) {
  try {
    return verb.run(context);
  } catch (const std::bad_alloc&) {
    return prescene::core::unavailable("out of memory: give smaller images, meshes or limits");
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again)
      return prescene::core::unavailable("no more threads can be made: give a smaller --threads, or raise `ulimit -u`");
    return prescene::core::unavailable(std::string("the system refused: ") + error.what());
  } catch (const std::exception& error) {
    return prescene::core::unavailable(std::string("a library gave up: ") + error.what() +
                                       ": this is a bug of prescene, please report it with the command");
  }
}

/// CLI11 only says that a verb is missing.
void check_verb(const CLI::App& app, const std::string& word) {
  if (word.empty() || word.front() == '-') return;
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (verb->get_name() == word) return;
    verbs.push_back(verb->get_name());
  }
  throw CLI::ExtrasError("there is no verb '" + word + "': " + prescene::interfaces::suggestion(word, verbs),
                         CLI::ExitCodes::ExtrasError);
}

/// Where an option of the command line is none of the verb's (or of the program's, before a verb): its name, and the
/// one that is nearest. CLI11 names it only if nothing else is wrong, and never says what was meant. To be asked only
/// where parsing failed, as it takes what follows an option for its value.
std::string unknown_option(const CLI::App& app, int argc, char** argv) {
  const CLI::App* verb = &app;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") break;
    if (verb == &app) {
      for (const CLI::App* known : app.get_subcommands([](const CLI::App*) { return true; }))
        if (known->get_name() == word) verb = known;
    }
    if (!word.starts_with("--")) continue;
    const std::string name = word.substr(0, word.find('='));
    std::vector<std::string> names;
    const auto add_names = [&names](const CLI::App& of) {
      for (const CLI::Option* option : of.get_options())
        for (const std::string& long_name : option->get_lnames()) names.push_back("--" + long_name);
    };
    add_names(*verb);
    for (const CLI::App* group : verb->get_subcommands([](const CLI::App* of) { return of->get_name().empty(); }))
      add_names(*group);
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    const bool near = !prescene::core::nearest_words(name, names).empty();
    return "there is no option '" + name + "'" + (near ? ": " + prescene::interfaces::suggestion(name, names) : "");
  }
  return "";
}

void add_common_options(CLI::App& verb, prescene::service::CommonOptions& options) {
  auto* group = verb.add_option_group("Common", "Options of every verb");
  group->add_flag("--json", options.json, "Print one JSON document on stdout; everything else goes to stderr");
  // CLI11 wraps negative numbers around.
  const CLI::Validator whole_number(
      [](std::string& text) -> std::string {
        const bool digits = !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
        errno = 0;
        std::strtoull(text.c_str(), nullptr, 10);
        return digits && errno == 0 ? ""
                                    : "a whole number from 0 to 18446744073709551615 is needed, not '" + text + "'";
      },
      "");
  group->add_option("--seed", options.seed, "Seed of all random numbers; the same seed and input give the same answer")
      ->check(whole_number)
      ->each([&options](const std::string&) { options.seed_given = true; })
      ->capture_default_str();
  group->add_option("--threads", options.threads, "Threads to use, 0 = all of the machine; does not change any answer")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  group->add_flag("-q,--quiet", options.quiet, "No progress; warnings and errors only");
}

}  // namespace

int main(int argc, char** argv) {
  using namespace prescene;
  open_standard_streams();
  CLI::App app(
      "Tracks known objects with an RGB-D camera and predicts, with probabilities, what happens next.\n"
      "Exit codes: 0 = done, 1 = could not do it, 2 = bad arguments or bad input.");
  app.name("prescene");
  app.set_version_flag("--version", PRESCENE_VERSION);
  app.require_subcommand(1);

  service::CommonOptions options;
  const std::vector<service::Verb> verbs = {
      service::add_validate_verb(app), service::add_predict_verb(app),  service::add_inspect_verb(app),
      service::add_doctor_verb(app),   service::add_record_verb(app),   service::add_replay_verb(app),
      service::add_explain_verb(app),  service::add_serve_verb(app),    service::add_ask_verb(app),
      service::add_achieve_verb(app),  service::add_view_verb(app),     service::add_train_verb(app),
      service::add_demo_verb(app),     service::add_evaluate_verb(app), service::add_calibrate_verb(app),
  };
  for (const service::Verb& verb : verbs) add_common_options(*verb.app, options);

  try {
    if (argc > 1) check_verb(app, argv[1]);
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    const int code = app.exit(success);
    return std::cout.flush() ? code : static_cast<int>(service::ExitCode::kFailed);
  } catch (const CLI::ParseError& error) {
    const std::string unknown = unknown_option(app, argc, argv);
    const std::string what = unknown.empty() ? error.what() : unknown;
    if (unknown.empty()) {
      app.exit(error);
    } else {
      app.exit(CLI::ExtrasError(unknown, CLI::ExitCodes::ExtrasError));
    }
    const bool json = std::any_of(argv + 1, argv + argc, [](const char* arg) { return std::string(arg) == "--json"; });
    if (json) std::fputs(service::error_document(core::invalid_input(what)).c_str(), stdout);
    return static_cast<int>(service::ExitCode::kBadInput);
  }

  handle_signals();
  for (const service::Verb& verb : verbs) {
    if (!verb.app->parsed()) continue;
    service::VerbContext context(options, cancellation);
    return static_cast<int>(context.finish(verb.app->get_name(), run(verb, context)));
  }
  return static_cast<int>(service::ExitCode::kBadInput);
}
