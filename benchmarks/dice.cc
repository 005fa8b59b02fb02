// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/dice.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "prescene/core/random.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/simple_scenes.h"

namespace prescene::benchmarks {
namespace {

RootMeanSquare without_chance(const std::vector<double>& differences, const std::vector<double>& variances) {
  std::vector<double> squares;
  for (std::size_t i = 0; i < differences.size(); ++i)
    squares.push_back(differences[i] * differences[i] - variances[i]);
  const auto n = static_cast<double>(squares.size());
  double mean = 0.0, spread = 0.0;
  for (const double square : squares) mean += square / n;
  for (const double square : squares) spread += (square - mean) * (square - mean);
  const double error = std::sqrt(spread / (n * (n - 1.0)));
  const auto root = [](double square) { return std::sqrt(std::max(0.0, square)); };
  return {root(mean), root(mean - error), root(mean + error)};
}

}  // namespace

belief::Scene dice_scene(double width, double ratio, const DiceThrow& how) {
  constexpr double kSteel = 7800.0;  // kg/m^3
  belief::ObjectModel model = tests::primitive_model("die", geometry::BoxShape{{width, width, ratio * width}},
                                                     kSteel * ratio * width * width * width);
  model.contact.friction = belief::FixedScalar{how.friction};
  model.contact.restitution = belief::FixedScalar{how.restitution};
  return tests::floor_scene(model);
}

std::vector<belief::WorldState> dice_starts(const belief::Scene& scene, const DiceThrow& how, int count,
                                            std::uint64_t seed) {
  core::RandomStream stream(seed, core::Purpose::kTest);
  std::vector<belief::WorldState> starts;
  for (int i = 0; i < count; ++i) {
    belief::WorldState start = belief::mean_start(scene);
    start.objects[0].X_WO = {geometry::uniform_rotation(stream), {0.0, 0.0, how.height}};
    start.objects[0].V_WO.linear = {how.speed, 0.0, -how.fall};
    start.objects[0].V_WO.angular = how.spin * geometry::normal_vector(stream);
    starts.push_back(start);
  }
  return starts;
}

bool lies_on_square_face(const belief::WorldState& end) {
  Eigen::Index axis = 0;
  end.objects[0].X_WO.rotation.toRotationMatrix().row(2).cwiseAbs().maxCoeff(&axis);
  return axis == 2;
}

RootMeanSquare compare_dice(const std::function<SquareShares(const DiceKind&)>& throw_both_ways) {
  std::vector<double> differences, variances;
  const auto variance = [](double share, int throws) { return share * (1.0 - share) / (throws - 1); };
  for (const DiceThrow& how : kDiceThrows) {
    std::fprintf(stderr, "dice, %s\n", how.name);
    for (const double width : kDiceWidths) {
      for (const double ratio : kDiceRatios) {
        const SquareShares shares =
            throw_both_ways({differences.size(), how, width, ratio, dice_scene(width, ratio, how)});
        differences.push_back(shares.first - shares.second);
        variances.push_back(variance(shares.first, shares.first_throws) +
                            variance(shares.second, shares.second_throws));
      }
    }
  }
  return without_chance(differences, variances);
}

}  // namespace prescene::benchmarks
