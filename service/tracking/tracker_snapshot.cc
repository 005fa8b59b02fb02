// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/tracker_snapshot.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "prescene/belief/json.h"
#include "prescene/core/hash.h"
#include "prescene/service/outside_json.h"
#include "snapshot_scene.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

/// Whether all that the filter finds by its place in one of them is at that place in the other.
bool are_of_each_other(const belief::Belief& belief, const belief::Scene& scene) {
  const auto cameras = static_cast<std::size_t>(belief::camera_count(scene));
  if (belief.objects.size() != scene.objects.size()) return false;
  if (!(belief.robot.empty() && belief.step == 0) && belief.robot.size() != scene.robot.size()) return false;
  if (!belief.cameras.empty() && belief.cameras.size() != cameras) return false;
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    const belief::ObjectBelief& object = belief.objects[i];
    if (object.name != scene.objects[i].name || object.model != scene.objects[i].model) return false;
    if (!object.views.empty() && object.views.size() != cameras) return false;
    if (object.motion.episode && object.motion.episode->others.size() > belief.objects.size()) return false;
  }
  return true;
}

}  // namespace

core::Result<std::string> snapshot_text(const TrackerSnapshot& snapshot,
                                        const std::shared_ptr<const belief::Scene>& scene) {
  ordered_json taken = ordered_json::array();
  for (const TrackerSnapshot::Taken& frame : snapshot.taken)
    taken.push_back({{"camera", frame.camera}, {"depth", frame.depth}, {"at_ns", frame.at_ns}});
  const std::string hash = core::hash_text(belief::content_hash(*snapshot.belief));
  std::string text = belief::json_text({{"belief_hash", hash},
                                        {"scene", scene_json(*snapshot.belief->scene, *scene)},
                                        {"belief", belief::to_json(*snapshot.belief)},
                                        {"controls", snapshot.controls.to_json()},
                                        {"taken", std::move(taken)}});
  const auto again = snapshot_from_text(text, scene);
  if (!again || !(*again->belief->scene == *snapshot.belief->scene))
    return core::unsupported("the belief's scene differs from the given one in what can't be written" +
                             (again ? std::string() : " (" + again.status().message() + ")"));
  return text;
}

core::Result<TrackerSnapshot> snapshot_from_text(const std::string& text,
                                                 const std::shared_ptr<const belief::Scene>& scene) {
  const ordered_json json = parse_or_discard(text);
  const auto bad = [](const std::string& what) { return core::invalid_input("snapshot of a belief: " + what); };
  if (!json.is_object()) return bad("not a JSON object");
  for (const char* key : {"belief_hash", "scene", "belief", "controls", "taken"})
    if (!json.contains(key)) return bad("no '" + std::string(key) + "'");
  const auto of_belief = scene_from(json["scene"], scene);
  if (!of_belief) return bad("its scene is none that came of the given one");
  PRESCENE_TRY(belief::Belief belief, belief::belief_from_json(json["belief"], of_belief));
  if (!json["belief_hash"].is_string() ||
      json["belief_hash"].get<std::string>() != core::hash_text(belief::content_hash(belief)))
    return bad("not the belief that was written");
  if (!are_of_each_other(belief, *of_belief)) return bad("its objects, hands or cameras are not those of its scene");
  TrackerSnapshot snapshot;
  snapshot.belief = std::make_shared<const belief::Belief>(std::move(belief));
  PRESCENE_TRY(snapshot.controls, WaitingControls::from_json(json["controls"]));
  if (!json["taken"].is_array()) return bad("'taken' is not a list");
  for (const ordered_json& row : json["taken"]) {
    for (const char* key : {"camera", "depth", "at_ns"})
      if (!row.is_object() || !row.contains(key) || !row[key].is_number_integer())
        return bad("no '" + std::string(key) + "' of a frame");
    snapshot.taken.push_back(
        {row["camera"].get<int>(), row["depth"].get<MessageIndex>(), row["at_ns"].get<core::TimeNs>()});
  }
  return snapshot;
}

}  // namespace prescene::service
