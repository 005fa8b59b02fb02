// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/robot_description.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "prescene/belief/scene.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces::robot_description_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

/// A scene whose robot is described by a URDF file of this text.
class Described {
 public:
  explicit Described(std::string urdf, std::string more = "", std::string urdf_path = "urdf/arm.urdf")
      : urdf_(std::move(urdf)) {
    text_ =
        "models: {block: {box: [0.1, 0.1, 0.1], mass: 1}}\n"
        "supports: {table: {box: [1, 1, 0.1]}}\n"
        "objects: {block: {model: block, pose: {position: [0, 0, 0.2]}}}\n"
        "robot_description:\n  file: " +
        urdf_path + "\n" + more;
    options_.read_file = [this](const std::filesystem::path& path) -> core::Result<std::vector<std::uint8_t>> {
      read_.push_back(path.string());
      return std::vector<std::uint8_t>(urdf_.begin(), urdf_.end());
    };
    options_.read_mesh = [this](const MeshRequest& request) -> core::Result<geometry::TriangleMesh> {
      meshes_.push_back(request);
      if (request.path.filename() == "missing.stl") return core::not_found(request.path.string() + ": no such file");
      return geometry::make_mesh(geometry::BoxShape{request.scale * Vector3d(100.0, 200.0, 300.0)});
    };
  }

  core::Result<belief::Scene> scene() { return parse_scene(text_, "robots/scene.yaml", options_, &report_); }
  std::shared_ptr<const RobotKinematics> robot() {
    auto robot = parse_robot_kinematics(text_, "robots/scene.yaml", options_);
    EXPECT_TRUE(robot.ok()) << robot.status().message();
    return robot ? *robot : nullptr;
  }
  std::string error() {
    const auto read = scene();
    EXPECT_EQ(read.status().code(), core::StatusCode::kInvalidInput) << urdf_;
    return read.status().message();
  }
  const FileReport& report() const { return report_; }
  const std::vector<std::string>& read() const { return read_; }
  const std::vector<MeshRequest>& meshes() const { return meshes_; }

 private:
  std::string urdf_, text_;
  SceneFileOptions options_;
  FileReport report_;
  std::vector<std::string> read_;
  std::vector<MeshRequest> meshes_;
};

std::string link(const std::string& name, const std::string& inside = "") {
  return "<link name=\"" + name + "\">" + inside + "</link>\n";
}
std::string shape(const std::string& kind, const std::string& geometry, const std::string& origin = "") {
  return "<" + kind + ">" + (origin.empty() ? "" : "<origin " + origin + "/>") + "<geometry>" + geometry +
         "</geometry></" + kind + ">";
}
std::string joint(const std::string& name, const std::string& type, const std::string& parent, const std::string& child,
                  const std::string& inside = "") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/>" + inside + "</joint>\n";
}
std::string robot(const std::string& inside) {
  return "<?xml version=\"1.0\"?>\n<robot name=\"arm\">\n" + inside + "</robot>\n";
}

/// 4 x 4, by hand: no Eigen geometry.
using Matrix = std::array<std::array<double, 4>, 4>;
Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t k = 0; k < 4; ++k) c[i][j] += a[i][k] * b[k][j];
  return c;
}
/// Modified parameters of Denavit and Hartenberg, in the order of Craig: twist and length before angle and offset.
Matrix of_craig(double a, double d, double alpha, double theta) {
  const double ca = std::cos(alpha), sa = std::sin(alpha), ct = std::cos(theta), st = std::sin(theta);
  return {{{ct, -st, 0.0, a}, {st * ca, ct * ca, -sa, -d * sa}, {st * sa, ct * sa, ca, d * ca}, {0.0, 0.0, 0.0, 1.0}}};
}
double difference(const Matrix& expected, const Pose& X) {
  const Eigen::Matrix4d matrix = X.matrix();
  double largest = 0.0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      largest = std::max(largest,
                         std::abs(matrix(i, j) - expected[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]));
  return largest;
}

