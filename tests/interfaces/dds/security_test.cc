// SPDX-License-Identifier: Apache-2.0
// DDS Security between processes, with the keys that tools/security_keys makes: who has no rights hears nothing and is
// not heard. Each group of participants has a talker of its own, so that it is known that its members were found.
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "prescene/interfaces/dds/dds_node.h"
#include "tests/support/bus_domain.h"
#include "tests/support/paths.h"

namespace prescene::interfaces::security_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kBelief = "/prescene/belief";

/// Not that of the other tests of this program: their nodes know no keys.
std::string secured_domain() {
  static const int kDomain = tests::another_domain();
  return std::to_string(kDomain);
}

/// A security_peer in a process of its own, killed at the end.
class Peer {
 public:
  Peer(const std::string& folder, const std::string& name, const std::string& does, const std::string& topic) {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    const std::string domain = secured_domain();
    pid_ = fork();
    if (pid_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      close(ends[0]);
      const std::string program = (tests::build_dir() / "tests" / "security_peer").string();
      execl(program.c_str(), program.c_str(), domain.c_str(), folder.c_str(), name.c_str(), does.c_str(), topic.c_str(),
            nullptr);
      _exit(127);
    }
    close(ends[1]);
    lines_ = fdopen(ends[0], "r");
  }
  ~Peer() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    fclose(lines_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  /// The next line that it prints; nothing once it has ended.
  std::optional<std::string> line() {
    char text[4096];
    if (fgets(text, sizeof text, lines_) == nullptr) return std::nullopt;
    std::string line(text);
    if (line.ends_with('\n')) line.pop_back();
    return line;
  }
  /// Whom it has heard by when it has heard `name` so often.
  std::set<std::string> heard_until(const std::string& name, int count) {
    std::set<std::string> heard;
    while (count > 0) {
      const auto next = line();
      if (!next) {
        heard.insert("it ended");
        break;
      }
      if (!next->starts_with("heard ")) continue;
      heard.insert(next->substr(6));
      if (*next == "heard " + name) --count;
    }
    return heard;
  }

 private:
  pid_t pid_ = 0;
  FILE* lines_ = nullptr;
};

class Security : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(keys("ours", "prescene:service robot:robot laptop:viewer"), 0);
    ASSERT_EQ(keys("theirs", "prescene:service laptop:viewer"), 0);
  }
  int keys(const std::string& folder, const std::string& participants) const {
    return std::system((tests::source_dir() / "tools/security_keys")
                           .string()
                           .append(" ")
                           .append((folder_.path() / folder).string() + " " + participants + " > /dev/null")
                           .c_str());
  }
  std::string enclave(const std::string& authority, const std::string& name) const {
    return (folder_.path() / authority / "enclaves" / name).string();
  }
  /// What a peer of ours prints first.
  std::string first_line(const std::string& name, const std::string& does, const std::string& topic) const {
    Peer peer(enclave("ours", name), name, does, topic);
    return peer.line().value_or("nothing");
  }
  tests::ScratchDir folder_;
};

TEST_F(Security, GroupsWithoutCommonRightsDoNotHearEachOther) {
  Peer open_talker("-", "open", "talk", kBelief);
  Peer their_talker(enclave("theirs", "prescene"), "theirs", "talk", kBelief);
  Peer open_listener("-", "open listener", "hear", kBelief);
  Peer their_listener(enclave("theirs", "laptop"), "their listener", "hear", kBelief);
  Peer our_talker(enclave("ours", "prescene"), "ours", "talk", kBelief);
  Peer our_listener(enclave("ours", "laptop"), "our listener", "hear", kBelief);
  EXPECT_THAT(our_listener.heard_until("ours", 50), ElementsAre("ours"));
  EXPECT_THAT(open_listener.heard_until("open", 200), ElementsAre("open"));
  EXPECT_THAT(their_listener.heard_until("theirs", 200), ElementsAre("theirs"));
  EXPECT_THAT(our_listener.heard_until("ours", 50), ElementsAre("ours"));
}

