// SPDX-License-Identifier: Apache-2.0
// The verb `view` as a user runs it: the page is there, Ctrl-C ends it well, a port in use is named.
#include <signal.h>

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "prescene/interfaces/web/web_server.h"
#include "program.h"
#include "tests/interfaces/web/web_client.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::tests::view_test {
namespace {

using interfaces::WebServer;

TEST(ViewVerb, APortInUseIsNamedWithTheRemedy) {
  const ScratchDir folder;
  const std::string recording = (folder.path() / "box.mcap").string();
  ASSERT_TRUE(record_scene(box_on_table("0.3"), {"scene.yaml", box_on_table("0.3"), 1, ""}, 10.0, recording).ok());
  const auto taken = WebServer::create({}, {}, {}, {});
  ASSERT_TRUE(taken.ok());
  const std::string port = std::to_string((*taken)->port());
  for (const std::vector<std::string>& args :
       {std::vector<std::string>{"view", recording, "--port", port, "--json"}, {"view", "--port", port, "--json"}}) {
    const Finished finished = run_program(args, {own_bus()});
    EXPECT_EQ(finished.exit_code, 1) << finished.err;
    EXPECT_NE(finished.err.find("port " + port + " of 127.0.0.1 is in use: give another port"), std::string::npos)
        << finished.err;
    EXPECT_EQ(nlohmann::json::parse(finished.out, nullptr, false).value("code", ""), "unavailable") << finished.out;
  }
}

TEST(ViewVerb, ServesThePageUntilItIsStopped) {
  const ScratchDir folder;
  const std::string recording = (folder.path() / "box.mcap").string();
  ASSERT_TRUE(record_scene(box_on_table("0.3"), {"scene.yaml", box_on_table("0.3"), 1, ""}, 10.0, recording).ok());
  for (const std::vector<std::string>& args :
       {std::vector<std::string>{"view", recording}, std::vector<std::string>{"view"}}) {
    // It says which port it has got: one that was free a moment ago may be another's by now.
    const std::filesystem::path said = folder.path() / ("said" + std::to_string(args.size()));
    std::vector<std::string> words = {"-c", "exec \"$0\" \"$@\" >'" + said.string() + "'",
                                      (build_dir() / "prescene").string()};
    words.insert(words.end(), args.begin(), args.end());
    words.insert(words.end(), {"--port", "0", "--json"});
    BackgroundProgram program("/bin/sh", words, {own_bus()}, (folder.path() / "err.txt").string());
    nlohmann::json ready;
    while (!ready.is_object() && !program.has_ended()) {
      std::this_thread::yield();
      ready = nlohmann::json::parse(read_file(said), nullptr, false);
    }
    ASSERT_TRUE(ready.is_object()) << read_file(folder.path() / "err.txt");
    EXPECT_EQ(ready.value("state", ""), "ready");
    interfaces::WebClientSocket client(ready.value("port", 0));
    client.send(interfaces::get_request("/"));
    const std::string answer = client.read_all();
    EXPECT_TRUE(answer.starts_with("HTTP/1.1 200 ")) << answer;
    EXPECT_NE(answer.find("<title>Prescene</title>"), std::string::npos);
    EXPECT_EQ(program.stop(SIGINT), 0);
  }
}

TEST(ViewVerb, RefusesOptionsThatWouldDoNothing) {
  for (const std::vector<std::string>& args : {std::vector<std::string>{"view", "--salvage"},
                                               {"view", "--depth-scale", "0.01"},
                                               {"view", "x.mcap", "--domain", "3"},
                                               {"view", "x.mcap", "--port", "70000"},
                                               {"view", "x.mcap"},
                                               {"view", "--address", "robot"},
                                               {"view", "--token", "a b"}}) {
    const Finished finished = run_program(args, {own_bus()});
    EXPECT_EQ(finished.exit_code, 2) << args.back() << ": " << finished.err;
    EXPECT_FALSE(finished.err.empty());
  }
}

}  // namespace
}  // namespace prescene::tests::view_test
