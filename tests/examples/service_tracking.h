// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/tracking take for granted.
#pragma once

#include <memory>

#include "prescene/belief/scene.h"
#include "prescene/service/backends.h"
#include "prescene/service/tracking/tracker.h"
#include "prescene/service/tracking/tracker_settings.h"

namespace prescene::service::given_service_tracking {

extern Backends backends;
extern const TrackerSettings settings;

namespace joint_transforms_h {
extern const std::shared_ptr<const interfaces::RobotKinematics> robot;
extern const interfaces::RosJointState joint_state;
extern TfBuffer tf;
}  // namespace joint_transforms_h

namespace camera_frames_h {
extern const std::shared_ptr<const belief::Scene> scene;
extern const interfaces::ReceivedMessage message;
extern const MessageIndex index;
extern const core::TimeNs received_ns, now_ns;
}  // namespace camera_frames_h

namespace tracker_h {
extern const std::shared_ptr<const belief::Scene> scene;
extern const std::uint64_t seed;
extern const interfaces::ReceivedMessage message;
extern const MessageIndex index;
extern const core::TimeNs now_ns;
}  // namespace tracker_h

namespace tracker_snapshot_h {
extern const std::shared_ptr<const belief::Scene> scene;
extern const Tracker tracker;
extern Tracker other;
}  // namespace tracker_snapshot_h

}  // namespace prescene::service::given_service_tracking
