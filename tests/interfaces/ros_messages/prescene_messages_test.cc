// SPDX-License-Identifier: Apache-2.0
// Prescene's own messages: what is on the wire, read by a decoder written by hand after the .msg files, and whether the
// .msg files, the IDL and the texts in recordings say the same.
#include "prescene/interfaces/ros_messages/prescene_messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/schemas.h"
#include "tests/support/paths.h"

namespace prescene::interfaces::prescene_messages_test {
namespace {

/// Little endian, alignment from the byte after the header.
class Wire {
 public:
  explicit Wire(std::vector<std::uint8_t> bytes) : bytes_(std::move(bytes)) {
    EXPECT_EQ((std::vector<std::uint8_t>{bytes_.begin(), bytes_.begin() + 4}), (std::vector<std::uint8_t>{0, 1, 0, 0}));
  }
  std::uint64_t whole(std::size_t size) {
    while ((at_ - 4) % size != 0) ++at_;
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value |= std::uint64_t{bytes_.at(at_ + i)} << (8 * i);
    at_ += size;
    return value;
  }
  double f8() {
    const std::uint64_t bits = whole(8);
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  std::string text() {
    const std::uint64_t length = whole(4);
    std::string value(reinterpret_cast<const char*>(&bytes_.at(at_)), length - 1);
    EXPECT_EQ(bytes_.at(at_ + length - 1), 0);
    at_ += length;
    return value;
  }
  RosPose pose() {
    RosPose pose;
    for (double* value : {&pose.position.x, &pose.position.y, &pose.position.z, &pose.orientation.x,
                          &pose.orientation.y, &pose.orientation.z, &pose.orientation.w})
      *value = f8();
    return pose;
  }
  bool is_at_end() const { return at_ == bytes_.size(); }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t at_ = 4;
};

const RosPose kPose{{1.0, 2.0, 3.0}, {0.5, -0.5, 0.5, 0.5}};

RosObjectBelief mug() {
  RosObjectBelief mug;
  mug.name = "mug";
  mug.model = "mug of clay";
  mug.state = 3;
  mug.motion = 200;  // of a later version
  mug.held_by = "gripper";
  mug.confidence = 0.75;
  mug.existence = 0.875;
  mug.visible_share = 0.125;
  mug.pose.pose = kPose;
  for (std::size_t i = 0; i < 36; ++i) mug.pose.covariance[i] = 100.0 + static_cast<double>(i);
  mug.twist = {{1.0, 2.0, 3.0}, {4.0, 5.0, 6.0}};
  mug.parameters = {{"friction", 0.5, 0.0625, 0.25, 0.75}, {"mass", 0.3, 0.01, 0.28, 0.32}};
  mug.lessons = 4'000'000'000U;
  mug.learned = {5, 6};
  mug.alternatives = {{kPose, 0.03125}};
  mug.is_new = true;
  mug.size = {0.1, 0.2, 0.3};
  return mug;
}

/// Fields in the order of ObjectBelief.msg.
RosObjectBelief read_object(Wire& wire) {
  RosObjectBelief object;
  object.name = wire.text();
  object.model = wire.text();
  object.state = static_cast<std::uint8_t>(wire.whole(1));
  object.motion = static_cast<std::uint8_t>(wire.whole(1));
  object.held_by = wire.text();
  object.confidence = wire.f8();
  object.existence = wire.f8();
  object.visible_share = wire.f8();
  object.pose.pose = wire.pose();
  for (double& value : object.pose.covariance) value = wire.f8();
  for (RosVector3* part : {&object.twist.linear, &object.twist.angular})
    for (double* value : {&part->x, &part->y, &part->z}) *value = wire.f8();
  object.parameters.resize(wire.whole(4));
  for (RosParameterEstimate& parameter : object.parameters) {
    parameter.name = wire.text();
    for (double* value : {&parameter.mean, &parameter.standard_deviation, &parameter.low, &parameter.high})
      *value = wire.f8();
  }
  object.lessons = static_cast<std::uint32_t>(wire.whole(4));
  object.learned.sec = static_cast<std::int32_t>(wire.whole(4));
  object.learned.nanosec = static_cast<std::uint32_t>(wire.whole(4));
  object.alternatives.resize(wire.whole(4));
  for (RosAlternativePose& other : object.alternatives) {
    other.pose = wire.pose();
    other.probability = wire.f8();
  }
  object.is_new = wire.whole(1) == 1;
  for (double* value : {&object.size.x, &object.size.y, &object.size.z}) *value = wire.f8();
  return object;
}

TEST(PresceneMessages, BeliefIsOnTheWireAsItsMsgFileSays) {
  RosBelief belief;
  belief.header = {{7, 8}, "map"};
  belief.step = 1'000'000'000'000;
  belief.objects = {mug(), RosObjectBelief{}};
  belief.joints = {{"hinge of the lid", 1, 0.5, 0.25, -0.125, -1e308, 1e308, 0.5}};
  Wire wire(encode_cdr(belief));
  EXPECT_EQ(wire.whole(4), 7U);
  EXPECT_EQ(wire.whole(4), 8U);
  EXPECT_EQ(wire.text(), "map");
  EXPECT_EQ(wire.whole(8), 1'000'000'000'000U);
  ASSERT_EQ(wire.whole(4), 2U);
  EXPECT_EQ(read_object(wire), mug());
  EXPECT_EQ(read_object(wire), RosObjectBelief{});
  ASSERT_EQ(wire.whole(4), 1U);
  EXPECT_EQ(wire.text(), "hinge of the lid");
  EXPECT_EQ(wire.whole(1), 1U);
  for (const double value : {0.5, 0.25, -0.125, -1e308, 1e308, 0.5}) EXPECT_EQ(wire.f8(), value);
  EXPECT_TRUE(wire.is_at_end());
}

TEST(PresceneMessages, AnswerIsOnTheWireAsItsMsgFileSays) {
  RosAnswer answer{"7",
                   41,
                   "predict",
                   1,
                   "none",
                   "not_found",
                   {{"in_bin", "ends", "milk", "bin", 0.5, 0.25, 0.75}},
                   {mug()},
                   384,
                   true,
                   {"a remark", ""},
                   "{}"};
  Wire wire(encode_cdr(answer));
  EXPECT_EQ(wire.text(), "7");
  EXPECT_EQ(wire.whole(8), 41U);
  EXPECT_EQ(wire.text(), "predict");
  EXPECT_EQ(wire.whole(1), 1U);
  EXPECT_EQ(wire.text(), "none");
  EXPECT_EQ(wire.text(), "not_found");
  ASSERT_EQ(wire.whole(4), 1U);
  for (const char* text : {"in_bin", "ends", "milk", "bin"}) EXPECT_EQ(wire.text(), text);
  for (const double value : {0.5, 0.25, 0.75}) EXPECT_EQ(wire.f8(), value);
  ASSERT_EQ(wire.whole(4), 1U);
  EXPECT_EQ(read_object(wire), mug());
  EXPECT_EQ(wire.whole(8), 384U);
  EXPECT_EQ(wire.whole(1), 1U);
  ASSERT_EQ(wire.whole(4), 2U);
  EXPECT_EQ(wire.text(), "a remark");
  EXPECT_EQ(wire.text(), "");
  EXPECT_EQ(wire.text(), "{}");
  EXPECT_TRUE(wire.is_at_end());
}

TEST(PresceneMessages, TheSmallOnesAreOnTheWireAsTheirMsgFilesSay) {
  Wire event(encode_cdr(RosEvent{{{7, 8}, "map"}, 9, "held", "mug", "table", "side", "", "gripper", "seen"}));
  EXPECT_EQ(event.whole(4), 7U);
  EXPECT_EQ(event.whole(4), 8U);
  EXPECT_EQ(event.text(), "map");
  EXPECT_EQ(event.whole(8), 9U);
  for (const char* text : {"held", "mug", "table", "side", "", "gripper", "seen"}) EXPECT_EQ(event.text(), text);
  EXPECT_TRUE(event.is_at_end());

  Wire query(encode_cdr(RosQuery{"7", "predict", "mug", 2.5, 0.5, true, {"inputs", "chaos"}, "{}"}));
  for (const char* text : {"7", "predict", "mug"}) EXPECT_EQ(query.text(), text);
  EXPECT_EQ(query.f8(), 2.5);
  EXPECT_EQ(query.f8(), 0.5);
  EXPECT_EQ(query.whole(1), 1U);
  ASSERT_EQ(query.whole(4), 2U);
  for (const char* text : {"inputs", "chaos", "{}"}) EXPECT_EQ(query.text(), text);
  EXPECT_TRUE(query.is_at_end());

  Wire cancel(encode_cdr(RosCancel{"7", "c"}));
  EXPECT_EQ(cancel.text(), "7");
  EXPECT_EQ(cancel.text(), "c");
  EXPECT_TRUE(cancel.is_at_end());

  Wire progress(encode_cdr(RosProgress{"7", 0.5, "simulating", -1.0}));
  EXPECT_EQ(progress.text(), "7");
  EXPECT_EQ(progress.f8(), 0.5);
  EXPECT_EQ(progress.text(), "simulating");
  EXPECT_EQ(progress.f8(), -1.0);
  EXPECT_TRUE(progress.is_at_end());
}

TEST(PresceneMessages, WhatALaterVersionAddsIsReadAsItCame) {
  RosBelief belief;
  belief.objects = {mug()};
  const auto read = decode_cdr<RosBelief>(encode_cdr(belief));
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->objects[0].motion, 200);
}

// --- The three texts of each message ---------------------------------------------------------------------------------

/// (type, name) of each field.
using Definition = std::vector<std::pair<std::string, std::string>>;
using Definitions = std::map<std::string, Definition>;

std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Without comments and constants.
Definition definition_of_msg(const std::string& text) {
  Definition definition;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string type, name;
    if (words >> type >> name && name.find('=') == std::string::npos) definition.emplace_back(type, name);
  }
  return definition;
}

Definitions msg_files() {
  Definitions definitions;
  for (const auto& entry : std::filesystem::directory_iterator(tests::source_dir() / "packaging/prescene_msgs/msg"))
    definitions[entry.path().stem()] = definition_of_msg(read_file(entry.path()));
  return definitions;
}

/// "sequence<geometry_msgs::msg::dds_::Pose_>" -> "geometry_msgs/Pose[]"; of our own package without its name.
std::string msg_type_of(std::string type) {
  static const std::map<std::string, std::string> kNames = {
      {"octet", "uint8"},   {"boolean", "bool"},         {"double", "float64"},
      {"string", "string"}, {"unsigned long", "uint32"}, {"unsigned long long", "uint64"}};
  static const std::regex kSequence("sequence<(.*)>");
  static const std::regex kNested("(\\w+)::msg::dds_::(\\w+)_");
  std::smatch match;
  if (std::regex_match(type, match, kSequence)) return msg_type_of(match[1].str()) + "[]";
  if (std::regex_match(type, match, kNested))
    return (match[1] == "prescene_msgs" ? "" : match[1].str() + "/") + match[2].str();
  const auto found = kNames.find(type);
  EXPECT_NE(found, kNames.end()) << type;
  return found == kNames.end() ? type : found->second;
}

Definitions idl_structs() {
  Definitions definitions;
  const std::string text = read_file(tests::source_dir() / "interfaces/dds/idl/prescene_msgs.idl");
  static const std::regex kStruct("struct (\\w+)_ \\{([^}]*)\\}");
  static const std::regex kField("\\s*([^;]*\\S)\\s+(\\w+);");
  for (std::sregex_iterator at(text.begin(), text.end(), kStruct), end; at != end; ++at) {
    const std::string body = (*at)[2].str();
    for (std::sregex_iterator field(body.begin(), body.end(), kField); field != end; ++field)
      definitions[(*at)[1].str()].emplace_back(msg_type_of((*field)[1].str()), (*field)[2].str());
  }
  return definitions;
}

TEST(PresceneMessages, MsgFilesAndIdlAgree) {
  const Definitions files = msg_files();
  EXPECT_EQ(files.size(), 11U);
  EXPECT_EQ(files, idl_structs());
}

TEST(PresceneMessages, MsgFilesAndTheTextsInRecordingsAgree) {
  Definitions texts;
  for (const RosType& type : ros_types()) {
    if (!type.name.starts_with("prescene_msgs/msg/")) continue;
    texts[std::string(type.name.substr(type.name.rfind('/') + 1))] = definition_of_msg(std::string(type.text));
  }
  EXPECT_EQ(msg_files(), texts);
}

TEST(PresceneMessages, ThePackageMakesAllOfThemAndNamesWhatItNeeds) {
  const auto package = tests::source_dir() / "packaging/prescene_msgs";
  const std::string made = read_file(package / "CMakeLists.txt");
  const std::string needed = read_file(package / "package.xml");
  for (const auto& [name, definition] : msg_files()) {
    EXPECT_THAT(made, testing::HasSubstr("\"msg/" + name + ".msg\""));
    for (const auto& [type, field] : definition) {
      const std::size_t slash = type.find('/');
      if (slash == std::string::npos) continue;
      EXPECT_THAT(needed, testing::HasSubstr("<depend>" + type.substr(0, slash) + "</depend>")) << name << "." << field;
      EXPECT_THAT(made, testing::HasSubstr("find_package(" + type.substr(0, slash) + " REQUIRED)"));
    }
  }
}

/// `enumerator` of a struct's field has the number that the .msg file gives it.
void expect_constant(const std::string& file, const std::string& name, int value) {
  const std::string text = read_file(tests::source_dir() / "packaging/prescene_msgs/msg" / (file + ".msg"));
  EXPECT_THAT(text, testing::HasSubstr("\nuint8 " + name + "=" + std::to_string(value) + "\n"));
}

TEST(PresceneMessages, ConstantsAreThoseOfTheMsgFiles) {
  const auto of = [](auto value) { return static_cast<int>(value); };
  expect_constant("ObjectBelief", "STATE_UNKNOWN", of(RosObjectState::kUnknown));
  expect_constant("ObjectBelief", "STATE_TRACKED", of(RosObjectState::kTracked));
  expect_constant("ObjectBelief", "STATE_DOUBTFUL", of(RosObjectState::kDoubtful));
  expect_constant("ObjectBelief", "STATE_UNSEEN", of(RosObjectState::kUnseen));
  expect_constant("ObjectBelief", "STATE_LOST", of(RosObjectState::kLost));
  expect_constant("ObjectBelief", "MOTION_UNKNOWN", of(RosObjectMotion::kUnknown));
  expect_constant("ObjectBelief", "MOTION_RESTING", of(RosObjectMotion::kResting));
  expect_constant("ObjectBelief", "MOTION_MOVING", of(RosObjectMotion::kMoving));
  expect_constant("ObjectBelief", "MOTION_HELD", of(RosObjectMotion::kHeld));
  expect_constant("JointBelief", "TYPE_UNKNOWN", of(RosJointType::kUnknown));
  expect_constant("JointBelief", "TYPE_HINGE", of(RosJointType::kHinge));
  expect_constant("JointBelief", "TYPE_SLIDER", of(RosJointType::kSlider));
  expect_constant("Answer", "STATE_UNKNOWN", of(RosAnswerState::kUnknown));
  expect_constant("Answer", "STATE_ANSWERED", of(RosAnswerState::kAnswered));
  expect_constant("Answer", "STATE_SO_FAR", of(RosAnswerState::kSoFar));
  expect_constant("Answer", "STATE_REFUSED", of(RosAnswerState::kRefused));
  expect_constant("Answer", "STATE_CANCELLED", of(RosAnswerState::kCancelled));
}

}  // namespace
}  // namespace prescene::interfaces::prescene_messages_test
