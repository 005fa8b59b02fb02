// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numbers>

#include "prescene/belief/validation.h"
#include "prescene/geometry/angles.h"
#include "prescene/interfaces/bytes/text.h"
#include "read_scene_parts.h"

namespace prescene::interfaces {
namespace {

using belief::Condition;
using belief::When;
using geometry::Vector3d;

constexpr NumberRange kTurn{0.0, 180.0, "give degrees between 0 and 180", "deg"};
constexpr NumberRange kHingeTurn{-360.0, 360.0, "give degrees between -360 and 360", "deg"};
constexpr NumberRange kDistance{0.0, 1000.0, "give metres between 0 and 1000", "m"};

const std::vector<std::pair<std::string, When>> kWhens{
    {"at_end", When::kAtEnd}, {"ever", When::kEver}, {"always", When::kAlways}};
const std::vector<std::string> kConditionKeys{"inside",          "resting_on",           "upright", "face_up", "below",
                                              "moved_more_than", "turned_more_than_deg", "touched", "moving",  "joint"};
constexpr const char* kConditionRemedy =
    "give a condition: inside, resting_on, upright, face_up, below, moved_more_than, turned_more_than_deg, touched, "
    "moving, joint, not, or all_of or any_of with a list of them";

class ConditionReader {
 public:
  /// `object` is the one that is judged.
  ConditionReader(SceneContext& context, const std::string& object)
      : context_(context), problems_(context.problems), object_(object) {}

  // All conditions among the keys of a map, each of which has to hold.
  std::vector<Condition> read_keys(Binder& binder) {
    std::vector<Condition> conditions;
    When when = When::kAtEnd;
    const bool has_when = binder.read_enum("when", when, kWhens);
    for (const std::string& key : kConditionKeys) {
      const LocatedValue* value = binder.find(key);
      if (!value) continue;
      Condition condition = read(key, *value);
      condition.when = when;
      if (has_when && key == "touched" && when == When::kAlways)
        problems_.add(value->place, value->path, "'touched' is about any time, not 'always'", "remove 'when'");
      conditions.push_back(std::move(condition));
    }
    if (const LocatedValue* negated = binder.find("not")) read_negated(*negated, conditions);
    return conditions;
  }

  /// One condition an item: of any_of each stands by itself.
  std::vector<Condition> read_choices(const LocatedValue& value) {
    std::vector<Condition> conditions;
    if (value.kind != LocatedValue::Kind::kList || value.items.empty()) {
      report_type(value, problems_, "give a list of at least one condition");
      return conditions;
    }
    for (const LocatedValue& item : value.items) {
      const std::size_t before = problems_.errors().size();
      std::vector<Condition> read;
      {
        Binder binder(item, problems_);
        read = read_keys(binder);
        binder.finish();
      }
      if (read.size() != 1 && problems_.errors().size() == before)
        problems_.add(item.place, item.path,
                      "it holds " + std::to_string(read.size()) + " conditions, and of any_of each stands by itself",
                      "give one condition an item: any_of: [{...}, {...}]");
      conditions.insert(conditions.end(), read.begin(), read.end());
    }
    return conditions;
  }

  std::vector<Condition> read_list(const LocatedValue& value) {
    std::vector<Condition> conditions;
    if (value.kind != LocatedValue::Kind::kList || value.items.empty()) {
      report_type(value, problems_, "give a list of at least one condition");
      return conditions;
    }
    for (const LocatedValue& item : value.items) {
      Binder binder(item, problems_);
      const std::vector<Condition> read = read_keys(binder);
      if (read.empty() && item.kind == LocatedValue::Kind::kMap && item.keys.empty())
        problems_.add(item.place, item.path, "the condition is empty", kConditionRemedy);
      conditions.insert(conditions.end(), read.begin(), read.end());
    }
    return conditions;
  }

 private:
  // None of these may hold.
  void read_negated(const LocatedValue& value, std::vector<Condition>& conditions) {
    std::vector<Condition> read;
    if (value.kind == LocatedValue::Kind::kList) {
      read = read_list(value);
    } else {
      Binder binder(value, problems_);
      read = read_keys(binder);
      if (read.size() > 1)
        problems_.add(value.place, value.path, "'not' holds " + std::to_string(read.size()) + " conditions",
                      "give one, or a list of which none may hold: not: [{...}, {...}]");
    }
    for (Condition& condition : read) {
      condition.negated = !condition.negated;
      conditions.push_back(std::move(condition));
    }
  }

