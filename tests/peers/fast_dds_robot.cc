// SPDX-License-Identifier: Apache-2.0
// fast_dds_robot DOMAIN: a robot that shares nothing with Prescene but the IDL of the messages. It speaks Fast DDS,
// which is the middleware that ROS 2 uses unless told otherwise, with the qualities of service of its nodes; it
// computes the images of a box on a table itself. The box rests for a second, is pushed 5 cm along y, and rests again.
//
// It prints what it hears, a line each: "belief STAMP_NS TRUE_X TRUE_Y TRUE_Z JSON", "frame STAMP_NS TRUE_X TRUE_Y
// TRUE_Z X Y Z" of the frame prescene/box on /tf, and "answer JSON" to its question. It ends with 0 when it has heard
// enough of each, and with 1 after two minutes.
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "fast_dds_messagesPubSubTypes.h"

namespace {

namespace dds = eprosima::fastdds::dds;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using sensor_msgs::msg::dds_::CameraInfo_;
using sensor_msgs::msg::dds_::Image_;
using std::chrono::steady_clock;
using std_msgs::msg::dds_::String_;
using tf2_msgs::msg::dds_::TFMessage_;

// The images take several datagrams and many fragments each.
constexpr int kWidth = 320, kHeight = 240;
const Vector3d kBoxSize(0.12, 0.08, 0.1);
constexpr double kFocal = 310.0;
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr int kEnough = 10;  // beliefs and frames after the push

std::int64_t wall_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// The pose of the camera's optical frame in the base: z forward, y down.
Isometry3d camera_in_base() {
  const Vector3d from(0.55, -0.5, 0.5), at(0.0, 0.0, 0.03);
  Isometry3d X_BC = Isometry3d::Identity();
  const Vector3d z = (at - from).normalized(), x = z.cross(Vector3d::UnitZ()).normalized();
  X_BC.linear() << x, z.cross(x), z;
  X_BC.translation() = from;
  return X_BC;
}

/// The base stands turned in the world, so that the camera's pose is known from both transforms only.
Isometry3d base_in_world() {
  Isometry3d X_WB = Isometry3d::Identity();
  X_WB.linear() = Eigen::AngleAxisd(0.3, Vector3d::UnitZ()).toRotationMatrix();
  X_WB.translation() = Vector3d(0.05, -0.02, 0.0);
  return X_WB;
}

/// The pose of the box so long after the start.
Isometry3d box_in_world(double seconds) {
  Isometry3d X_WO = Isometry3d::Identity();
  X_WO.linear() = Eigen::AngleAxisd(0.15, Vector3d::UnitZ()).toRotationMatrix();
  X_WO.translation() = Vector3d(0.02, -0.015 + 0.05 * std::clamp(seconds - 1.0, 0.0, 1.0), kBoxSize.z() / 2);
  return X_WO;
}

/// How far along the ray the box begins, and which way its surface looks there; infinity where the ray misses it.
std::pair<double, Vector3d> hit_box(const Isometry3d& X_OC, const Vector3d& ray_C) {
  const Vector3d from = X_OC.translation(), ray = X_OC.linear() * ray_C;
  double enter = 0.0, leave = std::numeric_limits<double>::infinity();
  Vector3d normal = Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const double half = kBoxSize[i] / 2;
    double low = (-half - from[i]) / ray[i], high = (half - from[i]) / ray[i];
    if (low > high) std::swap(low, high);
    if (low > enter) {
      enter = low;
      normal = Vector3d::Unit(i) * (ray[i] > 0 ? -1.0 : 1.0);
    }
    leave = std::min(leave, high);
  }
  if (enter > leave) enter = std::numeric_limits<double>::infinity();
  return {enter, normal};
}

/// Depth in millimetres along the optical axis and colour, as a camera driver publishes them.
void take_pictures(const Isometry3d& X_WO, Image_& depth, Image_& color) {
  const Isometry3d X_WC = base_in_world() * camera_in_base(), X_OC = X_WO.inverse() * X_WC;
  for (Image_* image : {&depth, &color}) {
    image->width(kWidth);
    image->height(kHeight);
    image->is_bigendian(0);
    image->header().frame_id("camera_color_optical_frame");
  }
  depth.encoding("16UC1");
  depth.step(kWidth * 2);
  color.encoding("rgb8");
  color.step(kWidth * 3);
  depth.data().assign(kWidth * kHeight * 2, 0);
  color.data().assign(kWidth * kHeight * 3, 20);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Vector3d ray_C((u - (kWidth - 1) / 2.0) / kFocal, (v - (kHeight - 1) / 2.0) / kFocal, 1.0);
      auto [z, normal_O] = hit_box(X_OC, ray_C);
      Vector3d rgb = Vector3d(0.8, 0.3, 0.2) * (0.6 + 0.4 * std::abs(normal_O.dot(Vector3d(0.2, 0.5, 0.8))));
      const Vector3d ray_W = X_WC.linear() * ray_C;
      const double to_table = -X_WC.translation().z() / ray_W.z();
      const Vector3d on_table = X_WC.translation() + to_table * ray_W;
      if (to_table > 0 && to_table < z && on_table.head<2>().cwiseAbs().maxCoeff() < 0.4) {
        z = to_table;
        rgb = {0.6, 0.6, 0.6};
      }
      if (!std::isfinite(z)) continue;
      const auto at = static_cast<std::size_t>(v * kWidth + u);
      const auto millimetres = static_cast<unsigned>(std::lround(z * 1000));
      depth.data()[2 * at] = static_cast<std::uint8_t>(millimetres & 255U);
      depth.data()[2 * at + 1] = static_cast<std::uint8_t>(millimetres >> 8U);
      for (int i = 0; i < 3; ++i)
        color.data()[3 * at + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(std::lround(255 * rgb[i]));
    }
  }
}

