// SPDX-License-Identifier: Apache-2.0
// The verb `view` as a user runs it: the page is there, Ctrl-C ends it well, a port in use is named.
#include <signal.h>

#include <gtest/gtest.h>

#include <chrono>
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
  const std::string out = (folder.path() / "err.txt").string();
  ASSERT_TRUE(record_scene(box_on_table("0.3"), {"scene.yaml", box_on_table("0.3"), 1, ""}, 10.0, recording).ok());
  // A port that was free a moment ago.
  const int port = [] {
    const auto probe = WebServer::create({}, {}, {}, {});
    return probe ? (*probe)->port() : 0;
  }();
  for (const std::vector<std::string>& args :
       {std::vector<std::string>{"view", recording}, std::vector<std::string>{"view"}}) {
    std::vector<std::string> with_port = args;
    with_port.insert(with_port.end(), {"--port", std::to_string(port)});
    BackgroundProgram program(with_port, {own_bus()});
    std::string answer;
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (answer.empty() && std::chrono::steady_clock::now() < until) {
      interfaces::WebClientSocket client(port, 0, /*must_connect=*/false);
      client.send(interfaces::get_request("/"));
      answer = client.read_all();
      if (answer.empty()) std::this_thread::yield();
    }
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
