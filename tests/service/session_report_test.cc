// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/session_report.h"

#include <gtest/gtest.h>

#include "query_worker_fixture.h"
#include "tests/support/paths.h"

namespace prescene::service {
namespace {

// Answers come over the bus: whoever is in the domain can send one under the id of ours.
TEST(SessionReport, AnswersOfAnotherFormAreSaidToBe) {
  core::ThreadPool pool(1);
  Backends backends(pool);
  const auto belief = tests::belief_of(tests::kBoxScene);
  SessionReport report(belief->scene, {});
  for (const char* answer : {"", "{", "[]", R"({"error": 3})", R"({"predict": {"outcomes": [{"interval": [0.5]}]}})",
                             R"({"predict": {"outcomes": 3}})", R"({"predict": {"final_poses": [{}]}})",
                             R"({"predict": {"final_poses": [{"heat_map": {"nx": 1000, "ny": 1000, "mass": [1.0]}}]}})",
                             R"({"predict": {"final_poses": [{"heat_map": {"nx": -1, "ny": -1, "mass": [1.0]}}]}})",
                             R"({"predict": {"typical_runs": [{"timeline": [3]}]}})", R"({"stability": {}})",
                             R"({"stability": {"stable": {"interval": []}}})"})
    report.add_answer(1.0, answer);
  const tests::ScratchDir folder;
  const core::Status written = report.write(folder.path() / "report.html", {}, backends);
  EXPECT_TRUE(written.ok()) << written.message();
}

}  // namespace
}  // namespace prescene::service