CameraInfo_ camera_info() {
  CameraInfo_ info;
  info.header().frame_id("camera_color_optical_frame");
  info.width(kWidth);
  info.height(kHeight);
  info.distortion_model("plumb_bob");
  info.d({0, 0, 0, 0, 0});
  const double cx = (kWidth - 1) / 2.0, cy = (kHeight - 1) / 2.0;
  info.k({kFocal, 0, cx, 0, kFocal, cy, 0, 0, 1});
  info.r({1, 0, 0, 0, 1, 0, 0, 0, 1});
  info.p({kFocal, 0, cx, 0, 0, kFocal, cy, 0, 0, 0, 1, 0});
  return info;
}

template <class Message>
void stamp(Message& message, std::int64_t stamp_ns) {
  message.header().stamp().sec(static_cast<std::int32_t>(stamp_ns / kSecond));
  message.header().stamp().nanosec(static_cast<std::uint32_t>(stamp_ns % kSecond));
}

TFMessage_ transform(const std::string& parent, const std::string& child, const Isometry3d& X, std::int64_t stamp_ns) {
  geometry_msgs::msg::dds_::TransformStamped_ one;
  stamp(one, stamp_ns);
  one.header().frame_id(parent);
  one.child_frame_id(child);
  const Eigen::Quaterniond q(X.linear());
  one.transform().translation().x(X.translation().x());
  one.transform().translation().y(X.translation().y());
  one.transform().translation().z(X.translation().z());
  one.transform().rotation().x(q.x());
  one.transform().rotation().y(q.y());
  one.transform().rotation().z(q.z());
  one.transform().rotation().w(q.w());
  TFMessage_ message;
  message.transforms({one});
  return message;
}

/// The number behind "stamp_ns": in the JSON of a belief; 0 without it.
std::int64_t stamp_of(const std::string& json) {
  const std::size_t at = json.find("\"stamp_ns\":");
  return at == std::string::npos ? 0 : std::strtoll(json.c_str() + at + 11, nullptr, 10);
}

/// What came in, from the threads of the middleware.
struct Heard {
  std::mutex mutex;
  std::condition_variable changed;
  std::int64_t start_ns = 0;
  int beliefs = 0, later_beliefs = 0, later_frames = 0, answers = 0;

  void print_truth(const char* what, std::int64_t stamp_ns) const {
    const Vector3d p = box_in_world(static_cast<double>(stamp_ns - start_ns) / kSecond).translation();
    std::printf("%s %lld %.5f %.5f %.5f ", what, static_cast<long long>(stamp_ns), p.x(), p.y(), p.z());
  }
  /// Whether the push was over a while before.
  bool is_later(std::int64_t stamp_ns) const { return stamp_ns - start_ns > 5 * kSecond / 2; }

  void belief(const String_& message) {
    const std::int64_t stamp_ns = stamp_of(message.data());
    print_truth("belief", stamp_ns);
    std::printf("%s\n", message.data().c_str());
    ++beliefs;
    if (is_later(stamp_ns)) ++later_beliefs;
  }
  void answer(const String_& message) {
    std::printf("answer %s\n", message.data().c_str());
    ++answers;
  }
  void tf(const TFMessage_& message) {
    for (const auto& one : message.transforms()) {
      if (one.child_frame_id() != "prescene/box") continue;
      const std::int64_t stamp_ns = one.header().stamp().sec() * kSecond + one.header().stamp().nanosec();
      print_truth("frame", stamp_ns);
      const auto& p = one.transform().translation();
      std::printf("%.5f %.5f %.5f\n", p.x(), p.y(), p.z());
      if (is_later(stamp_ns)) ++later_frames;
    }
  }
  bool is_enough() const { return later_beliefs >= kEnough && later_frames >= kEnough && answers > 0; }
};

template <class Message>
class Listener : public dds::DataReaderListener {
 public:
  Listener(Heard& heard, void (Heard::*take)(const Message&)) : heard_(heard), take_(take) {}
  void on_data_available(dds::DataReader* reader) override {
    Message message;
    dds::SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      const std::lock_guard lock(heard_.mutex);
      (heard_.*take_)(message);
      heard_.changed.notify_all();
    }
  }

 private:
  Heard& heard_;
  void (Heard::*take_)(const Message&);
};