// An arm of seven joints as its maker gives it twice: in the URDF by origins, in the data sheet by a, d and alpha.
TEST(RobotDescription, ForwardKinematicsAreThoseOfTheDataSheet) {
  struct Row {
    double a, d, alpha;
    const char* origin;
  };
  const Row rows[] = {{0.0, 0.333, 0.0, "xyz='0 0 0.333'"},
                      {0.0, 0.0, -kPi / 2, "rpy='-1.5707963267948966 0 0'"},
                      {0.0, 0.316, kPi / 2, "xyz='0 -0.316 0' rpy='1.5707963267948966 0 0'"},
                      {0.0825, 0.0, kPi / 2, "xyz='0.0825 0 0' rpy='1.5707963267948966 0 0'"},
                      {-0.0825, 0.384, -kPi / 2, "xyz='-0.0825 0.384 0' rpy='-1.5707963267948966 0 0'"},
                      {0.0, 0.0, kPi / 2, "rpy='1.5707963267948966 0 0'"},
                      {0.088, 0.0, kPi / 2, "xyz='0.088 0 0' rpy='1.5707963267948966 0 0'"}};
  std::string text = link("link0");
  for (std::size_t i = 0; i < std::size(rows); ++i) {
    const std::string n = std::to_string(i + 1);
    text += link("link" + n) +
            joint("joint" + n, "revolute", "link" + std::to_string(i), "link" + n,
                  std::string("<origin ") + rows[i].origin + "/><axis xyz='0 0 1'/><limit lower='-2.9' upper='2.9'/>");
  }
  text += link("flange") + joint("joint8", "fixed", "link7", "flange", "<origin xyz='0 0 0.107'/>");
  const auto arm = Described(robot(text)).robot();
  ASSERT_TRUE(arm);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(-2.9, 2.9);
  for (int trial = 0; trial < 200; ++trial) {
    std::map<std::string, double> q;
    Matrix expected = of_craig(0.0, 0.0, 0.0, 0.0);
    for (std::size_t i = 0; i < std::size(rows); ++i) {
      const std::string n = std::to_string(i + 1);
      q["joint" + n] = angle(random);
      expected = product(expected, of_craig(rows[i].a, rows[i].d, rows[i].alpha, q["joint" + n]));
      EXPECT_LT(difference(expected, link_poses(*arm, q).at("link" + n)), 1e-12);
    }
    EXPECT_LT(difference(product(expected, of_craig(0.0, 0.107, 0.0, 0.0)), link_poses(*arm, q).at("flange")), 1e-12);
  }
}

// Any axis and origin: the rotation by Rodrigues' formula and by products of elementary rotations, written out.
TEST(RobotDescription, JointsTurnAboutTheirAxesInTheFrameOfTheirOrigins) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> number(-2.0, 2.0);
  for (int trial = 0; trial < 100; ++trial) {
    Vector3d xyz, rpy, axis;
    for (int i = 0; i < 3; ++i) xyz[i] = number(random), rpy[i] = number(random), axis[i] = number(random);
    const double q = number(random);
    const auto text_of = [](const Vector3d& v) {
      return number_text(v.x()) + " " + number_text(v.y()) + " " + number_text(v.z());
    };
    const auto arm = Described(robot(link("base") + link("tip") +
                                     joint("j", trial % 2 == 0 ? "continuous" : "prismatic", "base", "tip",
                                           "<origin xyz='" + text_of(xyz) + "' rpy='" + text_of(rpy) +
                                               "'/><axis xyz='" + text_of(axis) + "'/>")))
                         .robot();
    ASSERT_TRUE(arm);
    const double cr = std::cos(rpy.x()), sr = std::sin(rpy.x()), cp = std::cos(rpy.y()), sp = std::sin(rpy.y()),
                 cy = std::cos(rpy.z()), sy = std::sin(rpy.z());
    const Matrix origin = {{{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, xyz.x()},
                            {sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, xyz.y()},
                            {-sp, cp * sr, cp * cr, xyz.z()},
                            {0.0, 0.0, 0.0, 1.0}}};
    const Vector3d u = axis / std::sqrt(axis.dot(axis));
    const double c = std::cos(q), s = std::sin(q), v = 1.0 - c;
    const Matrix turn = {{{c + u.x() * u.x() * v, u.x() * u.y() * v - u.z() * s, u.x() * u.z() * v + u.y() * s, 0.0},
                          {u.y() * u.x() * v + u.z() * s, c + u.y() * u.y() * v, u.y() * u.z() * v - u.x() * s, 0.0},
                          {u.z() * u.x() * v - u.y() * s, u.z() * u.y() * v + u.x() * s, c + u.z() * u.z() * v, 0.0},
                          {0.0, 0.0, 0.0, 1.0}}};
    const Matrix slide = {
        {{1.0, 0.0, 0.0, q * u.x()}, {0.0, 1.0, 0.0, q * u.y()}, {0.0, 0.0, 1.0, q * u.z()}, {0.0, 0.0, 0.0, 1.0}}};
    EXPECT_LT(difference(product(origin, trial % 2 == 0 ? turn : slide), link_poses(*arm, {{"j", q}}).at("tip")),
              1e-12);
  }
}

