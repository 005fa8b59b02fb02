// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdio>
#include <ctime>
#include <vector>

#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/bullet/convex_decomposition.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"
#include "prescene/tests/support/uncertain_scenes.h"

using namespace prescene;

static double cpu() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

int main(int argc, char** argv) {
  const int n = argc > 1 ? atoi(argv[1]) : 300;
  for (const auto& [name, scene] : tests::uncertain_scenes()) {
    if (name == "D") continue;
    simulation::ShapeStore shapes(simulation::hacd_decomposer());
    auto simulator = *simulation::make_bullet_simulator(*scene, shapes, {});
    std::vector<belief::WorldState> starts;
    core::RandomStream stream(7, core::Purpose::kTest);
    for (int i = 0; i < n; ++i) {
      std::vector<double> u(static_cast<std::size_t>(belief::start_dimensions(*scene)));
      for (double& x : u) x = stream.uniform();
      starts.push_back(belief::draw_start(*scene, u));
    }
    core::ThreadPool pool(1);
    simulation::LockstepOptions lo;
    if (argc > 2) lo.live_instances = atoi(argv[2]);
    auto lockstep = simulation::make_lockstep_simulator(*scene, shapes, lo);
    if (!lockstep) {
      std::printf("%s\n", core::to_string(lockstep.status()).c_str());
      return 1;
    }
    const bool only = argc > 3;
    for (const simulation::Simulator* s : {simulator.get(), lockstep->get()}) {
      if (only && s == simulator.get()) continue;
      std::vector<belief::Trajectory> runs(starts.size());
      const double t0 = cpu();
      s->run(starts, {}, stream, 0, pool, runs);
      const double t = cpu() - t0;
      double seconds = 0.0;
      int ends[5] = {};
      for (const auto& r : runs) seconds += r.simulated_seconds, ++ends[static_cast<int>(r.end)];
      std::printf("%s %s: %.1f us an instance, %.1f steps, %.3f us a step; rest %d duration %d left %d diverged %d;", name.c_str(), s == simulator.get() ? "bullet" : "lockstep", 1e6 * t / n, seconds * 240 / n,
                1e6 * t / (seconds * 240), ends[0], ends[1], ends[2], ends[3]);
      for (const auto& o : scene->exclusive_outcomes[0].outcomes) {
        int c = 0;
        for (const auto& r : runs) c += belief::holds(*scene, r, o);
        std::printf(" %s %.3f", o.name.c_str(), double(c) / n);
      }
      std::printf("\n");
    }
  }
}
