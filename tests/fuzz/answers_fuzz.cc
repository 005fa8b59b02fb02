// SPDX-License-Identifier: Apache-2.0
// Any bytes as a question and its answer in a recording, which `replay` compares with what came and shows in its page:
// what has another form than it should is left out or said, and the page is written.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "fuzz_scene.h"
#include "prescene/core/check.h"
#include "prescene/service/recording/foreseen.h"
#include "prescene/service/recording/session_report.h"
#include "tests/support/paths.h"

namespace {

using namespace prescene;  // NOLINT(google-build-using-namespace)

std::shared_ptr<const belief::Scene> scene() {
  static const auto kScene = fuzz::scene_from(
      "name: two\nmodels:\n  box: {box: [0.1, 0.1, 0.1], mass: 0.4}\nsupports:\n  floor: {ground: {size: 4}}\n"
      "objects:\n  a: {model: box, pose: {position: [0, 0, 0.05]}}\n"
      "  b: {model: box, pose: {position: [1, 0, 0.05]}}\noutcomes:\n  falls: {object: a, below: 0.01}\n");
  return kScene;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tests::ScratchDir kScratch;
  static core::ThreadPool pool(1);
  static service::Backends backends(pool);
  const std::string text(reinterpret_cast<const char*>(data), size);
  // A question ends at the first line's end.
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string question = text.substr(0, end), answer = text.substr(std::min(text.size(), end + 1));
  service::ForeseenAndCame foreseen(scene());
  for (const std::uint64_t step : {1U, 2U}) {
    service::BeliefSummary summary;
    summary.step = step;
    summary.stamp_ns = static_cast<core::TimeNs>(step) * 1'000'000'000;
    foreseen.add(summary);
  }
  foreseen.add(1.0, question, answer);
  foreseen.add(1.0, question, question);
  for (const service::Comparison& comparison : foreseen.comparisons()) PRESCENE_CHECK(!comparison.question.empty());

  service::SessionReport report(scene(), {}, backends);
  report.add_answer(1.0, answer);
  report.add_answer(2.0, question);
  report.set_foreseen(foreseen);
  const core::Status written = report.write(kScratch.path() / "session.html", service::TrackingScore(scene()));
  PRESCENE_CHECK_MSG(written.ok(), written.message());
  return 0;
}