TEST(RobotDescription, MimickingJointsFollowByTheirRules) {
  const std::string fingers =
      link("hand") + link("left") + link("right") + link("tip") +
      joint("open", "prismatic", "hand", "left", "<axis xyz='0 1 0'/><limit lower='0.01' upper='0.05'/>") +
      joint("follow", "prismatic", "hand", "right",
            "<axis xyz='0 -1 0'/><mimic joint='open' multiplier='2' offset='0.01'/>") +
      joint("bend", "revolute", "right", "tip", "<axis xyz='1 0 0'/><mimic joint='follow' multiplier='10'/>");
  const auto hand = Described(robot(fingers)).robot();
  ASSERT_TRUE(hand);
  EXPECT_EQ(hand->root, "hand");
  auto q = joint_positions(*hand, {{"open", 0.02}});
  EXPECT_NEAR(q.at("follow"), 0.05, 1e-15);
  EXPECT_NEAR(q.at("bend"), 0.5, 1e-15) << "which mimics one that mimics";
  EXPECT_NEAR(link_poses(*hand, {{"open", 0.02}}).at("right").translation.y(), -0.05, 1e-15);
  q = joint_positions(*hand, {{"open", 0.02}, {"follow", 0.03}});
  EXPECT_EQ(q.at("follow"), 0.03) << "what is told takes precedence";
  q = joint_positions(*hand, {});
  EXPECT_NEAR(q.at("open"), 0.03, 1e-15) << "the middle, as 0 is out of its limits";
}

TEST(RobotDescription, LinksBecomeBodiesOfTheScene) {
  const std::string arm =
      "<material name='blue'><color rgba='0.1 0.2 0.9 1'/></material>" +
      link("base", shape("visual", "<cylinder radius='0.1' length='0.2'/>") +
                       shape("collision", "<box size='0.2 0.2 0.2'/>", "xyz='0 0 0.1'")) +
      link("upper", "<visual><geometry><box size='0.1 0.1 0.4'/></geometry><material name='blue'/></visual>") +
      link("frame") +
      link("tool", shape("collision", "<sphere radius='0.03'/>") +
                       shape("collision", "<sphere radius='0.02'/>", "xyz='0 0 0.05'")) +
      joint("lift", "revolute", "base", "upper",
            "<origin xyz='0 0 0.2'/><axis xyz='0 1 0'/><limit lower='-1' upper='1'/>") +
      joint("f", "fixed", "upper", "frame") + joint("t", "fixed", "frame", "tool", "<origin xyz='0 0 0.4'/>");
  Described described(robot(arm), "  pose: {position: [1, 2, 0]}\n  joint_positions: {lift: 0.5}\n  friction: 0.9\n");
  const auto scene = described.scene();
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  EXPECT_EQ(described.read().front(), "robots/urdf/arm.urdf") << "from the scene file's folder";
  ASSERT_EQ(scene->robot.size(), 3U) << "a link without a shape is no body";
  const belief::KinematicBody& base = scene->robot[0];
  EXPECT_EQ(base.name, "base");
  EXPECT_EQ(base.collision.size(), 1U);
  EXPECT_NEAR(geometry::bounding_box(*base.visual).sizes().z(), 0.2, 1e-9) << "the camera sees <visual>";
  EXPECT_EQ(belief::mean(base.contact.friction), 0.9);
  const belief::KinematicBody& upper = scene->robot[1];
  EXPECT_EQ(upper.collision.size(), 1U) << "that of the visual, as there is no other";
  EXPECT_EQ(upper.color, (belief::Color{0.1, 0.2, 0.9}));
  ASSERT_EQ(upper.timeline.size(), 1U);
  EXPECT_LT((upper.timeline[0].X_WG.translation - Vector3d(1.0, 2.0, 0.2)).norm(), 1e-12);
  const belief::KinematicBody& tool = scene->robot[2];
  EXPECT_EQ(tool.collision.size(), 2U);
  EXPECT_LT(
      (tool.timeline[0].X_WG.translation - Vector3d(1.0 + 0.4 * std::sin(0.5), 2.0, 0.2 + 0.4 * std::cos(0.5))).norm(),
      1e-12);
  Described without(robot(arm), "  without: [base, tool]\n  draw: collision\n");
  const auto fewer = without.scene();
  ASSERT_TRUE(fewer.ok()) << fewer.status().message();
  ASSERT_EQ(fewer->robot.size(), 1U);
  EXPECT_EQ(fewer->robot[0].name, "upper");
}

