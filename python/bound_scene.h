// SPDX-License-Identifier: Apache-2.0
// A scene as Python holds it, and what computes on it.
#pragma once

#include <pybind11/pybind11.h>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "prescene/belief/scene.h"
#include "prescene/core/parallel.h"
#include "prescene/service/backends.h"

namespace prescene::python {

/// Threads, and backends that keep the shapes they make.
struct Engine {
  Engine(int threads, const service::BackendSettings& settings) : pool(threads), backends(pool, settings) {}
  core::ThreadPool pool;
  service::Backends backends;
};

/// The engines of one scene, made when first asked for and kept with it, so that shapes are made once. Safe to use from
/// several threads.
class Engines {
 public:
  /// `threads`: 0 = as many as the machine has.
  std::shared_ptr<Engine> get(int threads, service::Stepper stepper);

 private:
  std::mutex mutex_;
  std::map<std::pair<int, service::Stepper>, std::shared_ptr<Engine>> engines_;
};

struct BoundScene {
  std::shared_ptr<const belief::Scene> scene;
  std::shared_ptr<Engines> engines = std::make_shared<Engines>();
};

/// prescene.InputError for another word than automatic, bullet and lockstep.
service::Stepper stepper_named(const std::string& name);
/// prescene.InputError unless it is a number of threads from 0 to 1024.
void check_threads(int threads);

void bind_scenes(pybind11::module_& module);
void bind_questions(pybind11::module_& module);
void bind_replays(pybind11::module_& module);
void bind_collision(pybind11::module_& module);

}  // namespace prescene::python
