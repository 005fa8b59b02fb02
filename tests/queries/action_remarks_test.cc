// SPDX-License-Identifier: Apache-2.0
// What is asked for and can't be done, or does not do what it seems to, is said in the answer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "prescene/queries/query_engine.h"
#include "sliding_scene.h"

namespace prescene::queries {
namespace {

using testing::Contains;
using testing::Each;
using testing::HasSubstr;
using testing::Not;

std::vector<std::string> remarks_with(std::vector<belief::Action> actions, bool held) {
  core::ThreadPool pool(1);
  const auto scene = tests::sliding_scene();
  if (held) scene->objects[0].held_by = "hand";
  belief::PredictQuery query;
  query.actions = std::move(actions);
  query.effort.exact_instances = 64;
  const belief::Answer answer = queries::answer(scene, 1, {"", query}, tests::context_with(tests::slide, pool));
  EXPECT_TRUE(answer.error.ok()) << answer.error.message();
  return answer.error.ok() ? std::get<belief::PredictAnswer>(answer.what).remarks : std::vector<std::string>{};
}

belief::Action release(double time) { return {time, belief::Release{.object = "carton"}}; }

TEST(ActionRemarks, AReleaseOfWhatNothingHoldsChangesNothing) {
  EXPECT_THAT(remarks_with({release(0.0)}, false),
              Contains("Nothing holds 'carton' when the action 'release carton' at 0 s comes: it changes nothing."));
  EXPECT_THAT(remarks_with({release(0.0)}, true), Each(Not(HasSubstr("Nothing holds"))));
  // The second time it is gone.
  EXPECT_THAT(remarks_with({release(0.5), release(1.0)}, true), Contains(HasSubstr("at 1 s comes")));
}

TEST(ActionRemarks, WhatIsGraspedIsHeldFromThenOn) {
  const belief::Action grasp{0.5, belief::Grasp{"carton", "hand"}};
  EXPECT_THAT(remarks_with({grasp, release(1.0)}, false), Each(Not(HasSubstr("Nothing holds"))));
  const belief::Action pour{0.2, belief::Pour{.container = "carton"}};
  EXPECT_THAT(remarks_with({pour, grasp}, false), Contains(HasSubstr("'pour carton' at 0.2 s begins")));
}

TEST(ActionRemarks, ABlowIsTakenByWhatHoldsTheObject) {
  const belief::Action bump{0.8, belief::Bump{.object = "carton"}};
  EXPECT_THAT(remarks_with({bump}, false), Each(Not(HasSubstr("bump"))));
  EXPECT_THAT(remarks_with({bump}, true), Contains(HasSubstr("it takes the blow, which changes nothing")));
  const belief::Action grip{0.5, belief::Grasp{"carton", "hand", belief::Grip{}}};
  EXPECT_THAT(remarks_with({grip, bump}, true), Each(Not(HasSubstr("bump"))));
}

TEST(ActionRemarks, WhatComesAfterTheEndIsNotDone) {
  const belief::Action push{2.5, belief::Push{}};
  EXPECT_THAT(remarks_with({release(1.0), push}, true),
              Contains(HasSubstr("The action 'push' at 2.5 s is not done: the 2 s that are simulated end before")));
  EXPECT_THAT(remarks_with({release(1.0)}, true), Each(Not(HasSubstr("is not done"))));
}

}  // namespace
}  // namespace prescene::queries