  Condition read(const std::string& key, const LocatedValue& value) {
    if (key == "inside") return {read_inside(value)};
    if (key == "resting_on") return {belief::RestingOn{read_thing(value)}};
    if (key == "upright") return {read_upright(value)};
    if (key == "face_up") return {read_face(value)};
    if (key == "below") return {belief::BelowHeight{read_number(value, problems_, kPosition).value_or(0.0)}};
    if (key == "moved_more_than")
      return {belief::MovedMoreThan{read_number(value, problems_, kDistance).value_or(0.0)}};
    if (key == "turned_more_than_deg")
      return {belief::TurnedMoreThan{geometry::kDegree * read_number(value, problems_, kTurn).value_or(0.0)}};
    if (key == "touched") return {belief::Touched{read_thing(value)}};
    if (key == "joint") return {read_joint_within(value)};
    Condition moving{belief::StillMoving{}};
    moving.negated = !read_bool(value, problems_).value_or(true);
    return moving;
  }

  std::string read_thing(const LocatedValue& value) {
    std::string name = context_.read_name(value, context_.all_things(), "an object, a support or a robot body");
    if (!name.empty() && name == object_)
      problems_.add(value.place, value.path, "this is the object that is judged, which never touches itself",
                    "name another object, a support or a robot body");
    return name;
  }

  // A support's hollow by its name, or a box of its own.
  belief::InsideVolume read_inside(const LocatedValue& value) {
    belief::InsideVolume volume{geometry::Pose{}, Vector3d::Ones()};
    if (value.kind == LocatedValue::Kind::kMap) {
      Binder binder(value, problems_);
      binder.read("whole", volume.whole);
      if (const LocatedValue* hollow = binder.find("hollow_of")) {
        set_hollow(*hollow, volume);
        return volume;
      }
      volume.X_WV = read_pose_keys(binder);
      if (const LocatedValue* size =
              binder.require("size", "give the edges [x, y, z] of the box, or 'hollow_of' a support"))
        volume.size = read_vector(*size, problems_, kSupportSize);
      return volume;
    }
    set_hollow(value, volume);
    return volume;
  }

  void set_hollow(const LocatedValue& value, belief::InsideVolume& volume) {
    const std::string name = context_.read_name(value, context_.supports, "a support with a hollow");
    const std::optional<int> index = belief::find_support(context_.scene, name);
    if (!index) return;
    const belief::Support& support = context_.scene.supports[static_cast<std::size_t>(*index)];
    if (!support.hollow) {
      problems_.add(value.place, value.path, interfaces::quote(name) + " has no hollow",
                    "make it an open_bin, give it 'hollow: {size: ...}', or give a box {position, size}");
      return;
    }
    volume.X_WV = support.X_WS * support.hollow->X_OV;
    volume.size = support.hollow->size;
  }

  belief::UprightWithin read_upright(const LocatedValue& value) {
    belief::UprightWithin upright;
    Binder binder(value, problems_);
    if (const LocatedValue* at = binder.require("within_deg", "give the largest angle to the vertical in degrees"))
      upright.max_angle = geometry::kDegree * read_number(*at, problems_, kTurn).value_or(15.0);
    if (const LocatedValue* at = binder.find("axis")) upright.axis_O = read_axis(*at, problems_);
    return upright;
  }

  belief::FaceUp read_face(const LocatedValue& value) {
    static const std::vector<std::string> kFaces{"x", "-x", "y", "-y", "z", "-z"};
    const std::size_t face = read_word(value, problems_, kFaces).value_or(4);
    return {(face % 2 == 0 ? 1.0 : -1.0) * Vector3d::Unit(static_cast<int>(face) / 2)};
  }

  belief::JointWithin read_joint_within(const LocatedValue& value) {
    belief::JointWithin within;
    Binder binder(value, problems_);
    std::vector<std::string> names;
    for (const belief::Joint& joint : context_.scene.joints) names.push_back(joint.name);
    if (const LocatedValue* at = binder.require("name", "name one of the joints"))
      within.joint = context_.read_name(*at, names, "a joint");
    const std::optional<int> index = belief::find_joint(context_.scene, within.joint);
    const bool hinge = index ? context_.scene.joints[static_cast<std::size_t>(*index)].type == belief::JointType::kHinge
                             : value.find("min_deg") || value.find("max_deg");
    within.type = hinge ? belief::JointType::kHinge : belief::JointType::kSlider;
    const bool low = binder.read(hinge ? "min_deg" : "min", within.low, hinge ? kHingeTurn : kPosition);
    const bool high = binder.read(hinge ? "max_deg" : "max", within.high, hinge ? kHingeTurn : kPosition);
    if (!low && !high)
      binder.require(hinge ? "min_deg" : "min",
                     hinge ? "give 'min_deg', 'max_deg' or both, in degrees" : "give 'min', 'max' or both, in metres");
    if (hinge) {
      within.low *= geometry::kDegree;
      within.high *= geometry::kDegree;
    }
    return within;
  }

