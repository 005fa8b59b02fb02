// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/telling_frames.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

namespace prescene::queries {
namespace {

constexpr int kSampled = 8;        // pixels between two that changes are looked for at
constexpr float kChanged = 0.02F;  // m; a depth that changes by more has changed
constexpr int kColorChanged = 90;  // sum over red, green and blue

/// Share of the sampled pixels that differ; both images hold every `held`-th pixel of the camera's.
double change_between(const belief::RgbdFrame& a, const belief::RgbdFrame& b, int held) {
  const int step = std::max(1, kSampled / std::max(1, held));
  if (!a.depth || !b.depth || a.depth->width() != b.depth->width() || a.depth->height() != b.depth->height())
    return 1.0;
  const bool colors = a.color && b.color && a.color->width() == a.depth->width() &&
                      b.color->width() == a.depth->width() && a.color->height() == a.depth->height() &&
                      b.color->height() == a.depth->height();
  int changed = 0, all = 0;
  for (int y = step / 2; y < a.depth->height(); y += step)
    for (int x = step / 2; x < a.depth->width(); x += step) {
      ++all;
      const float p = (*a.depth)(x, y), q = (*b.depth)(x, y);
      bool differs = p > 0.0F && q > 0.0F && std::abs(p - q) > kChanged;
      if (colors && !differs) {
        int difference = 0;
        for (std::size_t c = 0; c < 3; ++c)
          difference += std::abs(static_cast<int>((*a.color)(x, y)[c]) - static_cast<int>((*b.color)(x, y)[c]));
        differs = difference > kColorChanged;
      }
      changed += differs ? 1 : 0;
    }
  return all > 0 ? static_cast<double>(changed) / all : 0.0;
}

/// Of one camera, whose frames of `frames` are `mine`, `wanted` of them; of one alone the last.
void choose_of_camera(std::span<const WindowFrame> frames, const std::vector<std::size_t>& mine, std::size_t wanted,
                      std::vector<std::size_t>& chosen) {
  if (mine.size() <= wanted) {
    chosen.insert(chosen.end(), mine.begin(), mine.end());
    return;
  }
  if (wanted < 2) {
    if (wanted == 1) chosen.push_back(mine.back());
    return;
  }
  chosen.push_back(mine.front());
  // A quarter of the weight goes by time alone, so that stillness is seen, too.
  std::vector<double> passed(mine.size(), 0.0);
  for (std::size_t i = 1; i < mine.size(); ++i)
    passed[i] = passed[i - 1] + change_between(frames[mine[i - 1]].observation.frame, frames[mine[i]].observation.frame,
                                               frames[mine[i]].sampled);
  const double all = passed.back();
  const auto at = [&](std::size_t i) {
    const double time = static_cast<double>(i) / static_cast<double>(mine.size() - 1);
    return all > 0.0 ? 0.25 * time + 0.75 * passed[i] / all : time;
  };
  std::size_t last = 0;
  for (std::size_t n = 2; n <= wanted; ++n) {
    std::size_t i = last + 1;
    const double share = static_cast<double>(n - 1) / static_cast<double>(wanted - 1);
    while (i + 1 < mine.size() && at(i) + 1e-9 < share) ++i;
    // Room for those that are still to come.
    last = std::min(i, mine.size() - 1 - (wanted - n));
    chosen.push_back(mine[last]);
  }
}

}  // namespace

std::vector<std::size_t> telling_frames(std::span<const WindowFrame> frames, int count) {
  std::map<int, std::vector<std::size_t>> of_cameras;
  for (std::size_t i = 0; i < frames.size(); ++i) of_cameras[frames[i].observation.camera].push_back(i);
  // The camera of the last frame first: it gets what can't be divided.
  std::vector<const std::vector<std::size_t>*> order;
  for (const auto& [camera, mine] : of_cameras) order.push_back(&mine);
  std::sort(order.begin(), order.end(), [](const auto* a, const auto* b) { return a->back() > b->back(); });
  // Shares as even as they can be: what a camera has not is for the others.
  std::vector<std::size_t> shares(order.size(), 0);
  const std::size_t wanted = std::min(static_cast<std::size_t>(count), frames.size());
  for (std::size_t given = 0; given < wanted;)
    for (std::size_t c = 0; c < order.size() && given < wanted; ++c)
      if (shares[c] < order[c]->size()) ++shares[c], ++given;
  std::vector<std::size_t> chosen;
  for (std::size_t c = 0; c < order.size(); ++c) choose_of_camera(frames, *order[c], shares[c], chosen);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

std::vector<std::size_t> last_of_cameras(std::span<const WindowFrame> frames) {
  std::map<int, std::size_t> last;
  for (std::size_t i = 0; i < frames.size(); ++i) last[frames[i].observation.camera] = i;
  std::vector<std::size_t> numbers;
  for (const auto& [camera, i] : last) numbers.push_back(i);
  std::sort(numbers.rbegin(), numbers.rend());
  return numbers;
}

}  // namespace prescene::queries
