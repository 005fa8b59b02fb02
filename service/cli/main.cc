// SPDX-License-Identifier: Apache-2.0
// The program: reads the arguments, runs one verb, says how it went.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <vector>

#include "verb.h"

namespace {

prescene::core::Cancellation cancellation;

// The first Ctrl-C asks the work to stop and keep what is done; a second one ends the program at once.
extern "C" void on_interrupt(int signal_number) {
  cancellation.request();
  std::signal(signal_number, SIG_DFL);
}

void add_common_options(CLI::App& verb, prescene::service::CommonOptions& options) {
  auto* group = verb.add_option_group("Common", "Options of every verb");
  group->add_flag("--json", options.json, "Print one JSON document on stdout; everything else goes to stderr");
  group->add_option("--seed", options.seed, "Seed of all random numbers; the same seed and input give the same answer")
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
  CLI::App app(
      "Prescene keeps a belief about the objects in front of a robot and looks ahead of it.\n"
      "Exit codes: 0 = done, 1 = could not do it, 2 = bad arguments or bad input.");
  app.name("prescene");
  app.set_version_flag("--version", PRESCENE_VERSION);
  app.require_subcommand(1);

  service::CommonOptions options;
  const std::vector<service::Verb> verbs = {
      service::add_validate_verb(app), service::add_predict_verb(app),  service::add_inspect_verb(app),
      service::add_record_verb(app),   service::add_replay_verb(app),   service::add_serve_verb(app),
      service::add_ask_verb(app),      service::add_evaluate_verb(app),
  };
  for (const service::Verb& verb : verbs) add_common_options(*verb.app, options);

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    app.exit(error);
    return static_cast<int>(service::ExitCode::kBadInput);
  }

  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  std::signal(SIGPIPE, SIG_IGN);
  for (const service::Verb& verb : verbs) {
    if (!verb.app->parsed()) continue;
    service::VerbContext context(options, cancellation);
    const core::Status status = verb.run(context);
    context.end_progress();
    if (!status.ok())
      std::fprintf(stderr, "prescene %s: %s\n", verb.app->get_name().c_str(), to_string(status).c_str());
    return static_cast<int>(service::exit_code_of(status));
  }
  return static_cast<int>(service::ExitCode::kBadInput);
}