  SceneContext& context_;
  Problems& problems_;
  const std::string& object_;
};

// The object that is judged where it is clear: named, the group's, or the only one.
std::string find_judged(Binder& binder, const std::string& group_object, SceneContext& context) {
  if (const LocatedValue* at = binder.find("object")) return context.read_name(*at, context.objects, "an object");
  if (group_object.empty() && context.objects.size() == 1) return context.objects[0];
  return group_object;
}

/// The child of the joint that an outcome asks about.
std::string child_of_joint(Binder& binder, SceneContext& context) {
  const LocatedValue* within = binder.find("joint");
  const LocatedValue* name = within ? within->find("name") : nullptr;
  const std::optional<int> joint = name ? belief::find_joint(context.scene, name->text) : std::nullopt;
  return joint ? context.scene.joints[static_cast<std::size_t>(*joint)].child : std::string();
}

std::string require_judged(Binder& binder, const std::string& group_object, SceneContext& context) {
  std::string object = find_judged(binder, group_object, context);
  if (object.empty()) object = child_of_joint(binder, context);
  if (object.empty()) binder.require("object", "name the object that is judged");
  return object;
}

// Outcomes that never count, as one above them holds whenever they do.
void check_order(const LocatedValue& outcomes, const belief::ExclusiveOutcomes& group, Problems& problems) {
  for (std::size_t later = 1; later < group.outcomes.size(); ++later) {
    for (std::size_t earlier = 0; earlier < later; ++earlier) {
      if (!belief::is_implied(group.outcomes[earlier], group.outcomes[later])) continue;
      problems.add(outcomes.keys[later].place, outcomes.items[later].path,
                   interfaces::quote(group.outcomes[later].name) + " never counts, as " +
                       interfaces::quote(group.outcomes[earlier].name) + " above it holds whenever it does",
                   "put the narrower outcome first");
      break;
    }
  }
}

}  // namespace

belief::Outcome read_outcome(const LocatedValue& value, const std::string& name, const std::string& default_object,
                             SceneContext& context) {
  Binder binder(value, context.problems);
  const std::size_t before = context.problems.errors().size();
  belief::Outcome outcome{name, require_judged(binder, default_object, context), {}};
  ConditionReader reader(context, outcome.object);
  outcome.all_of = reader.read_keys(binder);
  if (const LocatedValue* list = binder.find("all_of")) {
    const std::vector<Condition> more = reader.read_list(*list);
    outcome.all_of.insert(outcome.all_of.end(), more.begin(), more.end());
  }
  if (const LocatedValue* list = binder.find("any_of")) outcome.any_of = reader.read_choices(*list);
  if (outcome.all_of.empty() && outcome.any_of.empty()) {
    binder.finish();  // a mistyped key explains it
    if (value.kind == LocatedValue::Kind::kMap && context.problems.errors().size() == before)
      context.problems.add(value.place, value.path, "the outcome has no condition", kConditionRemedy);
  }
  if (context.problems.errors().size() == before && !outcome.object.empty())
    if (const core::Status status = belief::validate(context.scene, outcome); !status.ok())
      add_invalid(value.place, value.path, status, context.problems);
  return outcome;
}

belief::ExclusiveOutcomes read_exclusive(const LocatedValue& value, const std::string& name, SceneContext& context) {
  Problems& problems = context.problems;
  const std::size_t before = problems.errors().size();
  belief::ExclusiveOutcomes group{name, {}};
  Binder binder(value, problems);
  const std::string object = find_judged(binder, "", context);  // else each outcome names its own
  std::string which;
  const LocatedValue* at =
      binder.one_of({"outcomes", "face_up"},
                    "give 'outcomes', of which the first that holds counts, or 'face_up: true'", false, &which);
  if (!at) return group;
  if (which == "face_up") {
    if (!read_bool(*at, problems).value_or(true))
      problems.add(at->place, at->path, "'face_up: false' says nothing", "write face_up: true, or give 'outcomes'");
    return belief::which_face_up(name, require_judged(binder, object, context));
  }
  if (at->kind != LocatedValue::Kind::kMap || at->keys.empty()) {
    report_type(*at, problems, "give a map of named outcomes");
    return group;
  }
  for (std::size_t i = 0; i < at->keys.size(); ++i) {
    if (at->keys[i].name == "other")
      problems.add(at->keys[i].place, at->items[i].path, "'other' is made by itself", "give it another name");
    group.outcomes.push_back(read_outcome(at->items[i], at->keys[i].name, object, context));
  }
  if (problems.errors().size() == before) check_order(*at, group, problems);
  return group;
}

}  // namespace prescene::interfaces
