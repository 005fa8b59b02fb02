// SPDX-License-Identifier: Apache-2.0
#include "tests/support/achieve_scenes.h"

#include <utility>

#include "prescene/belief/json.h"
#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::tests {
namespace {

struct Text {
  const char* name;
  const char* model;     ///< Shape of what is held (or pushed).
  const char* supports;  ///< Besides the floor.
  const char* objects;   ///< Besides what is held.
  const char* rotation;  ///< Of what is held.
  const char* outcome;   ///< Conditions.
  const char* question;  ///< The rest of it, as JSON.
};

constexpr Text kTexts[] = {
    {"box on post", "box: [0.08, 0.06, 0.12]",
     "  post:\n    box: [0.1, 0.1, 0.3]\n    pose: {position: [0.1, 0.0, 0.15]}\n    friction: 1.0\n", "", "[0, 0, 0]",
     "resting_on: post, upright: {within_deg: 10}",
     R"("support": "post", "free": {"x": [-0.02, 0.22], "y": [-0.12, 0.12], "yaw": [-180, 180], "height": [0, 0.1]})"},
    {"carton in bin", "box: [0.07, 0.07, 0.2]",
     "  bin:\n    open_bin: {inner: [0.14, 0.14, 0.15], wall: 0.005}\n    pose: {position: [0.1, 0.1, 0]}\n", "",
     "[0, 0, 0]", "inside: bin, upright: {within_deg: 20}",
     R"("support": "bin", "free": {"x": [-0.03, 0.23], "y": [-0.03, 0.23], "yaw": [-45, 45], "height": [0, 0.25]})"},
    {"can on shelf", "cylinder: {radius: 0.03, length: 0.11}",
     "  shelf:\n    box: [0.4, 0.09, 0.02]\n    pose: {position: [0.0, 0.0, 0.4]}\n    friction: 1.0\n", "",
     "[0, 0, 0]", "resting_on: shelf, upright: {within_deg: 10}",
     R"("support": "shelf", "free": {"x": [-0.3, 0.3], "y": [-0.25, 0.25], "pitch": [-60, 60], "height": [0, 0.15]})"},
    {"box between cans", "box: [0.05, 0.12, 0.1]", "",
     "  can_a:\n    model: can\n    pose: {position: [-0.09, 0, 0.06], normal: {position: [0.004, 0.004, 0]}}\n"
     "  can_b:\n    model: can\n    pose: {position: [0.09, 0, 0.06], normal: {position: [0.004, 0.004, 0]}}\n",
     "[0, 0, 0]",
     "upright: {within_deg: 10}, inside: {position: [0, 0, 0.05], size: [0.08, 0.12, 0.12]}, not: [{touched: can_a}, "
     "{touched: can_b}]",
     R"("support": "floor", "free": {"x": [-0.13, 0.13], "y": [-0.13, 0.13], "yaw": [-90, 90], "height": [0, 0.1]})"},
    {"box on box", "box: [0.06, 0.06, 0.1]", "",
     "  lower:\n    model: block\n    pose: {position: [0.1, -0.05, 0.05], normal: {position: [0.005, 0.005, 0], "
     "rotation_deg: [0, 0, 5]}}\n",
     "[0, 0, 0]", "resting_on: lower, upright: {within_deg: 10}",
     R"("support": "lower", "free": {"x": [-0.03, 0.23], "y": [-0.18, 0.08], "yaw": [-180, 180], "height": [0, 0.08]})"},
    {"bottle upright", "cylinder: {radius: 0.025, length: 0.16}", "", "", "[0, 60, 0]",
     "upright: {within_deg: 5}, resting_on: floor",
     R"("support": "floor", "free": {"x": [-0.2, 0.2], "roll": [-45, 45], "pitch": [-150, 30], "height": [0, 0.1]})"},
    {"plank over gap", "box: [0.3, 0.05, 0.02]",
     "  post_a:\n    box: [0.06, 0.12, 0.2]\n    pose: {position: [-0.1, 0, 0.1]}\n    friction: 1.0\n"
     "  post_b:\n    box: [0.06, 0.12, 0.2]\n    pose: {position: [0.1, 0, 0.1]}\n    friction: 1.0\n",
     "", "[0, 0, 0]", "all_of: [{resting_on: post_a}, {resting_on: post_b}]",
     R"("support": "post_a", "free": {"x": [-0.2, 0.2], "y": [-0.15, 0.15], "yaw": [-90, 90], "height": [0, 0.1]})"},
    {"ball in dish", "sphere: 0.03",
     "  dish:\n    open_bin: {inner: [0.1, 0.1, 0.04], wall: 0.005}\n    pose: {position: [0.1, 0, 0]}\n", "",
     "[0, 0, 0]", "inside: dish",
     R"("support": "dish", "free": {"x": [-0.1, 0.3], "y": [-0.2, 0.2], "yaw": [-180, 180], "height": [0, 0.2]})"},
    {"book in slot", "box: [0.03, 0.1, 0.14]",
     "  slot:\n    open_bin: {inner: [0.07, 0.16, 0.08], wall: 0.005}\n    pose: {position: [0.05, 0, 0]}\n", "",
     "[0, 0, 0]", "inside: slot, upright: {within_deg: 30}",
     R"("support": "slot", "free": {"x": [-0.02, 0.12], "y": [-0.08, 0.08], "yaw": [-45, 45], "height": [0, 0.12]})"},
    {"box pushed to mark", "box: [0.08, 0.08, 0.06]", "", "", "",
     "inside: {position: [0.2, 0.05, 0.03], size: [0.1, 0.1, 0.1]}, not: {moving: true}",
     R"("action": "push", "object": "thing", "free": {"direction": [-60, 60], "offset": [-0.04, 0.04],
        "distance": [0.02, 0.4], "speed": [0.05, 0.5]})"},
};

