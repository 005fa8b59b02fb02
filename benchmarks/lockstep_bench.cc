// SPDX-License-Identifier: Apache-2.0
// CPU time of an instance in lockstep against Bullet's stepper, on one thread, on the uncertain scenes and those of
// scenarios/ that both simulate, hollow things among them; and whether they end in the same class.
//
//   bench_lockstep [--quick] [--scenarios=FOLDER] [--benchmark_out=PATH]
#include <hwy/targets.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <string>
#include <string_view>
#include <vector>

#include "benchmarks/arguments.h"
#include "benchmarks/processor_time.h"
#include "benchmarks/report.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/bullet/convex_decomposition.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"
#include "prescene/simulation/rules/contact_rules.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::benchmarks {
namespace {

std::vector<belief::WorldState> drawn_starts(const belief::Scene& scene, int count) {
  std::vector<belief::WorldState> starts;
  core::RandomStream stream(7, core::Purpose::kEvaluation);
  std::vector<double> uniforms(static_cast<std::size_t>(belief::start_dimensions(scene)));
  for (int i = 0; i < count; ++i) {
    for (double& u : uniforms) u = stream.uniform();
    starts.push_back(belief::draw_start(scene, uniforms));
  }
  return starts;
}

/// Runs the starts, `together` a call; returns the CPU time of an instance, s.
double measure(const simulation::Simulator& simulator, const belief::Scene& scene,
               const std::vector<belief::WorldState>& starts, std::size_t together,
               std::vector<belief::Trajectory>& runs) {
  core::ThreadPool pool(1);
  simulation::RunRequest request;
  request.stop.duration = scene.duration;
  request.stop.stop_at_rest = scene.stop_at_rest;
  request.actions = scene.actions;
  runs.resize(starts.size());
  const double begun = processor_seconds();
  for (std::size_t begin = 0; begin < starts.size(); begin += together) {
    const std::size_t count = std::min(together, starts.size() - begin);
    simulator.run({starts.data() + begin, count}, request, core::RandomStream(1, core::Purpose::kEvaluation),
                  static_cast<std::uint32_t>(begin), pool, {runs.data() + begin, count});
  }
  return (processor_seconds() - begun) / static_cast<double>(starts.size());
}

/// HWY_DYNAMIC_DISPATCH goes to this instruction set as long as it lives; 0: to the best.
class UseTarget {
 public:
  explicit UseTarget(std::int64_t target) { choose(target); }
  UseTarget(const UseTarget&) = delete;
  UseTarget& operator=(const UseTarget&) = delete;
  ~UseTarget() { choose(0); }

 private:
  static void choose(std::int64_t target) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().DeInit();
  }
};

void compare(const std::string& name, const belief::Scene& scene, int count, Table& table, Report& report) {
  simulation::ShapeStore shapes(simulation::hacd_decomposer());
  const auto bullet = simulation::make_bullet_simulator(scene, shapes);
  const auto lockstep = simulation::make_lockstep_simulator(scene, shapes);
  if (!bullet || !lockstep) return;
  const std::vector<belief::WorldState> starts = drawn_starts(scene, count);
  std::vector<belief::Trajectory> reference, runs;
  const double bullet_seconds = measure(**bullet, scene, starts, starts.size(), reference);
  const auto ratio = [&](const std::string& how, std::size_t together) {
    const double seconds = measure(**lockstep, scene, starts, together, runs);
    std::int64_t same = 0;
    double steps = 0.0;
    for (std::size_t i = 0; i < starts.size(); ++i) {
      const belief::ExclusiveOutcomes& classes = scene.exclusive_outcomes.front();
      same += belief::classify(scene, reference[i], classes) == belief::classify(scene, runs[i], classes) ? 1 : 0;
      steps += 240.0 * runs[i].simulated_seconds;
    }
    table.rows.push_back({name, how, static_cast<std::int64_t>(together), 1e6 * bullet_seconds, 1e6 * seconds,
                          bullet_seconds / seconds, steps / count, static_cast<double>(same) / count});
    return bullet_seconds / seconds;
  };
  const std::string best = best_simd_target();
  for (const std::size_t together : {starts.size(), std::size_t{64}, std::size_t{16}}) {
    Target target;
    target.work = "CPU time an instance, scene " + name + ", " + std::to_string(together) + " starts a call";
    // Held to it are the scenes that the stepper was made for: one moving body, and hollow things.
    const bool hollow = std::any_of(scene.models.begin(), scene.models.end(), [](const belief::ObjectModel& model) {
      return simulation::collides_as_spheres(model.collision);
    });
    if (together == starts.size() && (hollow || scene.objects.size() == 1)) target.must = at_least(3.0);
    target.reached = ratio(best, together);
    target.unit = "x";
    target.n = count;
    target.baseline = "our Bullet stepper, same starts, one thread";
    report.add(std::move(target));
  }
  if ((hwy::SupportedTargets() & HWY_AVX2) == 0 || best == hwy::TargetName(HWY_AVX2)) return;
  const UseTarget narrower(HWY_AVX2);
  ratio(hwy::TargetName(HWY_AVX2), starts.size());
}

int run(int count, const std::string& scenarios, const std::string& out) {
  Report report("lockstep", best_simd_target());
  Table table{
      "instances",
      {"scene", "instructions", "starts a call", "Bullet us", "lockstep us", "ratio", "steps", "same class as Bullet"},
      {}};
  for (const auto& [name, scene] : tests::uncertain_scenes()) {
    compare(name, *scene, count, table, report);
  }
  struct Scenario {
    const char* name;
    int share;  // of the count: an instance of hollow things takes Bullet's stepper 0.1 s and more
  };
  for (const auto& [name, share] :
       {Scenario{"milk_on_bin", 1}, Scenario{"pushed_stack", 1}, Scenario{"bottle_by_the_edge", 1},
        Scenario{"tossed_box", 1}, Scenario{"mug_on_hook", 4}, Scenario{"spoon_in_mug", 16}}) {
    const auto scene = interfaces::read_scene(scenarios + "/" + name + ".yaml");
    if (scene) {
      compare(name, *scene, std::max(count / share, 16), table, report);
    } else {
      std::fprintf(stderr, "%s\n", core::to_string(scene.status()).c_str());
    }
  }
  std::fputs(text_of(table).c_str(), stdout);
  report.add(std::move(table));
  std::fputs(report.text().c_str(), stdout);
  return report.finish(out);
}

}  // namespace
}  // namespace prescene::benchmarks

int main(int argc, char** argv) {
  int count = 2048;
  std::string scenarios = "scenarios";
  std::string out;
  prescene::benchmarks::Arguments arguments;
  arguments.flag("quick", [&] { count = 256; });
  arguments.text("scenarios", "FOLDER", &scenarios);
  arguments.text("benchmark_out", "PATH", &out);
  return arguments.parse(argc, argv) ? prescene::benchmarks::run(count, scenarios, out) : 2;
}
