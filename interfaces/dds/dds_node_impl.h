// SPDX-License-Identifier: Apache-2.0
// What the parts of a node share.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include "bus_census.h"
#include "cyclone_log.h"
#include "graph_announcement.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "topic_table.h"

namespace prescene::interfaces {

/// Ok, or kUnavailable with what was done and Cyclone's words.
core::Status dds_status(dds_return_t code, const std::string& doing);

struct DdsNode::Impl {
  struct Subscription {
    std::string topic;
    std::string type;
    std::function<void(ReceivedMessage&&)> on_message;
    dds_entity_t reader = 0;
    std::atomic<std::uint64_t> arrived{0};   // samples that the middleware offered to the reader's history
    std::uint64_t taken = 0;                 // of them, those that the node's thread took; touched by it alone
    std::uint64_t reported_overwritten = 0;  // of them, those counted as dropped already
    bool has_more = false;                   // something may wait; touched by the node's thread alone
  };
  struct Publication {
    std::string topic;
    std::string type;
    dds_entity_t writer = 0;
  };
  struct Service {
    std::string name;
    const ServiceType* type = nullptr;
    dds_entity_t requests = 0;   // reader
    dds_entity_t replies = 0;    // writer
    std::atomic<int> silent{0};  // clients that ask and read no replies; nobody waits for them
  };

  DdsOptions options;
  std::optional<CycloneLog> cyclone_log;  // ends last
  dds_entity_t participant = 0;
  dds_entity_t waitset = 0;
  dds_entity_t stop = 0;
  std::unique_ptr<GraphAnnouncement> graph;
  BusCensus census;
  std::string interfaces;    // as Cyclone names those that it uses, or ""
  mutable std::mutex mutex;  // guards the three lists; their entries stay where they are
  std::deque<Subscription> subscriptions;
  std::deque<Publication> publications;
  std::deque<Service> services;
  std::atomic<std::uint64_t> dropped{0};
  std::atomic<bool> stopping{false};
  std::atomic<std::chrono::steady_clock::time_point> waits_from{};  // for the readers of clients; not before this
  std::thread thread;

  ~Impl() {
    stop_receiving();
    graph.reset();
    if (participant > 0) dds_delete(participant);
    // As in listen(): what Cyclone's threads did last with a subscription is known by its counter.
    for (const Subscription& subscription : subscriptions) subscription.arrived.load(std::memory_order_acquire);
  }

  void run();
  void stop_receiving() {
    if (!thread.joinable()) return;
    stopping = true;
    dds_set_guardcondition(stop, true);
    thread.join();
  }
  /// Takes what waits, or a good part of it; has_more then says whether more may wait.
  void take(Subscription& subscription);
  void deliver(Subscription& subscription, const ddsi_serdata* sample, const dds_sample_info_t& info);
  void count_losses(Subscription& subscription, std::uint64_t arrived);
  core::Result<dds_entity_t> make_topic(const std::string& topic, const std::string& type) const;
  /// Has `reader` listened to; the lock is held.
  core::Status listen(const std::string& topic, const std::string& type, dds_entity_t topic_entity, const QosPtr& qos,
                      std::function<void(ReceivedMessage&&)> on_message);
  /// A service of ours, once the client of a request can read its reply, or 100 ms have passed. Waits once for a
  /// client, and then not for 200 ms: others want their frames and replies.
  const Service& service_for(const ServiceRequest& request);
  template <class CType, class Message>
  core::Status reply(const ServiceRequest& request, std::string_view type, const Message& message);
  template <class CType, class Message>
  core::Status write(DdsPublisher publisher, const std::string& type, const Message& message);
  void announce();
};

}  // namespace prescene::interfaces