// PRESCENE_SECURITY_TRIES=10000 tries so often, each in a process of its own.
TEST_F(Security, WhoeverTriesAgainDoesNotGetInEither) {
  const char* asked = std::getenv("PRESCENE_SECURITY_TRIES");
  const int tries = asked != nullptr ? std::atoi(asked) : 2;
  Peer open_talker("-", "open", "talk", kBelief);
  Peer their_talker(enclave("theirs", "prescene"), "theirs", "talk", kBelief);
  Peer our_talker(enclave("ours", "prescene"), "ours", "talk", kBelief);
  Peer our_listener(enclave("ours", "laptop"), "our listener", "hear", kBelief);
  for (int i = 0; i < tries; ++i) {
    {
      Peer open("-", "open intruder", "both", kBelief);
      ASSERT_THAT(open.heard_until("open", 3), ElementsAre("open")) << i;
    }
    {
      Peer theirs(enclave("theirs", "prescene"), "their intruder", "both", kBelief);
      ASSERT_THAT(theirs.heard_until("theirs", 3), ElementsAre("theirs")) << i;
    }
    ASSERT_THAT(our_listener.heard_until("ours", 3), ElementsAre("ours")) << i;
  }
}

TEST_F(Security, EachRoleMayDoWhatItsPermissionsSay) {
  const std::string no = "Not Allowed By Security";
  EXPECT_EQ(first_line("prescene", "talk", kBelief), "ready");
  EXPECT_EQ(first_line("prescene", "hear", "/camera/depth"), "ready");
  EXPECT_THAT(first_line("prescene", "talk", "/prescene/control"), HasSubstr(no));
  EXPECT_THAT(first_line("robot", "talk", kBelief), HasSubstr(no));
  EXPECT_EQ(first_line("robot", "hear", kBelief), "ready");
  EXPECT_EQ(first_line("robot", "talk", "/prescene/control"), "ready");
  EXPECT_EQ(first_line("laptop", "hear", kBelief), "ready");
  EXPECT_EQ(first_line("laptop", "talk", "/prescene/query"), "ready");
  EXPECT_THAT(first_line("laptop", "talk", kBelief), HasSubstr(no));
  EXPECT_THAT(first_line("laptop", "talk", "/prescene/control"), HasSubstr(no));
  EXPECT_THAT(first_line("laptop", "hear", "/camera/depth"), HasSubstr(no));
}

TEST_F(Security, AFileThatIsMissingOrOfAnotherAuthorityIsNamed) {
  const std::filesystem::path laptop = enclave("ours", "laptop");
  std::filesystem::copy_file(std::filesystem::path(enclave("theirs", "laptop")) / "permissions.p7s",
                             laptop / "permissions.p7s", std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(first_line("laptop", "hear", kBelief), HasSubstr("refused: DDS participant"));
  std::filesystem::remove(laptop / "permissions.p7s");
  EXPECT_THAT(first_line("laptop", "hear", kBelief), HasSubstr("permissions.p7s' can't be read"));
  EXPECT_THAT(first_line("nobody", "hear", kBelief), HasSubstr("identity_ca.cert.pem' can't be read"));
}

TEST_F(Security, KeysAreMadeOnlyOfArgumentsThatMakeSense) {
  for (const char* wrong : {"", "prescene", "prescene:king", "../x:robot", "'a b:robot'", "a:robot --domains x",
                            "a:robot --days 0", "a:robot --other"})
    EXPECT_NE(keys("more 2> /dev/null", wrong), 0) << wrong;
  EXPECT_EQ(keys("ours", "another:robot"), 0);
  EXPECT_EQ(first_line("another", "talk", "/prescene/control"), "ready");
}

}  // namespace
}  // namespace prescene::interfaces::security_test
