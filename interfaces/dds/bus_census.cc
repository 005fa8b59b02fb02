// SPDX-License-Identifier: Apache-2.0
#include "bus_census.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include "topic_table.h"

namespace prescene::interfaces {
namespace {

std::string key_bytes(const dds_guid_t& guid) { return {reinterpret_cast<const char*>(guid.v), sizeof(guid.v)}; }

}  // namespace

template <class Sample, class Note>
void BusCensus::take(dds_entity_t& reader, dds_entity_t builtin_topic, const Note& note) {
  if (reader <= 0) reader = dds_create_reader(participant_, builtin_topic, nullptr, nullptr);
  if (reader <= 0) return;
  constexpr std::uint32_t kBatch = 64;
  for (;;) {
    void* samples[kBatch] = {};  // lent by the middleware
    dds_sample_info_t infos[kBatch];
    const dds_return_t count = dds_take(reader, samples, infos, kBatch, kBatch);
    for (dds_return_t i = 0; i < count; ++i) note(*static_cast<const Sample*>(samples[i]), infos[i]);
    if (count > 0) dds_return_loan(reader, samples, count);
    if (count < static_cast<dds_return_t>(kBatch)) return;
  }
}

void BusCensus::take_endpoints(dds_entity_t& reader, dds_entity_t builtin_topic, Endpoints& known) {
  dds_guid_t own{};
  if (dds_get_guid(participant_, &own) != DDS_RETCODE_OK) return;
  take<dds_builtintopic_endpoint_t>(reader, builtin_topic,
                                    [&](const dds_builtintopic_endpoint_t& endpoint, const dds_sample_info_t& info) {
                                      if (info.instance_state != DDS_IST_ALIVE)
                                        known.erase(key_bytes(endpoint.key));
                                      else if (info.valid_data && key_bytes(endpoint.participant_key) != key_bytes(own))
                                        known[key_bytes(endpoint.key)] = {endpoint.topic_name, endpoint.type_name};
                                    });
}

int BusCensus::writers_of(const std::string& dds_topic) {
  const std::lock_guard lock(mutex_);
  take_endpoints(writer_reader_, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, writers_);
  return static_cast<int>(std::count_if(writers_.begin(), writers_.end(),
                                        [&](const auto& entry) { return entry.second.topic == dds_topic; }));
}

std::vector<DomainTopic> BusCensus::topics() {
  const std::lock_guard lock(mutex_);
  take_endpoints(writer_reader_, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, writers_);
  take_endpoints(reader_reader_, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, readers_);
  std::map<std::pair<std::string, std::string>, DomainTopic> found;
  const auto count = [&found](const Endpoints& endpoints, int DomainTopic::*counter) {
    for (const auto& [key, endpoint] : endpoints) {
      const std::optional<std::string> name = ros_topic_name(endpoint.topic);
      const std::optional<std::string> type = ros_type_name(endpoint.type);
      if (!name || !type) continue;
      DomainTopic& topic = found[{*name, *type}];
      topic.name = *name;
      topic.type = *type;
      ++(topic.*counter);
    }
  };
  count(writers_, &DomainTopic::writers);
  count(readers_, &DomainTopic::readers);
  std::vector<DomainTopic> topics;
  for (auto& [key, topic] : found) topics.push_back(std::move(topic));
  return topics;
}

int BusCensus::participants() {
  const std::lock_guard lock(mutex_);
  dds_guid_t own{};
  if (dds_get_guid(participant_, &own) != DDS_RETCODE_OK) return 0;
  take<dds_builtintopic_participant_t>(
      participant_reader_, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT,
      [&](const dds_builtintopic_participant_t& participant, const dds_sample_info_t& info) {
        const std::string key = key_bytes(participant.key);
        if (info.instance_state != DDS_IST_ALIVE)
          participants_.erase(key);
        else if (info.valid_data && key != key_bytes(own))
          participants_.insert(key);
      });
  return static_cast<int>(participants_.size());
}

}  // namespace prescene::interfaces
