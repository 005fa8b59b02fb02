// SPDX-License-Identifier: Apache-2.0
// One participant on a DDS bus that ROS 2 users share: topics, types, qualities of service and type hashes are those
// that ROS 2 Humble and Jazzy use, so that `ros2 topic list`, `echo` and `pub` work without glue.
//
//   PRESCENE_TRY(auto node, DdsNode::create(options, log));
//   PRESCENE_RETURN_IF_ERROR(node->subscribe("/camera/depth", "sensor_msgs/msg/Image", TopicQos::kSensor, on_image));
//   PRESCENE_TRY(auto notes, node->advertise("/note", "std_msgs/msg/String", TopicQos::kReliable));
//   node->publish(notes, RosString{"hello"});
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/clock.h"
#include "prescene/core/log.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/ros_messages/messages.h"
#include "prescene/interfaces/ros_messages/parameter_messages.h"
#include "prescene/interfaces/ros_messages/planning_messages.h"
#include "prescene/interfaces/ros_messages/prescene_messages.h"

namespace prescene::interfaces {

/// The release whose form of `ros_discovery_info` is published: the two don't understand each other's.
enum class RosDistro { kHumble, kJazzy };

struct DdsOptions {
  int domain = 0;                      ///< 0 to 230; ROS_DOMAIN_ID.
  std::string node_name = "prescene";  ///< As `ros2 node list` shows it.
  /// Network interfaces to use, by their names ("eth0"; "lo" = this machine only). Empty = the middleware chooses one.
  std::vector<std::string> interfaces;
  /// Machines to look for participants on, by address or name, where multicast does not reach them. They must look for
  /// this one, too, or be reached by its multicast.
  std::vector<std::string> peers;
  /// Publish which nodes there are (for `ros2 node list`); topics work without it. Set it to the release that all
  /// others on the bus have: the wrong form confuses their nodes.
  std::optional<RosDistro> ros_distro;
  /// Receive buffer asked of the system; RGB-D is lost below 4 MiB. Where the system grants a smaller one, that is
  /// logged as a warning.
  int receive_buffer_bytes = 8 << 20;
  /// Larger samples are dropped unread and counted; those of more than twice that Cyclone drops itself, with a warning
  /// of its own and uncounted.
  std::size_t max_message_bytes = std::size_t{64} << 20;
  /// Folder with what DDS Security needs (docs/reference/security.md): certificates, key, governance and permissions by
  /// the names of an SROS 2 enclave. Only participants with the same authorities then hear this one and are heard, and
  /// each may do what its permissions say. A process has one identity: that of its first node in a domain. Empty =
  /// none.
  std::filesystem::path security;
  /// Find out which network interfaces the middleware uses, for interfaces(); only the first node of a process in a
  /// domain can.
  bool find_interfaces = false;
};

/// What the system grants of a receive buffer of so many bytes; nothing where it does not say.
std::optional<int> granted_receive_buffer(int asked_bytes);

/// How a topic is offered or asked for; names say who uses it.
enum class TopicQos {
  kSensor,    ///< Best effort, keep last 5: readers of cameras match every driver.
  kJoints,    ///< Best effort, keep last 100: readers of joint states, which come fast and from every sort of writer.
  kImages,    ///< Reliable, keep last 2: writers of images serve best-effort and reliable readers.
  kReliable,  ///< Reliable, keep last 10: queries and answers of clients.
  kState,     ///< As kReliable, but a writer never waits: for state that the next sample replaces (poses, markers).
  kEvents,    ///< As kState, keep last 1000: changes of parameters.
  kChanges,   ///< As kState, keep last 100: changes, none of which replaces another.
  kCommands,  ///< As kReliable, keep last 100: readers of questions, answers and controls, none of which replaces
              ///< another.
  kTf,        ///< Reliable, keep last 100; a reader does not get what writers of its own node send.
  kLatched,   ///< Reliable, transient local, keep last 1 (/tf_static writers, descriptions).
  kTfStatic,  ///< Reader of /tf_static: reliable, transient local, keep last 100.
};

/// One sample as it came: CDR bytes with their header, for decode_cdr and recordings.
struct ReceivedMessage {
  std::string topic;  ///< "/camera/depth/image_raw"
  std::string type;   ///< "sensor_msgs/msg/Image"
  std::vector<std::uint8_t> cdr;
  core::TimeNs source_ns = 0;    ///< The writer's wall time.
  core::TimeNs received_ns = 0;  ///< Ours, of core::steady_now_ns(): does not jump when the wall clock is set.
  std::uint64_t writer = 0;      ///< Who wrote it: a number of this process, another one for each writer.
};

/// A topic that other participants of the domain write or read now. A name that carries two types is two of them.
struct DomainTopic {
  std::string name;  ///< "/camera/color/image_raw"
  std::string type;  ///< "sensor_msgs/msg/Image"
  int writers = 0;
  int readers = 0;
  friend bool operator==(const DomainTopic&, const DomainTopic&) = default;
};

/// Handle of a topic to publish on.
struct DdsPublisher {
  int index = -1;
};

/// What a client of a service of ours asks, as rmw_cyclonedds_cpp sends it.
struct ServiceRequest {
  int service = -1;          ///< Of the node: in the order of offer_service().
  std::uint64_t client = 0;  ///< The client's own number, and that of its request: the reply repeats both.
  std::int64_t sequence = 0;
  std::string text;                  ///< The one field of a prescene_msgs/srv/Ask.
  std::vector<std::uint8_t> fields;  ///< Of a type of rcl_interfaces: for decode_cdr of its request.
};

class DdsNode {
 public:
  /// Joins the bus. Fails with kUnavailable and Cyclone's own words when the participant can't be made (a misspelt
  /// CYCLONEDDS_URI, no network interface, a certificate that the authority did not sign), kInvalidInput for options
  /// out of range and a security folder without one of its files. What Cyclone says while the node lives goes to `log`,
  /// too, from any of its threads, as often as others make it say something; where `log` is empty, it is printed.
  static core::Result<std::unique_ptr<DdsNode>> create(const DdsOptions& options, const core::LogSink& log);
  ~DdsNode();
  DdsNode(const DdsNode&) = delete;
  DdsNode& operator=(const DdsNode&) = delete;

