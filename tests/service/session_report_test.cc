// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/session_report.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "query_worker_fixture.h"
#include "tests/support/paths.h"

namespace prescene::service {
namespace {

// Answers come over the bus: whoever is in the domain can send one under the id of ours.
TEST(SessionReport, AnswersOfAnotherFormAreSaidToBe) {
  core::ThreadPool pool(1);
  Backends backends(pool);
  const auto belief = tests::belief_of(tests::kBoxScene);
  SessionReport report(belief->scene, {}, backends);
  for (const char* answer : {"", "{", "[]", R"({"error": 3})", R"({"predict": {"outcomes": [{"interval": [0.5]}]}})",
                             R"({"predict": {"outcomes": 3}})", R"({"predict": {"final_poses": [{}]}})",
                             R"({"predict": {"final_poses": [{"heat_map": {"nx": 1000, "ny": 1000, "mass": [1.0]}}]}})",
                             R"({"predict": {"final_poses": [{"heat_map": {"nx": -1, "ny": -1, "mass": [1.0]}}]}})",
                             R"({"predict": {"typical_runs": [{"timeline": [3]}]}})", R"({"stability": {}})",
                             R"({"stability": {"stable": {"interval": []}}})"})
    report.add_answer(1.0, answer);
  const tests::ScratchDir folder;
  const core::Status written = report.write(folder.path() / "report.html", TrackingScore(belief->scene));
  EXPECT_TRUE(written.ok()) << written.message();
}

TEST(SessionReport, ShowsStatesWhatWasLearnedAndWhereHiddenThingsMayBe) {
  core::ThreadPool pool(1);
  Backends backends(pool);
  const auto belief = tests::belief_of(tests::kBoxScene);
  SessionReport report(belief->scene, {}, backends);
  TrackingScore score(belief->scene);
  constexpr core::TimeNs kStart = 1'000'000'000'000, kFrame = 100'000'000;
  for (int frame = 0; frame < 20; ++frame) {
    BeliefSummary summary = summary_of(*belief);
    summary.stamp_ns = kStart + frame * kFrame;
    ObjectSummary& box = summary.objects.at(0);
    const bool hidden = frame >= 10 && frame < 17;
    box.state = hidden ? belief::TrackState::kUnseen : belief::TrackState::kTracked;
    box.covariance(3, 3) = 4e-4;
    box.covariance(4, 4) = 1e-4;
    const bool learned = frame >= 5;
    box.parameters = {{"friction", learned ? 0.31 : 0.5, learned ? 0.04 : 0.23, 0.2, 0.6}};
    box.lessons = learned ? 1 : 0;
    box.learned_ns = learned ? kStart + 5 * kFrame : 0;
    report.add(summary);
    score.add(summary);
    geometry::Pose truth = box.X_WO;
    truth.translation.x() += 0.007;
    score.add(TruthRecord{summary.stamp_ns, {{box.name, truth, hidden ? 0.0 : 1.0}}});
  }
  const tests::ScratchDir folder;
  const auto page = folder.path() / "report.html";
  ASSERT_TRUE(report.write(page, score).ok());
  std::ifstream file(page);
  const std::string html((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  for (const char* expected :
       {"box: tracked, then unseen", "box: unseen, then tracked", "box: unseen, 1.00 to 1.70 s", "0.31 ± 0.04",
        "box was not seen from 1.00 to 1.60 s", "within 43 mm along x and 21 mm along y", "7 mm from there",
        "Error of the position, against the simulated truth", "State of each object in each frame"})
    EXPECT_NE(html.find(expected), std::string::npos) << expected;
  EXPECT_NE(html.find("<td class=\"number\">0.5</td>"), std::string::npos) << "learned at 0.5 s of the session";
}

}  // namespace
}  // namespace prescene::service
