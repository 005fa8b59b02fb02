// SPDX-License-Identifier: Apache-2.0
#include "urdf.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "prescene/belief/validation.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using tinyxml2::XMLElement;

constexpr std::size_t kMostLinks = 1000;
constexpr std::size_t kMostShapes = 4000;
constexpr double kFarthest = 1000.0;  // m
constexpr double kLargest = 20.0;     // m, as of bodies in scene files
constexpr double kSmallest = 1e-5;
constexpr double kLargestMimic = 1e3;

/// Numbers of an attribute, divided by spaces.
std::optional<std::vector<double>> numbers_of(std::string_view text) {
  std::vector<double> numbers;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    std::string_view word = text.substr(0, text.find_first_of(" \t\r\n"));
    text.remove_prefix(word.size());
    if (word.size() > 1 && word.front() == '+') word.remove_prefix(1);
    double number = 0.0;
    if (!parse_number(word, &number) || !std::isfinite(number) || numbers.size() >= 4) return std::nullopt;
    numbers.push_back(number);
  }
  return numbers;
}

/// Roll, pitch and yaw about fixed axes.
geometry::Quaterniond of_rpy(const Vector3d& rpy) {
  using Eigen::AngleAxisd;
  return (AngleAxisd(rpy.z(), Vector3d::UnitZ()) * AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .normalized();
}

class UrdfReader {
 public:
  UrdfReader(const std::string& file, Problems& problems)
      : file_(std::make_shared<const std::string>(file)), problems_(problems) {}

  std::optional<UrdfRobot> read(std::string_view text) {
    const std::size_t before = problems_.errors().size();
    tinyxml2::XMLDocument document;
    document.Parse(text.data(), text.size());
    if (document.Error()) {
      problems_.add({file_, document.ErrorLineNum(), 0}, "", std::string("not XML (") + document.ErrorName() + ")",
                    "give a URDF file");
      return std::nullopt;
    }
    const XMLElement* root = document.RootElement();
    if (root == nullptr || std::string_view(root->Name()) != "robot") {
      add(root, "", "the outermost element is not <robot>", "give a URDF file (of SDF, convert it)");
      return std::nullopt;
    }
    if (is_xacro(*root)) {
      add(root, "", "this is a xacro file", "expand it: xacro FILE > robot.urdf");
      return std::nullopt;
    }
    read_materials(*root);
    for (const XMLElement* link = root->FirstChildElement("link"); link; link = link->NextSiblingElement("link"))
      read_link(*link);
    for (const XMLElement* joint = root->FirstChildElement("joint"); joint; joint = joint->NextSiblingElement("joint"))
      read_joint(*joint);
    if (robot_.links.empty()) add(root, "", "the robot has no link", "give at least one <link>");
    if (std::max(robot_.links.size(), robot_.kinematics.joints.size()) > kMostLinks || shapes_ > kMostShapes)
      add(root, "",
          "the robot has " + std::to_string(robot_.links.size()) + " links and " + std::to_string(shapes_) + " shapes",
          "give at most " + std::to_string(kMostLinks) + " and " + std::to_string(kMostShapes));
    if (problems_.errors().size() == before) resolve_mimics();
    if (problems_.errors().size() == before) order_as_tree(*root);
    if (problems_.errors().size() > before) return std::nullopt;
    robot_.kinematics.file = *file_;
    return std::move(robot_);
  }

 private:
  FilePlace place(const XMLElement* at) const { return {file_, at == nullptr ? 0 : at->GetLineNum(), 0}; }
  void add(const XMLElement* at, const std::string& key, std::string reason, std::string remedy) {
    problems_.add(place(at), key, std::move(reason), std::move(remedy));
  }

  static bool is_xacro(const XMLElement& root) {
    for (const XMLElement* child = root.FirstChildElement(); child; child = child->NextSiblingElement())
      if (std::string_view(child->Name()).starts_with("xacro:")) return true;
    return false;
  }

  /// The text of an attribute that has to be there.
  std::string text_of(const XMLElement* element, const char* attribute, const std::string& key,
                      const XMLElement& around) {
    const char* text = element == nullptr ? nullptr : element->Attribute(attribute);
    if (text != nullptr && *text != '\0') return text;
    add(element == nullptr ? &around : element, key, std::string("'") + attribute + "' is missing", "give one");
    return "";
  }

  /// `count` numbers of an attribute within +-most; `otherwise` without the attribute.
  Vector3d numbers(const XMLElement* element, const char* attribute, const std::string& key, const Vector3d& otherwise,
                   double most, std::size_t count = 3) {
    const char* text = element == nullptr ? nullptr : element->Attribute(attribute);
    if (text == nullptr) return otherwise;
    const auto found = numbers_of(text);
    const bool fits = found && found->size() == count &&
                      std::all_of(found->begin(), found->end(), [&](double n) { return std::abs(n) <= most; });
    if (!fits) {
      add(element, key,
          std::string(attribute) + "=" + quote(text) + " is not " + std::to_string(count) +
              (count == 1 ? " number" : " numbers") + " within +-" + number_text(most),
          "give " + std::string(count == 1 ? "it" : "them") + " in metres or radians");
      return otherwise;
    }
    Vector3d result = otherwise;
    for (std::size_t i = 0; i < count; ++i) result[static_cast<int>(i)] = (*found)[i];
    return result;
  }

  double number(const XMLElement* element, const char* attribute, const std::string& key, double otherwise,
                double most) {
    return numbers(element, attribute, key, Vector3d(otherwise, 0.0, 0.0), most, 1).x();
  }

  double size(const XMLElement& element, const char* attribute, const std::string& key) {
    const double value = number(&element, attribute, key, 0.0, kLargest);
    if (!(value >= kSmallest))
      add(&element, key, std::string("'") + attribute + "' is missing or not more than 0", "give metres");
    return std::max(value, kSmallest);
  }

  Pose origin_of(const XMLElement& element, const std::string& key) {
    const XMLElement* origin = element.FirstChildElement("origin");
    return {of_rpy(numbers(origin, "rpy", key + ".origin", Vector3d::Zero(), 1000.0)),
            numbers(origin, "xyz", key + ".origin", Vector3d::Zero(), kFarthest)};
  }

  std::optional<belief::Color> color_of(const XMLElement& material, const std::string& key) {
    const XMLElement* color = material.FirstChildElement("color");
    const char* text = color == nullptr ? nullptr : color->Attribute("rgba");
    if (text == nullptr) return std::nullopt;
    const auto rgba = numbers_of(text);
    if (rgba && rgba->size() == 4 && std::all_of(rgba->begin(), rgba->end(), [](double n) { return n >= 0 && n <= 1; }))
      return belief::Color{(*rgba)[0], (*rgba)[1], (*rgba)[2]};
    add(color, key, "rgba=" + quote(text) + " is not 4 numbers from 0 to 1", "give red, green, blue and alpha");
    return std::nullopt;
  }

  void read_materials(const XMLElement& root) {
    for (const XMLElement* m = root.FirstChildElement("material"); m; m = m->NextSiblingElement("material")) {
      const char* name = m->Attribute("name");
      if (const auto color = color_of(*m, "material"); color && name != nullptr) materials_[name] = *color;
    }
  }

  std::optional<belief::Color> color_of_visual(const XMLElement& visual, const std::string& key) {
    const XMLElement* material = visual.FirstChildElement("material");
    if (material == nullptr) return std::nullopt;
    if (const auto color = color_of(*material, key)) return color;
    const char* name = material->Attribute("name");
    const auto known = name == nullptr ? materials_.end() : materials_.find(name);
    return known == materials_.end() ? std::nullopt : std::optional(known->second);
  }

  void read_shape(const XMLElement& element, const std::string& key, std::vector<UrdfShape>& shapes) {
    ++shapes_;
    UrdfShape shape;
    shape.place = place(&element);
    shape.X_LS = origin_of(element, key);
    const XMLElement* geometry = element.FirstChildElement("geometry");
    const XMLElement* form = geometry == nullptr ? nullptr : geometry->FirstChildElement();
    const std::string_view kind = form == nullptr ? "" : form->Name();
    if (kind == "box") {
      const Vector3d edges = numbers(form, "size", key, Vector3d::Zero(), kLargest);
      if (!(edges.minCoeff() >= kSmallest))
        add(form, key, "the box's size is missing or not more than 0", "give three edges in metres");
      shape.primitive = geometry::BoxShape{edges.cwiseMax(kSmallest)};
    } else if (kind == "sphere") {
      shape.primitive = geometry::Sphere{size(*form, "radius", key)};
    } else if (kind == "cylinder") {
      shape.primitive = geometry::Cylinder{size(*form, "radius", key), size(*form, "length", key)};
    } else if (kind == "mesh") {
      shape.mesh = text_of(form, "filename", key, element);
      shape.scale = numbers(form, "scale", key, Vector3d::Ones(), 1e6);
      if (shape.scale.cwiseAbs().minCoeff() < 1e-9) {
        add(form, key, "the mesh's scale is 0", "give metres per unit of the file: \"0.001 0.001 0.001\"");
        shape.scale = Vector3d::Ones();
      }
    } else {
      add(form == nullptr ? &element : form, key, "the shape is none",
          "give <geometry> with <box>, <sphere>, "
          "<cylinder> or <mesh>");
      return;
    }
    shapes.push_back(std::move(shape));
  }

  void read_link(const XMLElement& element) {
    UrdfLink link;
    link.place = place(&element);
    link.name = text_of(&element, "name", "link", element);
    const std::string key = "link " + quote(link.name);
    if (!link_names_.insert(link.name).second) add(&element, key, "another link has this name", "rename one");
    for (const XMLElement* v = element.FirstChildElement("visual"); v; v = v->NextSiblingElement("visual")) {
      read_shape(*v, key + ".visual", link.visuals);
      if (!link.color) link.color = color_of_visual(*v, key + ".visual");
    }
    for (const XMLElement* c = element.FirstChildElement("collision"); c; c = c->NextSiblingElement("collision"))
      read_shape(*c, key + ".collision", link.collisions);
    robot_.links.push_back(std::move(link));
  }

  RobotJoint::Kind kind_of(const XMLElement& element, const std::string& key) {
    using Kind = RobotJoint::Kind;
    static const std::map<std::string, Kind> kKinds{{"fixed", Kind::kFixed},           {"revolute", Kind::kRevolute},
                                                    {"continuous", Kind::kContinuous}, {"prismatic", Kind::kPrismatic},
                                                    {"floating", Kind::kOther},        {"planar", Kind::kOther}};
    const std::string type = text_of(&element, "type", key, element);
    const auto known = kKinds.find(type);
    if (known != kKinds.end()) return known->second;
    if (!type.empty())
      add(&element, key, "a joint can't be of the type " + quote(type),
          "give fixed, revolute, continuous, prismatic, floating or planar");
    return Kind::kFixed;
  }

  void read_limits(const XMLElement& element, const std::string& key, RobotJoint& joint) {
    const XMLElement* limit = element.FirstChildElement("limit");
    if (limit == nullptr || !joint.is_moving() || joint.kind == RobotJoint::Kind::kContinuous) return;
    joint.lower = number(limit, "lower", key + ".limit", 0.0, 1e6);
    joint.upper = number(limit, "upper", key + ".limit", 0.0, 1e6);
    if (*joint.lower > *joint.upper) add(limit, key + ".limit", "'lower' is above 'upper'", "swap the two");
  }

  void read_joint(const XMLElement& element) {
    RobotJoint joint;
    joint.name = text_of(&element, "name", "joint", element);
    const std::string key = "joint " + quote(joint.name);
    if (!joint_places_.emplace(joint.name, place(&element)).second)
      add(&element, key, "another joint has this name", "rename one");
    joint.kind = kind_of(element, key);
    joint.X_PJ = origin_of(element, key);
    joint.parent = text_of(element.FirstChildElement("parent"), "link", key + ".parent", element);
    joint.child = text_of(element.FirstChildElement("child"), "link", key + ".child", element);
    for (const std::string& link : {joint.parent, joint.child})
      if (!link.empty() && !link_names_.contains(link))
        add(&element, key, "there is no link " + quote(link),
            suggestion(link, {link_names_.begin(), link_names_.end()}));
    const Vector3d axis = numbers(element.FirstChildElement("axis"), "xyz", key + ".axis", joint.axis_J, 1e6);
    if (axis.norm() > 1e-9)
      joint.axis_J = axis.normalized();
    else if (joint.is_moving())
      add(&element, key + ".axis", "the axis has no direction", "give one such as \"0 0 1\"");
    read_limits(element, key, joint);
    if (const XMLElement* mimic = element.FirstChildElement("mimic")) {
      joint.mimic = RobotJoint::Mimic{text_of(mimic, "joint", key + ".mimic", element),
                                      number(mimic, "multiplier", key + ".mimic", 1.0, kLargestMimic),
                                      number(mimic, "offset", key + ".mimic", 0.0, kLargestMimic)};
      if (!joint.is_moving()) add(mimic, key + ".mimic", "a joint that does not move can't mimic one", "remove it");
    }
    robot_.kinematics.joints.push_back(std::move(joint));
  }

  /// Chains of joints that mimic each other become mimics of the first.
  void resolve_mimics() {
    std::vector<RobotJoint>& joints = robot_.kinematics.joints;
    std::map<std::string, const RobotJoint*> named;
    for (const RobotJoint& joint : joints) named.emplace(joint.name, &joint);
    for (RobotJoint& joint : joints) {
      for (std::size_t steps = 0; joint.mimic; ++steps) {
        const std::string key = "joint " + quote(joint.name) + ".mimic";
        const auto found = named.find(joint.mimic->joint);
        const RobotJoint* source = found == named.end() ? nullptr : found->second;
        if (source == nullptr || !source->is_moving()) {
          problems_.add(joint_places_[joint.name], key,
                        "there is no joint " + quote(joint.mimic->joint) + " that moves", "name one that does");
          break;
        }
        if (steps > joints.size()) {
          problems_.add(joint_places_[joint.name], key, "the joint mimics itself, by way of others",
                        "break the circle");
          break;
        }
        if (!source->mimic) break;
        const RobotJoint::Mimic& further = *source->mimic;
        joint.mimic = RobotJoint::Mimic{further.joint, joint.mimic->multiplier * further.multiplier,
                                        joint.mimic->multiplier * further.offset + joint.mimic->offset};
        if (!(std::abs(joint.mimic->multiplier) + std::abs(joint.mimic->offset) <= 2.0 * kLargestMimic)) {
          problems_.add(joint_places_[joint.name], key, "what it mimics moves it too far", "correct the multipliers");
          break;
        }
      }
    }
  }

  /// Sorts the joints so that parents come before children. Reports what is no tree.
  void order_as_tree(const XMLElement& root) {
    std::map<std::string, const RobotJoint*> above;
    std::multimap<std::string, const RobotJoint*> below;
    for (const RobotJoint& joint : robot_.kinematics.joints) {
      below.emplace(joint.parent, &joint);
      const auto [other, is_new] = above.emplace(joint.child, &joint);
      if (is_new) continue;
      problems_.add(joint_places_[joint.name], "joint " + quote(joint.name),
                    "the link " + quote(joint.child) + " is the child of " + quote(other->second->name) + " already",
                    "a link has one parent: remove one of the two joints");
      return;
    }
    std::vector<std::string> roots;
    for (const UrdfLink& link : robot_.links)
      if (!above.contains(link.name)) roots.push_back(link.name);
    if (roots.size() > 1) {
      add(&root, "", "the links " + quote(roots[0]) + " and " + quote(roots[1]) + " both hang on nothing",
          "join them by a joint, be it a fixed one");
      return;
    }
    std::vector<RobotJoint> ordered;
    std::vector<std::string> reached = roots;
    for (std::size_t i = 0; i < reached.size(); ++i) {
      const auto [first, last] = below.equal_range(reached[i]);
      for (auto joint = first; joint != last; ++joint) {
        ordered.push_back(*joint->second);
        reached.push_back(joint->second->child);
      }
    }
    if (reached.size() < robot_.links.size()) {
      const std::set<std::string> known(reached.begin(), reached.end());
      const auto lost = std::find_if(robot_.links.begin(), robot_.links.end(),
                                     [&](const UrdfLink& link) { return !known.contains(link.name); });
      problems_.add(lost->place, "link " + quote(lost->name), "its joints form a circle",
                    "remove the joint that closes it: a link hangs on one parent");
      return;
    }
    robot_.kinematics.root = roots.front();
    robot_.kinematics.joints = std::move(ordered);
  }

  std::shared_ptr<const std::string> file_;
  Problems& problems_;
  UrdfRobot robot_;
  std::size_t shapes_ = 0;
  std::map<std::string, belief::Color> materials_;
  std::set<std::string> link_names_;
  std::map<std::string, FilePlace> joint_places_;
};

}  // namespace

std::optional<UrdfRobot> parse_urdf(std::string_view text, const std::string& file, Problems& problems) {
  return UrdfReader(file, problems).read(text);
}

}  // namespace prescene::interfaces
