// SPDX-License-Identifier: Apache-2.0
// Publishes the camera's picture with the belief drawn over it, for rqt_image_view and RViz: while somebody subscribes,
// on a thread of its own and at a bounded rate, so that no frame waits for it. Where it can't keep up, the newest frame
// is drawn.
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/service/backends.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/tracking/camera_frames.h"

namespace prescene::service {

/// One frame that was used, with what was believed after it.
struct OverlayFrame {
  std::shared_ptr<const belief::Belief> belief;
  BeliefSummary summary;
  belief::Observation observation;
  std::string camera_frame;  ///< In tf.
};

class OverlayPublisher {
 public:
  /// Advertises kOverlayTopic, kOverlayCompressedTopic and kOverlayInfoTopic, as many of them as are allowed (see
  /// refused()); fails where neither of the pictures is. `rate`: pictures a second at most, > 0.
  /// `on_failure` is told why a picture could not be made or sent, on the overlay's thread. All must outlive it.
  static core::Result<std::unique_ptr<OverlayPublisher>> create(interfaces::DdsNode& node, Backends& backends,
                                                                double rate,
                                                                std::function<void(const core::Status&)> on_failure);
  ~OverlayPublisher();
  OverlayPublisher(const OverlayPublisher&) = delete;
  OverlayPublisher& operator=(const OverlayPublisher&) = delete;

  /// Whether somebody looks and a picture is due; of several cameras those of the first are drawn, and others while it
  /// gives none. Whoever makes frames asks first, as they cost copies.
  bool wants(const belief::Observation& observation);
  /// The topics that could not be advertised, and why.
  const std::vector<std::pair<std::string, core::Status>>& refused() const { return refused_; }
  /// Returns at once.
  void show(OverlayFrame frame);
  /// Pictures that were drawn since the start.
  std::uint64_t drawn() const { return drawn_.load(std::memory_order_relaxed); }

 private:
  OverlayPublisher(interfaces::DdsNode& node, Backends& backends, double rate,
                   std::function<void(const core::Status&)> on_failure)
      : node_(node), backends_(backends), interval_s_(1.0 / rate), on_failure_(std::move(on_failure)) {}
  std::optional<interfaces::DdsPublisher> advertised(const char* topic, const char* type, interfaces::TopicQos qos);
  bool is_read(const std::optional<interfaces::DdsPublisher>& publisher) const {
    return publisher && node_.matched_readers(*publisher) > 0;
  }
  void work();
  core::Status publish(const OverlayFrame& frame);

  interfaces::DdsNode& node_;
  Backends& backends_;
  double interval_s_;
  std::function<void(const core::Status&)> on_failure_;
  std::optional<interfaces::DdsPublisher> image_, compressed_, info_;  // those that may be written
  std::vector<std::pair<std::string, core::Status>> refused_;
  PicturedFrames pictured_;               // of the caller's thread
  std::optional<core::Stopwatch> since_;  // the same: the last frame that was wanted
  std::atomic<std::uint64_t> drawn_{0};
  std::mutex mutex_;  // guards what is handed over
  std::condition_variable changed_;
  std::optional<OverlayFrame> next_;
  bool stop_ = false;
  std::thread thread_;  // last: it uses all above
};

}  // namespace prescene::service