/// A participant; what it made lives as long as the process.
class Node {
 public:
  explicit Node(int domain) {
    dds::DomainParticipantQos qos;
    qos.name("fast_dds_robot");
    // Without shared memory, whose files a killed process would leave behind.
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>());
    participant_ =
        dds::DomainParticipantFactory::get_instance()->create_participant(static_cast<dds::DomainId_t>(domain), qos);
    if (participant_ == nullptr) return;
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  }
  bool good() const { return publisher_ != nullptr && subscriber_ != nullptr; }

  template <class Type>
  dds::DataWriter* writer(const std::string& topic, bool reliable, bool latched = false) {
    dds::DataWriterQos qos;
    qos.reliability().kind = reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind = latched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 10;
    // As rmw_fastrtps sets them: messages of any length, sent in fragments by a thread of their own.
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
    return publisher_->create_datawriter(topic_of<Type>(topic), qos);
  }

  template <class Type, class Message>
  void read(const std::string& topic, Heard& heard, void (Heard::*take)(const Message&)) {
    dds::DataReaderQos qos;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 100;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    subscriber_->create_datareader(topic_of<Type>(topic), qos, new Listener<Message>(heard, take));
  }

 private:
  /// A node of ROS puts "rt" before the names of its topics.
  template <class Type>
  dds::Topic* topic_of(const std::string& name) {
    const std::string on_bus = "rt" + name;
    if (dds::TopicDescription* found = participant_->lookup_topicdescription(on_bus))
      return static_cast<dds::Topic*>(found);
    dds::TypeSupport type(new Type);
    type.register_type(participant_);
    return participant_->create_topic(on_bus, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  }

  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
};

int run(int domain) {
  using sensor_msgs::msg::dds_::CameraInfo_PubSubType;
  using sensor_msgs::msg::dds_::Image_PubSubType;
  using std_msgs::msg::dds_::String_PubSubType;
  using tf2_msgs::msg::dds_::TFMessage_PubSubType;
  auto& heard = *new Heard;  // outlives the threads of the middleware
  Node node(domain);
  if (!node.good()) {
    std::fprintf(stderr, "no participant in domain %d\n", domain);
    return 1;
  }
  node.read<String_PubSubType>("/prescene/belief", heard, &Heard::belief);
  node.read<String_PubSubType>("/prescene/answer", heard, &Heard::answer);
  node.read<TFMessage_PubSubType>("/tf", heard, &Heard::tf);
  dds::DataWriter* const depths =
      node.writer<Image_PubSubType>("/camera/aligned_depth_to_color/image_raw", /*reliable=*/false);
  dds::DataWriter* const colors = node.writer<Image_PubSubType>("/camera/color/image_raw", /*reliable=*/true);
  dds::DataWriter* const infos = node.writer<CameraInfo_PubSubType>("/camera/color/camera_info", /*reliable=*/true);
  dds::DataWriter* const tf = node.writer<TFMessage_PubSubType>("/tf", /*reliable=*/true);
  dds::DataWriter* const tf_static = node.writer<TFMessage_PubSubType>("/tf_static", /*reliable=*/true, true);
  dds::DataWriter* const queries = node.writer<String_PubSubType>("/prescene/query", /*reliable=*/true);

  TFMessage_ mounted = transform("base", "camera_color_optical_frame", camera_in_base(), wall_ns());
  tf_static->write(&mounted);  // once, as static_transform_publisher does
  CameraInfo_ info = camera_info();
  Image_ depth, color;
  bool asked = false;
  const auto end = steady_clock::now() + std::chrono::minutes(2);
  auto next_frame = steady_clock::now();
  std::unique_lock lock(heard.mutex);
  while (!heard.is_enough()) {
    const auto now = steady_clock::now();
    if (now > end) return 1;
    if (now >= next_frame) {
      next_frame = now + std::chrono::milliseconds(66);
      const std::int64_t stamp_ns = wall_ns();
      // The push waits until the service tracks.
      if (heard.beliefs == 0) heard.start_ns = stamp_ns;
      const Isometry3d X_WO = box_in_world(static_cast<double>(stamp_ns - heard.start_ns) / kSecond);
      const bool ask = heard.beliefs > 0 && !asked;
      lock.unlock();
      TFMessage_ driven = transform("world", "base", base_in_world(), stamp_ns);
      tf->write(&driven);
      stamp(info, stamp_ns);
      infos->write(&info);
      take_pictures(X_WO, depth, color);
      stamp(color, stamp_ns);
      colors->write(&color);
      stamp(depth, stamp_ns);
      depths->write(&depth);
      if (ask) {
        String_ question;
        question.data(R"({"id": "fast", "stability": {"object": "box"}})");
        queries->write(&question);
        asked = true;
      }
      lock.lock();
    } else {
      heard.changed.wait_until(lock, next_frame);
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const int code = run(argc > 1 ? std::atoi(argv[1]) : 0);
  std::fflush(stdout);
  // Its threads still listen; what they use goes with the process.
  std::_Exit(code);
}
