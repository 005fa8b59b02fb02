// SPDX-License-Identifier: Apache-2.0
// Services of ROS 2, called by a client that speaks as rmw_cyclonedds_cpp does.
#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

#include <dds/dds.h>
#include "prescene/interfaces/dds/dds_node.h"
#include "tests/interfaces/dds/service_client.h"
#include "tests/support/bus_domain.h"

// NOLINTBEGIN(readability-identifier-naming): idlc's names
extern "C" {
extern const dds_topic_descriptor_t rcl_interfaces_srv_dds__ListParameters_Request__desc;
extern const dds_topic_descriptor_t rcl_interfaces_srv_dds__ListParameters_Response__desc;
}
// NOLINTEND(readability-identifier-naming)

namespace prescene::interfaces::service_test {
namespace {

using testing::MatchesRegex;
using tests::ServiceClient;

std::unique_ptr<DdsNode> node() {
  DdsOptions options;
  options.domain = tests::own_domain();
  auto node = DdsNode::create(options, {});
  EXPECT_TRUE(node.ok()) << node.status().message();
  return node ? *std::move(node) : nullptr;
}

TEST(Service, RepliesWithTheHeaderOfTheRequestByteByByte) {
  const auto server = node();
  ASSERT_TRUE(server);
  ASSERT_TRUE(server
                  ->offer_service("/robot/where", "std_srvs/srv/Trigger",
                                  [&](ServiceRequest&& request) {
                                    EXPECT_EQ(request.text, "");
                                    EXPECT_TRUE(server->reply(request, true, "here").ok());
                                  })
                  .ok());
  ServiceClient client(tests::own_domain(), "/robot/where");
  ASSERT_TRUE(client.wait_for_service());
  client.send();
  const std::int64_t sequence = client.send();
  const auto bytes = client.take_reply(sequence);
  ASSERT_TRUE(bytes.has_value());
  std::vector<std::uint8_t> expected = {0, 1, 0, 0};
  for (int i = 0; i < 8; ++i) expected.push_back(static_cast<std::uint8_t>(client.guid() >> 8 * i));
  expected.insert(expected.end(), {2, 0, 0, 0, 0, 0, 0, 0});             // its number
  expected.insert(expected.end(), {1, 0, 0, 0});                         // success, padding
  expected.insert(expected.end(), {5, 0, 0, 0, 'h', 'e', 'r', 'e', 0});  // length and text
  std::vector<std::uint8_t> came(*bytes);
  came.resize(expected.size(), 0xff);  // Cyclone pads behind, and says so in the fourth byte
  came[3] = 0;
  EXPECT_EQ(came, expected);
}

TEST(Service, TakesTextsAndServesClientsApart) {
  const auto server = node();
  ASSERT_TRUE(server);
  ASSERT_TRUE(server
                  ->offer_service("/robot/ask", "prescene_msgs/srv/Ask",
                                  [&](ServiceRequest&& request) {
                                    EXPECT_TRUE(
                                        server->reply(request, request.text.size() < 5, request.text + "!").ok());
                                  })
                  .ok());
  ServiceClient one(tests::own_domain(), "/robot/ask", true);
  ServiceClient other(tests::own_domain(), "/robot/ask", true);
  ASSERT_TRUE(one.wait_for_service() && other.wait_for_service());
  ASSERT_NE(one.guid(), other.guid());
  for (int i = 0; i < 20; ++i) {
    const auto first = one.call("a" + std::to_string(i));
    const auto second = other.call("other" + std::to_string(i));
    ASSERT_TRUE(first && second);
    EXPECT_EQ(first->text, "a" + std::to_string(i) + "!");
    EXPECT_TRUE(first->success);
    EXPECT_EQ(second->text, "other" + std::to_string(i) + "!");
    EXPECT_FALSE(second->success);
  }
  const std::string large(1'000'000, 'x');
  const auto reply = one.call(large);
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->text, large + "!");
}

// A client that asks as soon as the server's reader is found may be known by its writer alone.
TEST(Service, AClientThatHasJustComeGetsItsReply) {
  const auto server = node();
  ASSERT_TRUE(server);
  ASSERT_TRUE(server
                  ->offer_service("/robot/now", "std_srvs/srv/Trigger",
                                  [&](ServiceRequest&& request) { EXPECT_TRUE(server->reply(request, true, "").ok()); })
                  .ok());
  for (int i = 0; i < 20; ++i) {
    ServiceClient client(tests::own_domain(), "/robot/now");
    ASSERT_TRUE(client.wait_for_service());
    ASSERT_TRUE(client.call().has_value()) << i;
  }
}

// Others are not kept waiting by a client that never reads, before and after it has left.
TEST(Service, AClientThatReadsNoRepliesTakesThemFromNobody) {
  const auto server = node();
  ASSERT_TRUE(server);
  ASSERT_TRUE(server
                  ->offer_service("/robot/deaf", "std_srvs/srv/Trigger",
                                  [&](ServiceRequest&& request) { EXPECT_TRUE(server->reply(request, true, "").ok()); })
                  .ok());
  ServiceClient other(tests::own_domain(), "/robot/deaf");
  ASSERT_TRUE(other.wait_for_service());
  ASSERT_TRUE(other.call().has_value());
  {
    ServiceClient deaf(tests::own_domain(), "/robot/deaf");
    ASSERT_TRUE(deaf.wait_for_service());
    deaf.stop_reading();
    for (int i = 0; i < 50; ++i) {
      deaf.send();
      ASSERT_TRUE(other.call().has_value()) << i;
    }
  }
  ASSERT_TRUE(other.call().has_value());
}

TEST(Service, EndpointsSayByTheirUserDataThatTheyBelongTogether) {
  const auto server = node();
  ASSERT_TRUE(server);
  for (const char* name : {"/robot/a", "/robot/b"})
    ASSERT_TRUE(server->offer_service(name, "std_srvs/srv/Trigger", [](ServiceRequest&&) {}).ok());
  std::vector<std::string> ids;
  for (const char* name : {"/robot/a", "/robot/b"}) {
    ServiceClient client(tests::own_domain(), name);
    ASSERT_TRUE(client.wait_for_service());
    const std::vector<std::string> data = client.user_data();
    ASSERT_EQ(data.size(), 2U);
    for (const std::string& text : data)
      EXPECT_THAT(text, MatchesRegex("serviceid=([0-9a-f]+\\.){15}[0-9a-f]+;typehash=RIHS01_[0-9a-f]+;"));
    EXPECT_EQ(data[0].substr(0, data[0].find(';')), data[1].substr(0, data[1].find(';')));
    ids.push_back(data[0].substr(0, data[0].find(';')));
  }
  EXPECT_NE(ids[0], ids[1]);
}

// `ros2 node list`, `ros2 param` and `ros2 service list` know of a node, and of what is its own, from what each
// participant says of itself on ros_discovery_info.
TEST(Service, TheNodesAnnouncementHoldsItsNameAndTheServicesEndpoints) {
  DdsOptions options;
  options.domain = tests::own_domain();
  options.node_name = "announced";
  options.ros_distro = RosDistro::kJazzy;
  const auto server = DdsNode::create(options, {});
  ASSERT_TRUE(server.ok()) << server.status().message();
  ASSERT_TRUE(
      (*server)
          ->offer_service("/announced/list_parameters", "rcl_interfaces/srv/ListParameters", [](ServiceRequest&&) {})
          .ok());
  ServiceClient client(tests::own_domain(), "/announced/list_parameters",
                       rcl_interfaces_srv_dds__ListParameters_Request__desc,
                       rcl_interfaces_srv_dds__ListParameters_Response__desc);
  ASSERT_TRUE(client.wait_for_service());
  const auto guids = client.guids();
  ASSERT_EQ(guids.size(), 2U);
  const std::vector<std::uint8_t> said = tests::newest_announcement(tests::own_domain(), [&](const auto& bytes) {
    return std::all_of(guids.begin(), guids.end(), [&](const auto& guid) {
      return std::search(bytes.begin(), bytes.end(), guid.begin(), guid.end()) != bytes.end();
    });
  });
  // Header, the participant's identity, one node: namespace, name.
  const std::vector<std::uint8_t> node = {1, 0, 0, 0,   2,   0,   0,   0,   '/', 0,   0,   0,   10,
                                          0, 0, 0, 'a', 'n', 'n', 'o', 'u', 'n', 'c', 'e', 'd', 0};
  ASSERT_GT(said.size(), 20 + node.size());
  EXPECT_TRUE(std::equal(node.begin(), node.end(), said.begin() + 20));
}

TEST(Service, NamesAndTypesThatMakeNoSenseAreRefused) {
  const auto server = node();
  ASSERT_TRUE(server);
  const auto offer = [&](const std::string& name, const std::string& type) {
    return server->offer_service(name, type, [](ServiceRequest&&) {}).code();
  };
  EXPECT_EQ(offer("where", "std_srvs/srv/Trigger"), core::StatusCode::kInvalidInput);
  EXPECT_EQ(offer("/robot/where", "std_srvs/srv/SetBool"), core::StatusCode::kUnsupported);
}

}  // namespace
}  // namespace prescene::interfaces::service_test
