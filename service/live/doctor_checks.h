// SPDX-License-Identifier: Apache-2.0
// What the doctor's checks share, and the checks of doctor_camera_checks.cc: one camera's topics, images, lens, pose
// and stamps.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "prescene/service/live/bus_evidence.h"
#include "prescene/service/live/doctor.h"

namespace prescene::service {

/// Adds to the list of what was found.
class Checks {
 public:
  /// `camera`: that all of them are about. `error`: what a failure is; a warning where another camera is used.
  explicit Checks(std::vector<DoctorCheck>& checks, std::string camera = "", CheckStatus error = CheckStatus::kError)
      : checks_(checks), camera_(std::move(camera)), error_(error) {}
  void ok(const std::string& name, const std::string& what) { add(name, CheckStatus::kOk, what, ""); }
  void warn(const std::string& name, const std::string& what, const std::string& remedy) {
    add(name, CheckStatus::kWarning, what, remedy);
  }
  void fail(const std::string& name, const std::string& what, const std::string& remedy) {
    add(name, error_, what, remedy);
  }

 private:
  void add(const std::string& name, CheckStatus status, const std::string& what, const std::string& remedy) {
    checks_.push_back({name, camera_, status, what, remedy});
  }
  std::vector<DoctorCheck>& checks_;
  std::string camera_;
  CheckStatus error_;
};

/// "1 camera", "2 cameras".
std::string counted_text(std::size_t number, const std::string& thing);
/// "29.9 Hz", or the number of messages while the rate is unknown.
std::string rate_text(const TopicEvidence& topic);
/// Number of writers of a topic under the type that is read.
int writers_of(const BusSurroundings& around, const std::string& topic, const std::string& type);

/// Everything about one camera except its frames; whether depth images of it come.
bool check_one_camera(const BusEvidence& evidence, const BusSurroundings& around, Checks& checks);
/// How many of its depth images make frames, and why others do not.
void check_frames(const BusEvidence& evidence, Checks& checks);

}  // namespace prescene::service
