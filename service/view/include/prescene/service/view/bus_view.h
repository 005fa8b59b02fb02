// SPDX-License-Identifier: Apache-2.0
// The live view of a service that runs elsewhere: listens on the bus for its belief and for the robot's camera, and
// asks it the questions of the page. It needs no scene file: without one, objects look as the service's markers do.
#pragma once

#include <memory>
#include <string>

#include "prescene/core/progress.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/service/tracking/tracker_settings.h"
#include "prescene/service/view/live_view.h"

namespace prescene::service {

struct BusViewSettings {
  interfaces::DdsOptions dds;
  TrackerSettings tracker;  ///< Its topics, and where the camera is.
  ViewOptions view;
};

class BusView {
 public:
  /// Joins the bus and serves the page; `scene` may be null. Errors of DdsNode::create and LiveView::create.
  static core::Result<std::unique_ptr<BusView>> create(const std::shared_ptr<const belief::Scene>& scene,
                                                       const BusViewSettings& settings, const core::LogSink& log);
  ~BusView();

  std::string url() const;
  int port() const;
  /// Until cancelled; says on the page, and once in the log, while no service is there.
  void run(const core::Cancellation& cancellation);

 private:
  struct Impl;
  explicit BusView(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::service