std::string scene_text(const Text& text) {
  const std::string rotation = text.rotation;
  const bool held = !rotation.empty();
  std::string scene = std::string("name: ") + text.name + "\nduration: 4.0\nmodels:\n  thing:\n    " + text.model +
                      "\n    mass: 0.4\n    friction: {normal: [0.5, 0.08], min: 0.1}\n    restitution: 0.1\n"
                      "  can:\n    cylinder: {radius: 0.03, length: 0.12}\n    mass: 0.3\n    friction: 0.5\n"
                      "  block:\n    box: [0.1, 0.1, 0.1]\n    mass: 1.0\n    friction: 0.8\n"
                      "supports:\n  floor:\n    ground: {size: 3}\n    friction: 1.0\n    restitution: 1.0\n" +
                      text.supports;
  if (held)
    scene +=
        "robot:\n  gripper:\n    parts:\n      - {box: [0.03, 0.03, 0.04], position: [0, 0, 0.13]}\n"
        "    pose: {position: [0.6, 0, 0.7]}\n";
  scene += "objects:\n  thing:\n    model: thing\n";
  scene += held
               ? "    held_by: gripper\n    pose: {position: [0.6, 0, 0.7], rotation: {euler_deg: " + rotation +
                     "}, normal: {position: 0.003, rotation_deg: 2}}\n"
               : "    pose: {position: [0, 0, 0.03], normal: {position: [0.004, 0.004, 0], rotation_deg: [0, 0, 3]}}\n";
  return scene + text.objects + "outcomes:\n  wanted: {object: thing, " + text.outcome + "}\n";
}

}  // namespace

core::Result<std::vector<AchieveProblem>> achieve_problems() {
  std::vector<AchieveProblem> problems;
  for (const Text& text : kTexts) {
    auto scene = interfaces::parse_scene(scene_text(text), text.name);
    if (!scene) return scene.status();
    const bool held = *text.rotation != '\0';
    const std::string errors = held ? R"("errors": {"position": 0.003, "rotation_deg": 1})"
                                    : R"("errors": {"lateral_error": {"normal": [0, 0.003]}})";
    PRESCENE_TRY(const belief::Query query, belief::query_from_json(R"({"achieve": {"outcome": "wanted", )" + errors +
                                                                    ", " + text.question + "}}"));
    problems.push_back({text.name, std::make_shared<const belief::Scene>(*std::move(scene)),
                        std::get<belief::AchieveQuery>(query.what)});
  }
  return problems;
}

}  // namespace prescene::tests