  /// Calls `on_message` for each sample, from the node's one thread, until the node ends. Topics take turns, so that a
  /// flood of one does not keep the others waiting. An exception that leaves `on_message` ends the work on its sample
  /// only, which counts as dropped. Types: those of messages.h that ros_messages.idl holds, and Prescene's own; another
  /// one is kUnsupported.
  core::Status subscribe(const std::string& topic, const std::string& type, TopicQos qos,
                         std::function<void(ReceivedMessage&&)> on_message);

  core::Result<DdsPublisher> advertise(const std::string& topic, const std::string& type, TopicQos qos);
  /// Writes one sample (copied). kUnavailable when the middleware refuses, as it does while a reliable reader that does
  /// not read holds up the topic: at once for kState, after 100 ms otherwise. kInvalidInput when the message is not of
  /// the publisher's type. May be called from any thread.
  core::Status publish(DdsPublisher publisher, const RosImage& message);
  core::Status publish(DdsPublisher publisher, const RosCompressedImage& message);
  core::Status publish(DdsPublisher publisher, const RosPointCloud2& message);
  core::Status publish(DdsPublisher publisher, const RosCameraInfo& message);
  core::Status publish(DdsPublisher publisher, const RosTfMessage& message);
  core::Status publish(DdsPublisher publisher, const RosJointState& message);
  core::Status publish(DdsPublisher publisher, const RosString& message);
  core::Status publish(DdsPublisher publisher, const RosClock& message);
  core::Status publish(DdsPublisher publisher, const RosPoseWithCovarianceStamped& message);
  core::Status publish(DdsPublisher publisher, const RosPoseArray& message);
  core::Status publish(DdsPublisher publisher, const RosDetection3dArray& message);
  core::Status publish(DdsPublisher publisher, const RosMarkerArray& message);
  core::Status publish(DdsPublisher publisher, const RosDiagnosticArray& message);
  core::Status publish(DdsPublisher publisher, const RosParameterEvent& message);
  core::Status publish(DdsPublisher publisher, const RosCollisionObject& message);
  core::Status publish(DdsPublisher publisher, const RosBelief& message);
  core::Status publish(DdsPublisher publisher, const RosEvent& message);
  core::Status publish(DdsPublisher publisher, const RosQuery& message);
  core::Status publish(DdsPublisher publisher, const RosCancel& message);
  core::Status publish(DdsPublisher publisher, const RosAnswer& message);
  core::Status publish(DdsPublisher publisher, const RosProgress& message);
  /// Decodes a recorded message of the publisher's type and publishes it.
  core::Status publish_cdr(DdsPublisher publisher, const std::vector<std::uint8_t>& cdr);