TEST(RobotDescription, MeshesAreFoundScaledAndMirrored) {
  const auto meshed = [](const std::string& mesh) {
    return robot(link("base", shape("visual", "<mesh " + mesh + "/>")));
  };
  const auto path_of = [&](const std::string& name, const std::string& more, const std::string& urdf) {
    Described described(meshed("filename='" + name + "' scale='0.001 0.001 0.001'"), more, urdf);
    const auto scene = described.scene();
    EXPECT_TRUE(scene.ok()) << scene.status().message();
    return described.meshes().empty() ? "" : described.meshes().front().path.string();
  };
  EXPECT_EQ(path_of("meshes/a.stl", "", "urdf/arm.urdf"), "robots/urdf/meshes/a.stl");
  EXPECT_EQ(path_of("file:///opt/a.stl", "", "urdf/arm.urdf"), "/opt/a.stl");
  EXPECT_EQ(path_of("package://arm_description/meshes/a.stl", "", "../arm_description/urdf/arm.urdf"),
            "arm_description/meshes/a.stl");
  EXPECT_EQ(path_of("package://parts/a.stl", "  packages: {parts: ../elsewhere}\n", "urdf/arm.urdf"),
            "elsewhere/a.stl");
  EXPECT_THAT(
      Described(meshed("filename='package://parts/a.stl'")).error(),
      testing::AllOf(HasSubstr("robots/urdf/arm.urdf:3"), HasSubstr("ROS package 'parts'"), HasSubstr("packages:")));
  Described described(meshed("filename='a.dae' scale='0.001 -0.001 0.002'"));
  const auto scene = described.scene();
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  ASSERT_EQ(described.meshes().size(), 1U) << "seen and felt, read once";
  EXPECT_EQ(described.meshes()[0].scale, 0.001);
  EXPECT_TRUE(described.meshes()[0].ignores_up);
  EXPECT_LT((geometry::bounding_box(*scene->robot[0].visual).sizes() - Vector3d(0.1, 0.2, 0.6)).norm(), 1e-9);
  const auto solid = geometry::mass_properties(*scene->robot[0].visual, 1.0);
  ASSERT_TRUE(solid.ok()) << "a mirrored mesh is turned inside out again";
  EXPECT_NEAR(solid->mass, 0.1 * 0.2 * 0.6, 1e-9);
}

