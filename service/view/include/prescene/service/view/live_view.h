// SPDX-License-Identifier: Apache-2.0
// The live view of a running service: each step is handed over as shared values, and everything that costs time is done
// on a thread of its own, of a lower priority, and only while somebody looks.
//
//   PRESCENE_TRY(const auto view, LiveView::create(scene, {.port = 8765}, log));
//   view->set_asker([&](std::string question) { service->ask(std::move(question)); });
//   view->show({belief, observation, seconds, degraded});   // after each step, of whichever camera
//   view->answer(answer_json);                              // whenever a question was answered
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "prescene/service/view/view_content.h"
#include "prescene/service/view/view_server.h"

namespace prescene::service {

class LiveView {
 public:
  static core::Result<std::unique_ptr<LiveView>> create(std::shared_ptr<const belief::Scene> scene,
                                                        const ViewOptions& options, const core::LogSink& log);
  ~LiveView();

  std::string url() const;
  int port() const;
  interfaces::WebCounts counts() const;
  /// Who is given the questions of the pages, from the server's thread; empty = nobody. The one before is not called
  /// any more once this has returned.
  void set_asker(std::function<void(std::string question)> asker);
  /// Hands a step over and returns at once. One that nobody has looked at yet is replaced by the next; of several
  /// cameras the newest frame of each is shown.
  void show(ShownStep step);
  /// A frame of one of several cameras that comes without a step.
  void note_frame(const belief::Observation& observation);
  /// Passes an answer on to the page that asked; others' answers are left alone. From any thread.
  void answer(const std::string& answer);
  /// A sentence on how the service is, for the page: shown until the next one.
  void set_health(const std::string& text);

 private:
  struct Impl;
  explicit LiveView(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::service
