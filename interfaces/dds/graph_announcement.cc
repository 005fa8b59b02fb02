// SPDX-License-Identifier: Apache-2.0
#include "graph_announcement.h"

#include <cstring>

#include "ros_discovery.h"

namespace prescene::interfaces {
namespace {

template <class Gid>
Gid gid_of(dds_entity_t entity) {
  Gid gid{};
  dds_guid_t guid;
  if (dds_get_guid(entity, &guid) == DDS_RETCODE_OK) std::memcpy(gid.data, guid.v, sizeof guid.v);
  return gid;
}

// The two forms differ only in the size of an identity.
template <class Info, class Node, class Gid>
void write_info(dds_entity_t participant, dds_entity_t writer, const std::string& name,
                const std::vector<dds_entity_t>& readers, const std::vector<dds_entity_t>& writers) {
  std::vector<Gid> reader_gids;
  std::vector<Gid> writer_gids;
  for (const dds_entity_t entity : readers) reader_gids.push_back(gid_of<Gid>(entity));
  for (const dds_entity_t entity : writers) writer_gids.push_back(gid_of<Gid>(entity));
  Node node{};
  std::strncpy(node.node_namespace, "/", sizeof node.node_namespace - 1);
  std::strncpy(node.node_name, name.c_str(), sizeof node.node_name - 1);
  const auto borrow = [](auto& sequence, auto& gids) {
    sequence._length = sequence._maximum = static_cast<std::uint32_t>(gids.size());
    sequence._buffer = gids.data();
    sequence._release = false;
  };
  borrow(node.reader_gid_seq, reader_gids);
  borrow(node.writer_gid_seq, writer_gids);
  Info info{};
  info.gid = gid_of<Gid>(participant);
  info.node_entities_info_seq._length = info.node_entities_info_seq._maximum = 1;
  info.node_entities_info_seq._buffer = &node;
  info.node_entities_info_seq._release = false;
  dds_write(writer, &info);
}

}  // namespace

core::Result<std::unique_ptr<GraphAnnouncement>> GraphAnnouncement::create(dds_entity_t participant, RosDistro distro) {
  std::unique_ptr<GraphAnnouncement> graph(new GraphAnnouncement(
      distro == RosDistro::kHumble ? rmw_dds_common_humble_msg_dds__ParticipantEntitiesInfo__desc
                                   : rmw_dds_common_jazzy_msg_dds__ParticipantEntitiesInfo__desc));
  graph->distro_ = distro;
  graph->participant_ = participant;
  graph->descriptor_.m_typename = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";
  const dds_entity_t topic = dds_create_topic(participant, &graph->descriptor_, "ros_discovery_info", nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_durability_service(qos, 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED);
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &xcdr1);
  graph->writer_ = topic < 0 ? topic : dds_create_writer(participant, topic, qos, nullptr);
  dds_delete_qos(qos);
  if (graph->writer_ < 0) {
    return core::unavailable(std::string("ros_discovery_info: ") + dds_strretcode(-graph->writer_) +
                             "; leave ros_distro unset to go without it");
  }
  return graph;
}

void GraphAnnouncement::publish(const std::string& node_name, const std::vector<dds_entity_t>& readers,
                                const std::vector<dds_entity_t>& writers) {
  if (distro_ == RosDistro::kHumble) {
    write_info<rmw_dds_common_humble_msg_dds__ParticipantEntitiesInfo_,
               rmw_dds_common_humble_msg_dds__NodeEntitiesInfo_, rmw_dds_common_humble_msg_dds__Gid_>(
        participant_, writer_, node_name, readers, writers);
  } else {
    write_info<rmw_dds_common_jazzy_msg_dds__ParticipantEntitiesInfo_, rmw_dds_common_jazzy_msg_dds__NodeEntitiesInfo_,
               rmw_dds_common_jazzy_msg_dds__Gid_>(participant_, writer_, node_name, readers, writers);
  }
}

}  // namespace prescene::interfaces
