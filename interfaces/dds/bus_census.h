// SPDX-License-Identifier: Apache-2.0
// Who else is in the domain, and what they write and read: from the middleware's built-in topics.
#pragma once

#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include <dds/dds.h>
#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::interfaces {

/// Thread-safe. Leaves out what the participant itself writes and reads.
class BusCensus {
 public:
  /// The participant must outlive the census. Its readers are made when first asked.
  void set_participant(dds_entity_t participant) { participant_ = participant; }

  int writers_of(const std::string& dds_topic);
  std::vector<DomainTopic> topics();
  int participants();

 private:
  struct Endpoint {
    std::string topic;  // as DDS names them
    std::string type;
  };
  using Endpoints = std::map<std::string, Endpoint>;  // by the bytes of the endpoint's key

  /// Calls `note` with what came on a built-in topic since the last call; mutex_ is locked.
  template <class Sample, class Note>
  void take(dds_entity_t& reader, dds_entity_t builtin_topic, const Note& note);
  /// Brings `known` up to date.
  void take_endpoints(dds_entity_t& reader, dds_entity_t builtin_topic, Endpoints& known);

  dds_entity_t participant_ = 0;
  std::mutex mutex_;
  dds_entity_t writer_reader_ = 0, reader_reader_ = 0, participant_reader_ = 0;
  Endpoints writers_, readers_;
  std::set<std::string> participants_;
};

}  // namespace prescene::interfaces