  /// Offers a service of ROS 2, which nodes that use Cyclone DDS, too, can call (`ros2 service call`): other
  /// middlewares carry requests in a form of their own. Types: "std_srvs/srv/Trigger", "prescene_msgs/srv/Ask" and
  /// those of parameters (parameter_messages.h); another one is kUnsupported. `on_request` is called as that of
  /// subscribe(); requests that make no sense count as dropped.
  core::Status offer_service(const std::string& name, const std::string& type,
                             std::function<void(ServiceRequest&&)> on_request);
  /// Answers a request; from any thread, once. Waits up to 100 ms for a client whose reader was not found yet: without
  /// it, it would miss the reply. Errors as publish(). The service must be of the reply's type.
  core::Status reply(const ServiceRequest& request, bool success, const std::string& text);
  core::Status reply(const ServiceRequest& request, const RosListParametersResponse& response);
  core::Status reply(const ServiceRequest& request, const RosGetParametersResponse& response);
  core::Status reply(const ServiceRequest& request, const RosGetParameterTypesResponse& response);
  core::Status reply(const ServiceRequest& request, const RosDescribeParametersResponse& response);
  core::Status reply(const ServiceRequest& request, const RosSetParametersResponse& response);
  core::Status reply(const ServiceRequest& request, const RosSetParametersAtomicallyResponse& response);

  /// No callback runs once this has returned, which takes no longer than the one that runs now; publishing goes on. Not
  /// to be called from a callback.
  void stop_receiving();

  /// How many readers on the bus match a publisher now.
  int matched_readers(DdsPublisher publisher) const;
  /// How many readers have matched a publisher since it was advertised, including those that left: it never decreases.
  std::uint64_t readers_so_far(DdsPublisher publisher) const;
  /// How many writers match a subscription now, 0 for an unknown topic.
  int matched_writers(const std::string& topic) const;
  /// How many writers on the bus that are not this node's offer a topic now, whatever their type; no subscription is
  /// needed.
  int other_writers(const std::string& topic) const;
  /// The ROS topics of all other participants that were found so far, by name and type. Finding those that run already
  /// takes the middleware some tenths of a second from create() on, across a network up to some seconds.
  std::vector<DomainTopic> domain_topics() const;
  /// How many other participants were found so far; a ROS 2 process is one.
  int other_participants() const;
  /// The network interfaces that the middleware uses, in its words ("eth0 (index 4 priority 0)"); "" where it was not
  /// asked (DdsOptions::find_interfaces) or did not say.
  std::string interfaces() const;
  /// Samples that reached this node and were dropped: too large (see DdsOptions), overwritten by newer ones before the
  /// node's thread took them, without memory to hold them, or given up by their callback with an exception. What the
  /// network loses of best-effort topics nobody can count.
  std::uint64_t dropped_samples() const;

  struct Impl;

 private:
  explicit DdsNode(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::interfaces