TEST(RobotDescription, SaysWhatIsWrongAndWhere) {
  const std::string two = link("a") + link("b");
  struct Case {
    std::string urdf, more, expected;
  };
  const Case cases[] = {
      {"", "", "not XML"},
      {"<robot><link name='a'></robot>", "", "not XML"},
      {"<sdf/>", "", "outermost element is not <robot>"},
      {robot("<xacro:include filename='x'/>"), "", "xacro FILE > robot.urdf"},
      {robot(""), "", "no link"},
      {robot("<link/>"), "", "'name' is missing"},
      {robot(link("a") + link("a")), "", "another link has this name"},
      {robot(two), "", "'a' and 'b' both hang on nothing"},
      {robot(two + joint("j", "hinge", "a", "b")), "", "type 'hinge'"},
      {robot(two + joint("j", "fixed", "a", "c")), "", "there is no link 'c'"},
      {robot(two + joint("j", "fixed", "a", "b") + joint("k", "fixed", "a", "b")), "", "is the child of 'j' already"},
      {robot(two + joint("j", "fixed", "a", "b") + joint("j", "fixed", "b", "a")), "", "another joint has this name"},
      {robot(link("root") + two + joint("j", "fixed", "a", "b") + joint("k", "fixed", "b", "a")), "", "form a circle"},
      {robot(two + joint("j", "fixed", "a", "b") + joint("k", "fixed", "b", "a")), "", "form a circle"},
      {robot(two + joint("j", "revolute", "a", "b", "<axis xyz='0 0 0'/>")), "", "no direction"},
      {robot(two + joint("j", "revolute", "a", "b", "<axis xyz='0 0'/>")), "", "not 3 numbers"},
      {robot(two + joint("j", "revolute", "a", "b", "<origin xyz='0 0 nan'/>")), "", "not 3 numbers"},
      {robot(two + joint("j", "revolute", "a", "b", "<origin xyz='0 0 1e30'/>")), "", "not 3 numbers"},
      {robot(two + joint("j", "revolute", "a", "b", "<limit lower='1' upper='0'/>")), "", "'lower' is above 'upper'"},
      {robot(two + joint("j", "revolute", "a", "b", "<mimic joint='k'/>")), "", "no joint 'k' that moves"},
      {robot(two + joint("j", "revolute", "a", "b", "<mimic joint='j'/>")), "", "mimics itself"},
      {robot(two + link("c") + joint("j", "revolute", "a", "b", "<mimic joint='k'/>") +
             joint("k", "revolute", "b", "c", "<mimic joint='j'/>")),
       "", "mimics itself"},
      {robot(link("a", "<visual/>")), "", "the shape is none"},
      {robot(link("a", shape("visual", "<cone/>"))), "", "the shape is none"},
      {robot(link("a", shape("visual", "<sphere/>"))), "", "'radius' is missing"},
      {robot(link("a", shape("visual", "<box size='1 1 -1'/>"))), "", "not more than 0"},
      {robot(link("a", shape("visual", "<mesh/>"))), "", "'filename' is missing"},
      {robot(link("a", shape("visual", "<mesh filename='missing.stl'/>"))), "", "no such file"},
      {robot(link("a", shape("visual", "<mesh filename='big.stl'/>"))), "", "probably in millimetres"},
      {robot(link("a", shape("visual", "<mesh filename='http://x/a.stl'/>"))), "", "can't be read"},
      {robot(link("a", shape("visual", "<mesh filename='a.stl' scale='0 1 1'/>"))), "", "scale is 0"},
      {robot(link("a b", shape("visual", "<sphere radius='1'/>"))), "", "rename the link"},
      {robot(link("table", shape("visual", "<sphere radius='1'/>"))), "", "is taken"},
      {robot(two + joint("j", "revolute", "a", "b")), "  joint_positions: {k: 1}\n", "no joint of this name moves"},
      {robot(two + joint("j", "revolute", "a", "b", "<limit lower='-1' upper='1'/>")), "  joint_positions: {j: 90}\n",
       "beyond the joint's limits"},
      {robot(link("a")), "  without: [b]\n", "no link 'b'"},
      {robot(link("a")), "  fle: x\n", "unknown key"},
  };
  for (const Case& bad : cases) EXPECT_THAT(Described(bad.urdf, bad.more).error(), HasSubstr(bad.expected));
}

TEST(RobotDescription, ASceneWithoutOneHasNoKinematicsAndOthersTextsReadNoFiles) {
  const auto none = parse_robot_kinematics("objects: {}\n", "s.yaml");
  ASSERT_TRUE(none.ok());
  EXPECT_EQ(*none, nullptr);
  SceneFileOptions options;
  options.follow_files = false;
  const auto refused = parse_robot_kinematics("robot_description: {file: a.urdf}\n", "s.yaml", options);
  EXPECT_THAT(refused.status().message(), HasSubstr("other files can't be read here"));
}

// Whatever a byte is changed into, or where the text ends: an answer, and one that names the file if it is an error.
TEST(RobotDescription, DamageIsReportedOrHarmless) {
  const std::string whole =
      robot(link("a", shape("visual", "<box size='1 1 1'/>")) +
            link("b", shape("collision", "<mesh filename='m.stl' scale='0.001 0.001 0.001'/>")) +
            joint("j", "revolute", "a", "b",
                  "<origin xyz='0 0 1' rpy='1 0 0'/><axis xyz='0 0 1'/><limit lower='-1' upper='1'/>"));
  ASSERT_TRUE(Described(whole).scene().ok());
  std::mt19937 random(3);
  for (int trial = 0; trial < 3000; ++trial) {
    std::string text = whole;
    if (trial % 3 == 0) text.resize(random() % text.size());
    for (unsigned changes = random() % 4; changes > 0 && !text.empty(); --changes) {
      const std::size_t at = random() % text.size();
      if (random() % 2 == 0) {
        text[at] = static_cast<char>(random());
      } else {
        const std::size_t length = random() % 40;
        text.insert(at, text.substr(random() % text.size(), length));
      }
    }
    Described damaged(text);
    const auto scene = damaged.scene();
    EXPECT_TRUE(scene.ok() || scene.status().message().find("robots/") != std::string::npos) << text;
  }
  std::string deep = "<robot>";
  for (int i = 0; i < 100'000; ++i) deep += "<link name='a'>";
  EXPECT_THAT(Described(deep).error(), HasSubstr("not XML"));
}

}  // namespace
}  // namespace prescene::interfaces::robot_description_test
