// SPDX-License-Identifier: Apache-2.0
#include "topic_table.h"

#include <algorithm>
#include <cctype>
#include <string_view>

#include "prescene/interfaces/ros_messages/schemas.h"
#include "prescene_msgs.h"
#include "ros_messages.h"

namespace prescene::interfaces {

const dds_topic_descriptor_t* descriptor_of(const std::string& ros_type) {
  struct Row {
    std::string_view type;
    const dds_topic_descriptor_t* descriptor;
  };
  static constexpr Row kRows[] = {
      {"sensor_msgs/msg/Image", &sensor_msgs_msg_dds__Image__desc},
      {"sensor_msgs/msg/CompressedImage", &sensor_msgs_msg_dds__CompressedImage__desc},
      {"sensor_msgs/msg/PointCloud2", &sensor_msgs_msg_dds__PointCloud2__desc},
      {"sensor_msgs/msg/JointState", &sensor_msgs_msg_dds__JointState__desc},
      {"sensor_msgs/msg/CameraInfo", &sensor_msgs_msg_dds__CameraInfo__desc},
      {"tf2_msgs/msg/TFMessage", &tf2_msgs_msg_dds__TFMessage__desc},
      {"std_msgs/msg/String", &std_msgs_msg_dds__String__desc},
      {"rosgraph_msgs/msg/Clock", &rosgraph_msgs_msg_dds__Clock__desc},
      {"geometry_msgs/msg/PoseWithCovarianceStamped", &geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc},
      {"geometry_msgs/msg/PoseArray", &geometry_msgs_msg_dds__PoseArray__desc},
      {"vision_msgs/msg/Detection3DArray", &vision_msgs_msg_dds__Detection3DArray__desc},
      {"visualization_msgs/msg/MarkerArray", &visualization_msgs_msg_dds__MarkerArray__desc},
      {"diagnostic_msgs/msg/DiagnosticArray", &diagnostic_msgs_msg_dds__DiagnosticArray__desc},
      {"moveit_msgs/msg/CollisionObject", &moveit_msgs_msg_dds__CollisionObject__desc},
      {"prescene_msgs/msg/Belief", &prescene_msgs_msg_dds__Belief__desc},
      {"prescene_msgs/msg/Event", &prescene_msgs_msg_dds__Event__desc},
      {"prescene_msgs/msg/Query", &prescene_msgs_msg_dds__Query__desc},
      {"prescene_msgs/msg/Cancel", &prescene_msgs_msg_dds__Cancel__desc},
      {"prescene_msgs/msg/Answer", &prescene_msgs_msg_dds__Answer__desc},
      {"prescene_msgs/msg/Progress", &prescene_msgs_msg_dds__Progress__desc},
      {"rcl_interfaces/msg/ParameterEvent", &rcl_interfaces_msg_dds__ParameterEvent__desc},
  };
  const auto* row = std::find_if(std::begin(kRows), std::end(kRows), [&](const Row& r) { return r.type == ros_type; });
  return row == std::end(kRows) ? nullptr : row->descriptor;
}

const ServiceType* find_service_type(const std::string& ros_type) {
#define PRESCENE_PARAMETER_SERVICE(name)                                               \
  {                                                                                    \
    "rcl_interfaces/srv/" #name, &rcl_interfaces_srv_dds__##name##_Request__desc,      \
        &rcl_interfaces_srv_dds__##name##_Response__desc, "", "", ServiceForm::kFields \
  }
  static constexpr ServiceType kTypes[] = {
      {"std_srvs/srv/Trigger", &std_srvs_srv_dds__Trigger_Request__desc, &std_srvs_srv_dds__Trigger_Response__desc,
       "RIHS01_d010825374ce8918e72bfd826c82603e60f45419e932ea976f807b74a863a199",
       "RIHS01_2d946c21e2fc3f1e9ca6986a8191d85fcc70097a8bb7771a053564bc47009cdf", ServiceForm::kEmpty},
      {"prescene_msgs/srv/Ask", &prescene_msgs_srv_dds__Ask_Request__desc, &prescene_msgs_srv_dds__Ask_Response__desc,
       "RIHS01_c6d5bcfd7a1e216797019d28e201d3d1cfcd493afd7e05cf69d4f06895893905",
       "RIHS01_849b94f7bb2b29b7aa41c925add18dd3fa3676acac8d6ccd84a141d063178db8", ServiceForm::kText},
      PRESCENE_PARAMETER_SERVICE(ListParameters),
      PRESCENE_PARAMETER_SERVICE(GetParameters),
      PRESCENE_PARAMETER_SERVICE(GetParameterTypes),
      PRESCENE_PARAMETER_SERVICE(DescribeParameters),
      PRESCENE_PARAMETER_SERVICE(SetParameters),
      PRESCENE_PARAMETER_SERVICE(SetParametersAtomically),
  };
  const auto* type =
      std::find_if(std::begin(kTypes), std::end(kTypes), [&](const ServiceType& t) { return t.name == ros_type; });
#undef PRESCENE_PARAMETER_SERVICE
  return type == std::end(kTypes) ? nullptr : type;
}

std::string_view request_hash(const ServiceType& type) {
  if (!type.request_hash.empty()) return type.request_hash;
  return find_ros_type(std::string(type.name) + "_Request")->type_hash;
}

std::string_view response_hash(const ServiceType& type) {
  if (!type.response_hash.empty()) return type.response_hash;
  return find_ros_type(std::string(type.name) + "_Response")->type_hash;
}

core::Result<std::string> dds_topic_name(const std::string& ros_topic) {
  const std::string remedy =
      ": ROS names are '/' and then letters, digits, '_' and '/', no token empty or begun by a digit";
  if (ros_topic.size() < 2 || ros_topic.front() != '/' || ros_topic.back() == '/' || ros_topic.size() > 250) {
    return core::invalid_input("topic '" + ros_topic + "'" + remedy);
  }
  char before = '\0';
  for (const char c : ros_topic) {
    const auto u = static_cast<unsigned char>(c);
    const bool fits = c == '/' ? before != '/' : (std::isalpha(u) || c == '_' || (std::isdigit(u) && before != '/'));
    if (!fits || u > 127) return core::invalid_input("topic '" + ros_topic + "'" + remedy);
    before = c;
  }
  return "rt" + ros_topic;
}

std::optional<std::string> ros_topic_name(const std::string& dds_topic) {
  if (!dds_topic.starts_with("rt/")) return std::nullopt;
  std::string name = dds_topic.substr(2);
  if (!dds_topic_name(name)) return std::nullopt;
  return name;
}

std::optional<std::string> ros_type_name(std::string_view dds_type) {
  constexpr std::string_view kInfix = "dds_::";
  if (dds_type.size() > 250 || !dds_type.ends_with('_')) return std::nullopt;
  dds_type.remove_suffix(1);
  const std::size_t infix = dds_type.rfind(kInfix);
  if (infix == std::string_view::npos) return std::nullopt;
  std::string name;
  for (std::string_view rest = dds_type; !rest.empty();) {
    if (rest.data() == dds_type.data() + infix) {
      rest.remove_prefix(kInfix.size());
    } else if (rest.starts_with("::")) {
      name += '/';
      rest.remove_prefix(2);
    } else {
      const auto u = static_cast<unsigned char>(rest.front());
      if (u > 127 || (!std::isalnum(u) && u != '_')) return std::nullopt;
      name += rest.front();
      rest.remove_prefix(1);
    }
  }
  return name;
}

QosPtr make_qos(TopicQos kind, const std::string& ros_type) {
  QosPtr qos(dds_create_qos());
  int depth = 10;
  bool reliable = true;
  bool latched = false;
  dds_duration_t longest_wait = DDS_MSECS(100);
  switch (kind) {
    case TopicQos::kSensor:
      depth = 5;
      reliable = false;
      break;
    case TopicQos::kJoints:
      depth = 100;
      reliable = false;
      break;
    case TopicQos::kImages:
      depth = 2;
      break;
    case TopicQos::kReliable:
      break;
    case TopicQos::kState:
      longest_wait = 0;
      break;
    case TopicQos::kEvents:
      depth = 1000;
      longest_wait = 0;
      break;
    case TopicQos::kChanges:
      depth = 100;
      longest_wait = 0;
      break;
    case TopicQos::kCommands:
      depth = 100;
      break;
    case TopicQos::kTf:
      depth = 100;
      dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);  // a node's own transforms are no news to it
      break;
    case TopicQos::kLatched:
      depth = 1;
      latched = true;
      break;
    case TopicQos::kTfStatic:
      depth = 100;
      latched = true;
      break;
  }
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  dds_qset_reliability(qos.get(), reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, longest_wait);
  dds_qset_durability(qos.get(), latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (latched) {
    // Cyclone replays to late joiners what the durability service keeps, not what the history does.
    dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, depth, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED);
  }
  dds_qset_writer_data_lifecycle(qos.get(), false);
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos.get(), 1, &xcdr1);
  if (const RosType* type = find_ros_type(ros_type)) {
    const std::string user_data = "typehash=" + std::string(type->type_hash) + ";";
    dds_qset_userdata(qos.get(), user_data.data(), user_data.size());
  }
  return qos;
}

QosPtr make_service_qos(const std::array<std::uint8_t, 16>& service_id, std::string_view type_hash) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  QosPtr qos = make_qos(TopicQos::kCommands, "");
  std::string user_data = "serviceid=";
  for (const std::uint8_t byte : service_id) {
    if (user_data.back() != '=') user_data += '.';
    if (byte > 15) user_data += kDigits[byte / 16];
    user_data += kDigits[byte % 16];
  }
  user_data += ";typehash=" + std::string(type_hash) + ";";
  dds_qset_userdata(qos.get(), user_data.data(), user_data.size());
  return qos;
}

}  // namespace prescene::interfaces
