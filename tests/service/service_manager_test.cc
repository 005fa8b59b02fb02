// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/service_manager.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "tests/service/listening_manager.h"
#include "tests/support/paths.h"

namespace prescene::service {
namespace {

using ::testing::ElementsAre;

class ServiceManagerTest : public ::testing::TestWithParam<bool> {
 protected:
  /// In a folder, or abstract.
  std::string name() const {
    return GetParam() ? "@prescene-test-" + std::to_string(getpid()) : (folder_.path() / "notify").string();
  }

  tests::ScratchDir folder_;
};

TEST_P(ServiceManagerTest, HearsThatTheServiceIsReadyOnceAndHowItIs) {
  const tests::ListeningManager listener(name());
  ServiceManager manager({.socket = name(), .watchdog_seconds = {}});
  manager.note_turn();
  manager.note_turn();
  manager.tell_status("waiting for frames\non /depth");
  manager.note_turn();
  manager.tell_stopping();
  EXPECT_THAT(listener.heard(), ElementsAre("READY=1", "STATUS=waiting for frames on /depth", "STOPPING=1"));
}

TEST_P(ServiceManagerTest, IsToldOftenEnoughThatTheServiceIsAliveAndNotWithEachTurn) {
  const tests::ListeningManager listener(name());
  {
    ServiceManager manager({.socket = name(), .watchdog_seconds = 3600.0});
    for (int i = 0; i < 5; ++i) manager.note_turn();
    EXPECT_THAT(listener.heard(), ElementsAre("READY=1", "WATCHDOG=1"));
  }
  ServiceManager manager({.socket = name(), .watchdog_seconds = 1e-9});
  for (int i = 0; i < 3; ++i) manager.note_turn();
  EXPECT_THAT(listener.heard(), ElementsAre("READY=1", "WATCHDOG=1", "WATCHDOG=1", "WATCHDOG=1"));
}

TEST_P(ServiceManagerTest, IsToldAgainWhatItsSocketDidNotTake) {
  ServiceManager manager({.socket = name(), .watchdog_seconds = {}});
  manager.note_turn();  // nobody listens yet
  const tests::ListeningManager listener(name());
  manager.note_turn();
  EXPECT_THAT(listener.heard(), ElementsAre("READY=1"));
}

INSTANTIATE_TEST_SUITE_P(Sockets, ServiceManagerTest, ::testing::Bool());

TEST(ServiceManager, NamesThatAreNoneTellNothing) {
  for (const std::string& name :
       {std::string(), std::string("@"), std::string("relative"), "/" + std::string(200, 'x')}) {
    ServiceManager manager({.socket = name, .watchdog_seconds = 1e-9});
    manager.note_turn();
    manager.tell_status("well");
    manager.tell_stopping();
  }
}

class ManagerOfEnvironment : public ::testing::Test {
 protected:
  void TearDown() override {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) unsetenv(name);
  }
};

TEST_F(ManagerOfEnvironment, TakesAWatchdogThatIsMeantForThisProcess) {
  EXPECT_EQ(manager_of_environment().socket, "");
  setenv("NOTIFY_SOCKET", "/run/notify", 1);
  setenv("WATCHDOG_USEC", "30000000", 1);
  EXPECT_EQ(manager_of_environment().socket, "/run/notify");
  EXPECT_EQ(manager_of_environment().watchdog_seconds, 30.0);
  setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  EXPECT_EQ(manager_of_environment().watchdog_seconds, 30.0);
  setenv("WATCHDOG_PID", std::to_string(getppid()).c_str(), 1);
  EXPECT_EQ(manager_of_environment().watchdog_seconds, std::nullopt);
}

TEST_F(ManagerOfEnvironment, TakesNoWatchdogThatIsNotATime) {
  for (const char* text : {"", "0", "-1", "1e6", "30 s", "99999999999999999999999"}) {
    setenv("WATCHDOG_USEC", text, 1);
    EXPECT_EQ(manager_of_environment().watchdog_seconds, std::nullopt) << text;
  }
}

}  // namespace
}  // namespace prescene::service
