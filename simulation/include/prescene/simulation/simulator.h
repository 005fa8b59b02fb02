// SPDX-License-Identifier: Apache-2.0
// The contract of a forward simulator: many independent instances of one scene, each from its own world state.
//
//   PRESCENE_TRY(auto simulator, make_simulator(scene));     // of a backend: prescene/simulation/bullet/...
//   std::vector<belief::Trajectory> runs(starts.size());
//   simulator->run(starts, request, stream, 0, pool, runs);
//
// The same scene, starts, request and stream give the same bits, for any number of threads and any split into calls.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/belief/trajectory.h"
#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/core/random.h"
#include "prescene/core/status.h"

namespace prescene::simulation {

/// When an instance stops. How many are run: outcome_estimator.h in simulation/outcomes.
struct StopRule {
  double duration = 5.0;       ///< s, at most
  bool stop_at_rest = true;    ///< Stop when everything is at rest: see RestRule.
  double world_radius = 20.0;  ///< m from the origin: beyond it an object has left the world and is frozen.
};

/// At rest = kinetic energy per mass below `energy` for `time`, and no object in an unstable equilibrium (a nudge of
/// its pose that lowers its centre of mass against its contacts is looked for).
struct RestRule {
  double energy = 2e-4;  ///< J/kg
  double time = 0.2;     ///< s
};

/// Looks at instances under way and says which may end, because what is asked of them is decided. Pure; called from
/// several threads.
class EndRule {
 public:
  virtual ~EndRule() = default;
  /// `seconds_left` of the run's duration.
  virtual bool ends(const belief::WorldState& state, double seconds_left) const = 0;
};

struct RunRequest {
  std::vector<belief::Action> actions;  ///< Instead of the scene's; times from the start of the run.
  StopRule stop;
  /// Asked every so many steps; an instance that it ends has TrajectoryEnd::kDecided. Must outlive the run; simulators
  /// may do without it.
  const EndRule* end_rule = nullptr;
  int end_rule_steps = 4;
  /// States are kept every so many seconds (first and last always); 0 = first and last only.
  double sample_interval = 0.0;
};

/// Everything that the next step depends on, contact caches and warm starts included. Opaque, of one simulator type.
struct Snapshot {
  std::vector<std::uint8_t> bytes;
};

/// One instance that can be stepped, saved and restored: for filters and interactive use.
class Instance {
 public:
  virtual ~Instance() = default;
  virtual void set_state(const belief::WorldState& state) = 0;
  virtual belief::WorldState state() const = 0;
  /// One fixed step of the simulator.
  virtual void step() = 0;
  virtual double step_size() const = 0;
  virtual bool at_rest() const = 0;
  virtual Snapshot save() const = 0;
  /// A restored instance goes on with the same bits as the saved one.
  virtual core::Status restore(const Snapshot& snapshot) = 0;
};

/// Which instances of all those of a stream a run is of.
class InstanceNumbers {
 public:
  /// first, first + 1, ...
  InstanceNumbers(std::uint32_t first) : first_(first) {}  // NOLINT(google-explicit-constructor)
  /// These; they must outlive the run.
  InstanceNumbers(std::span<const std::uint32_t> numbers)  // NOLINT(google-explicit-constructor)
      : numbers_(numbers) {}

  /// Of the run's i-th instance.
  std::uint32_t operator[](std::size_t i) const {
    return numbers_.empty() ? first_ + static_cast<std::uint32_t>(i) : numbers_[i];
  }

 private:
  std::uint32_t first_ = 0;
  std::span<const std::uint32_t> numbers_;
};

/// Which of our steppers a simulator runs on, and why.
struct StepperUse {
  std::string name;          ///< "lockstep" or "bullet"; "" = another, which has no name.
  std::string not_lockstep;  ///< Why it is not "lockstep", where that was asked for first; else "".
  double hull_error = 0.0;   ///< m: how far hulls lie inside the scene's because they are simplified; 0 = none is.
};

class Simulator {
 public:
  virtual ~Simulator() = default;

  /// Whether it can run `request`: kUnsupported names what of it can't be run. A simulator can run its scene's own
  /// actions in any case; a request that it does not support must not be given to run() or make_instance() (checked).
  virtual core::Status supports(const RunRequest& /*request*/) const { return core::ok_status(); }
  virtual StepperUse stepper() const { return {}; }

  /// Runs starts.size() instances; trajectories.size() == starts.size(). Instance i uses stream.at(0, numbers[i]) for
  /// what is random in its actions. A cancelled run ends its instances with TrajectoryEnd::kCancelled.
  virtual void run(std::span<const belief::WorldState> starts, const RunRequest& request,
                   const core::RandomStream& stream, InstanceNumbers numbers, core::ThreadPool& pool,
                   std::span<belief::Trajectory> trajectories,
                   const core::Cancellation* cancellation = nullptr) const = 0;

  /// Of every step, s; 0 = it takes none.
  virtual double step_size() const { return 0.0; }
  /// True lengths over those of MechanicsOptions: other than 1 where similar things of household size are simulated
  /// (prescene/simulation/similarity.h).
  virtual double length_scale() const { return 1.0; }
  virtual std::unique_ptr<Instance> make_instance(const std::vector<belief::Action>& actions,
                                                  const core::RandomStream& stream) const = 0;
};

/// Makes a simulator of a scene, with steps `step_factor` times as long as the factory's own (1 = its own). Whoever
/// needs simulators without knowing which takes one of these; service makes it. The scene need not outlive the call.
using SimulatorFactory =
    std::function<core::Result<std::unique_ptr<Simulator>>(const belief::Scene& scene, double step_factor)>;

}  // namespace prescene::simulation
