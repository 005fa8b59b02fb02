// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/overlay_publisher.h"

#include <exception>
#include <utility>

#include "prescene/core/thread_priority.h"
#include "prescene/interfaces/images/jpeg.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/pictures/belief_overlay.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

using interfaces::TopicQos;

// As of the live view: edges stay sharp, and a picture of 640 x 480 pixels takes some 60 kB.
constexpr int kOverlayQuality = 80;

}  // namespace

core::Result<std::unique_ptr<OverlayPublisher>> OverlayPublisher::create(
    interfaces::DdsNode& node, Backends& backends, double rate, std::function<void(const core::Status&)> on_failure) {
  std::unique_ptr<OverlayPublisher> made(new OverlayPublisher(node, backends, rate, std::move(on_failure)));
  made->image_ = made->advertised(kOverlayTopic, "sensor_msgs/msg/Image", TopicQos::kImages);
  made->compressed_ = made->advertised(kOverlayCompressedTopic, "sensor_msgs/msg/CompressedImage", TopicQos::kImages);
  if (!made->image_ && !made->compressed_) return made->refused_.front().second;
  made->info_ = made->advertised(kOverlayInfoTopic, "sensor_msgs/msg/CameraInfo", TopicQos::kState);
  made->thread_ = std::thread([raw = made.get()] { raw->work(); });
  return made;
}

std::optional<interfaces::DdsPublisher> OverlayPublisher::advertised(const char* topic, const char* type,
                                                                     TopicQos qos) {
  auto publisher = node_.advertise(topic, type, qos);
  if (publisher) return *publisher;
  refused_.emplace_back(topic, publisher.status());
  return std::nullopt;
}

OverlayPublisher::~OverlayPublisher() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

bool OverlayPublisher::wants(const belief::Observation& observation) {
  if (!pictured_.has(observation)) return false;
  if (since_ && since_->seconds() < interval_s_) return false;
  return is_read(image_) || is_read(compressed_);
}

void OverlayPublisher::show(OverlayFrame frame) {
  since_.emplace();
  {
    const std::lock_guard lock(mutex_);
    next_ = std::move(frame);
  }
  changed_.notify_one();
}

void OverlayPublisher::work() {
  core::lower_thread_priority();  // who looks on does not take the processor from who tracks
  for (;;) {
    std::optional<OverlayFrame> frame;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stop_ || next_; });
      if (stop_) return;
      frame = std::exchange(next_, std::nullopt);
    }
    try {
      const core::Status status = publish(*frame);
      if (!status.ok()) on_failure_(status);
    } catch (const std::exception& error) {
      on_failure_(core::unavailable(std::string("no overlay was drawn: ") + error.what()));
    }
  }
}

core::Status OverlayPublisher::publish(const OverlayFrame& frame) {
  PRESCENE_TRY(const geometry::ColorImage picture,
               belief_overlay(*frame.belief->scene, frame.summary, frame.observation, backends_));
  const interfaces::RosHeader header{interfaces::to_ros_time(frame.observation.stamp_ns), frame.camera_frame};
  drawn_.fetch_add(1, std::memory_order_relaxed);
  // First, so that it is there when the picture comes.
  if (info_)
    PRESCENE_RETURN_IF_ERROR(
        node_.publish(*info_, interfaces::to_ros_camera_info(frame.observation.frame.camera, header)));
  if (is_read(image_)) PRESCENE_RETURN_IF_ERROR(node_.publish(*image_, interfaces::to_ros_image(picture, header)));
  if (!is_read(compressed_)) return core::ok_status();
  return node_.publish(*compressed_,
                       interfaces::RosCompressedImage{header, "rgb8; jpeg compressed bgr8",
                                                      interfaces::encode_jpeg(picture.view(), kOverlayQuality)});
}

}  // namespace prescene::service
