// SPDX-License-Identifier: Apache-2.0
// The parameters of the service's node: the table by itself, and what a client does with it over the bus.
#include "prescene/service/live/node_parameters.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "prescene/core/random.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/recording/replay.h"
#include "tests/interfaces/dds/parameter_client.h"
#include "tests/service/live_service_fixture.h"
#include "tests/support/paths.h"

namespace prescene::service::node_parameters_test {
namespace {

using interfaces::RosParameter;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using tests::ParameterClient;
using tests::ParamValue;

RosParameter wish(const std::string& name, const ParameterValue& value) { return {name, to_ros_value(value)}; }

/// "a.x" and "a.b.y" are numbers that can be set, in 0 to 10; "mode" is a text that can be set; "fixed" can't be.
class Table : public ::testing::Test {
 protected:
  static ParameterTable make(std::vector<std::string>& applied, int& rounds) {
    const auto note = [&applied](const std::string& name) {
      return [&applied, name](const ParameterValue&) { applied.push_back(name); };
    };
    std::vector<NodeParameter> parameters = {{"a.x", "x.", 1.0, note("a.x"), std::pair(0.0, 10.0)},
                                             {"a.b.y", "y.", 2.0, note("a.b.y"), std::pair(0.0, 10.0)},
                                             {"count", "n.", std::int64_t{3}, note("count"), std::pair(0.0, 10.0)},
                                             {"mode", "m.", "slow", note("mode"), std::nullopt, {"slow", "fast"}},
                                             {"on", "o.", false, note("on")},
                                             {"fixed", "f.", "as it is"}};
    return ParameterTable(std::move(parameters), [&rounds] { ++rounds; });
  }
  std::vector<std::string> applied_;
  int rounds_ = 0;
  ParameterTable table_ = make(applied_, rounds_);
};

TEST_F(Table, ListsByPrefixAndDepth) {
  const auto names = [&](const std::vector<std::string>& prefixes, std::uint64_t depth) {
    return table_.list(prefixes, depth).names;
  };
  EXPECT_THAT(names({}, 0), ElementsAre("a.b.y", "a.x", "count", "fixed", "mode", "on"));
  EXPECT_THAT(names({}, 1), ElementsAre("count", "fixed", "mode", "on"));
  EXPECT_THAT(names({"a"}, 0), ElementsAre("a.b.y", "a.x"));
  EXPECT_THAT(names({"a"}, 1), ElementsAre("a.x"));
  EXPECT_THAT(names({"a.b", "mode"}, 1), ElementsAre("a.b.y", "mode"));
  EXPECT_THAT(names({"mo", "a.", ""}, 0), IsEmpty());
  EXPECT_THAT(table_.list({}, 0).prefixes, ElementsAre("a.b", "a"));
}

TEST_F(Table, DescribesWhatIsThereAndNotWhatIsNot) {
  const std::vector<std::string> names = {"a.x", "mode", "fixed", "count", "none", "\xff"};
  const auto described = table_.describe(names);
  ASSERT_EQ(described.size(), names.size());
  EXPECT_EQ(described[0].type, 3);
  EXPECT_FALSE(described[0].read_only);
  ASSERT_EQ(described[0].floating_point_range.size(), 1U);
  EXPECT_EQ(described[0].floating_point_range[0], (interfaces::RosFloatingPointRange{0.0, 10.0, 0.0}));
  EXPECT_EQ(described[1].additional_constraints, "one of slow, fast");
  EXPECT_TRUE(described[2].read_only);
  EXPECT_EQ(described[3].integer_range.at(0), (interfaces::RosIntegerRange{0, 10, 0}));
  EXPECT_EQ(described[4].name, "none");
  EXPECT_EQ(described[4].type, 0);
  EXPECT_EQ(described[5].name, "");
  EXPECT_THAT(table_.types(names), ElementsAre(3, 4, 4, 2, 0, 0));
}

TEST_F(Table, WhatIsRefusedChangesNothingAndSaysWhy) {
  const double infinite = std::numeric_limits<double>::infinity();
  RosParameter strange{"a.x", {}};
  strange.value.type = 200;
  const std::vector<std::pair<RosParameter, std::string>> bad = {
      {wish("none", 1.0), "there is no parameter 'none'"},
      {wish("fixed", "other"), "restart the service"},
      {wish("a.x", 10.5), "'a.x' may be 0 to 10, not 10.5"},
      {wish("a.x", -1.0), "not -1"},
      {wish("a.x", std::nan("")), "not nan"},
      {wish("a.x", infinite), "not inf"},
      {wish("a.x", std::int64_t{11}), "not 11"},
      {wish("a.x", "3"), "'a.x' is of type double, and the value that was given is of type string"},
      {wish("a.x", true), "of type bool"},
      {wish("count", 3.0), "'count' is of type integer"},
      {wish("count", std::int64_t{11}), "not 11"},
      {wish("mode", "medium"), "'mode' is one of slow, fast, not 'medium'"},
      {wish("on", std::int64_t{1}), "of type integer"},
      {{"a.x", {}}, "of type nothing"},
      {strange, "of type type 200"},
      {wish("\xff\x1b", 1.0), "'\\xff\\x1b'"}};
  const auto names = table_.list({}, 0).names;
  const auto before = table_.get(names);
  for (const auto& [asked, reason] : bad) {
    const auto results = table_.set(std::vector{asked});
    ASSERT_EQ(results.size(), 1U);
    EXPECT_FALSE(results[0].successful) << reason;
    EXPECT_THAT(results[0].reason, HasSubstr(reason));
    const auto together = table_.set_all(std::vector{wish("a.x", 5.0), asked, wish("on", true)});
    EXPECT_FALSE(together.successful);
    EXPECT_EQ(together.reason, results[0].reason);
    EXPECT_EQ(table_.get(names), before) << reason;
  }
  EXPECT_THAT(applied_, IsEmpty());
  EXPECT_EQ(rounds_, 0);
}

TEST_F(Table, EachOfSeveralIsSetByItselfAndSetAllTakesEffectOnce) {
  const auto results = table_.set(std::vector{wish("a.x", 5.0), wish("fixed", "x"), wish("mode", "fast")});
  ASSERT_EQ(results.size(), 3U);
  EXPECT_TRUE(results[0].successful);
  EXPECT_FALSE(results[1].successful);
  EXPECT_TRUE(results[2].successful);
  EXPECT_THAT(applied_, ElementsAre("a.x", "mode"));
  EXPECT_EQ(rounds_, 2);
  EXPECT_TRUE(table_.set_all(std::vector{wish("a.x", 6.0), wish("on", true), wish("a.x", 7.0)}).successful);
  EXPECT_EQ(rounds_, 3);
  EXPECT_EQ(table_.value("a.x"), ParameterValue(7.0)) << "the last of a name holds";
  EXPECT_EQ(table_.value("on"), ParameterValue(true));
  EXPECT_TRUE(table_.set(std::vector{wish("a.x", std::int64_t{4})})[0].successful) << "as `ros2 param set` sends it";
  EXPECT_EQ(table_.value("a.x"), ParameterValue(4.0));
}

TEST_F(Table, WhatWasSetIsReadAgainHoweverOften) {
  core::RandomStream stream(3, core::Purpose::kTest);
  double x = 1.0;
  for (int i = 0; i < 10'000; ++i) {
    const double wanted = 20.0 * stream.uniform() - 5.0;
    const bool fits = wanted >= 0.0 && wanted <= 10.0;
    ASSERT_EQ(table_.set(std::vector{wish("a.x", wanted)})[0].successful, fits) << wanted;
    if (fits) x = wanted;
    ASSERT_EQ(table_.get(std::vector<std::string>{"a.x"})[0], to_ros_value(x));
  }
}

TEST_F(Table, TooManyNamesGetAnEmptyReply) {
  const std::vector<std::string> names(kMostNamesAsked + 1, "a.x");
  EXPECT_THAT(table_.get(names), IsEmpty());
  EXPECT_THAT(table_.types(names), IsEmpty());
  EXPECT_THAT(table_.describe(names), IsEmpty());
  EXPECT_THAT(table_.list(names, 0).names, IsEmpty());
  const std::vector<RosParameter> wishes(kMostNamesAsked + 1, wish("a.x", 5.0));
  EXPECT_THAT(table_.set(wishes), IsEmpty());
  EXPECT_FALSE(table_.set_all(wishes).successful);
  EXPECT_EQ(table_.value("a.x"), ParameterValue(1.0));
}

class ParametersOnBus : public LiveServiceTest {
 protected:
  void begin(std::unique_ptr<RollingRecording> recording = nullptr, const std::string& scene = tests::kBoxScene) {
    start(std::move(recording), "", scene);
    ASSERT_TRUE(client_.wait_for_services());
  }
  bool sets(const std::string& name, const ParamValue& value) {
    const auto results = client_.set({{name, value}});
    return results && results->size() == 1 && results->at(0).successful;
  }
  std::string refusal(const std::string& name, const ParamValue& value) {
    const auto results = client_.set({{name, value}});
    if (!results || results->size() != 1) return "no reply";
    return results->at(0).successful ? "" : results->at(0).reason;
  }
  ParamValue value(const std::string& name) {
    const auto values = client_.get({name});
    return values && values->size() == 1 ? values->at(0) : ParamValue{.type = -1};
  }
  /// Sets one parameter or another to values in and out of its range, and reads it before and after, `count` times.
  void set_and_read(int count) {
    begin();
    ASSERT_TRUE(tracks_from(kNoon));
    core::RandomStream stream(5, core::Purpose::kTest);
    const std::vector<std::string> names = {"history", "max_wait", "marker_rate", "question_seconds", "domain", "none"};
    for (int i = 0; i < count; ++i) {
      const std::string& name = names[stream.uniform_below(names.size())];
      const double wanted = 2.0 * stream.uniform() - 0.5;
      const ParamValue before = value(name);
      const bool was_set = sets(name, ParamValue::of(wanted));
      ASSERT_EQ(value(name), was_set ? ParamValue::of(wanted) : before) << name << " " << wanted;
    }
    EXPECT_TRUE(tracks_from(kNoon + 100 * kSecond));
    EXPECT_EQ(robot_.diagnostics()["failures"], "0");
    EXPECT_TRUE(stop().ok());
  }
  ParameterClient client_{tests::own_domain(), "/prescene"};
};

TEST_F(ParametersOnBus, AreListedDescribedAndRead) {
  begin();
  const auto listed = client_.list();
  ASSERT_TRUE(listed.has_value());
  const std::vector<std::string>& names = listed->at(0);
  for (const char* name : {"history", "question_seconds", "depth_topic", "use_sim_time", "new_objects", "log_level"})
    EXPECT_THAT(names, Contains(name));
  const auto described = client_.describe(names);
  const auto values = client_.get(names);
  const auto types = client_.types(names);
  ASSERT_TRUE(described && values && types);
  ASSERT_EQ(described->size(), names.size());
  ASSERT_EQ(values->size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(described->at(i).name, names[i]);
    EXPECT_EQ(described->at(i).type, values->at(i).type) << names[i];
    EXPECT_EQ(types->at(i), values->at(i).type) << names[i];
    EXPECT_THAT(described->at(i).description, HasSubstr(".")) << names[i];
  }
  EXPECT_EQ(value("depth_topic"), ParamValue::of("/camera/aligned_depth_to_color/image_raw"));
  EXPECT_EQ(value("use_sim_time"), ParamValue::of(false));
  EXPECT_EQ(value("domain"), ParamValue::of(std::int64_t{tests::own_domain()}));
  EXPECT_EQ(value("history"), ParamValue::of(20.0));
  EXPECT_EQ(value("no_such"), ParamValue{});
  const auto history = client_.describe({"history"});
  ASSERT_TRUE(history.has_value());
  EXPECT_THAT(history->at(0).range, ElementsAre(std::array<double, 3>{0.0, 3600.0, 0.0}));
  EXPECT_FALSE(history->at(0).read_only);
  EXPECT_THAT(client_.list({"none"})->at(0), IsEmpty());
}

// packaging/launch/parameters.yaml: lines such as "    history: 20.0", or "    # new_objects: true".
TEST_F(ParametersOnBus, TheFileForRosNamesThoseThatCanBeSetWithTheValuesThatTheyHave) {
  begin();
  std::map<std::string, std::string> in_file;
  std::ifstream file(tests::source_dir() / "packaging/launch/parameters.yaml");
  bool is_below = false;
  for (std::string line; std::getline(file, line);) {
    if (is_below) {
      const std::size_t name = line.find_first_not_of(" #"), colon = line.find(": ");
      ASSERT_TRUE(line.starts_with("    ") && colon != std::string::npos) << line;
      const bool is_comment = line.find('#') < name;
      in_file[line.substr(name, colon - name)] = is_comment ? "" : line.substr(colon + 2);
    }
    is_below = is_below || line == "  ros__parameters:";
  }
  const auto names = client_.list();
  ASSERT_TRUE(names.has_value());
  const auto described = client_.describe(names->at(0));
  ASSERT_TRUE(described.has_value());
  std::size_t settable = 0;
  for (const tests::ParamDescription& parameter : *described) {
    if (parameter.read_only) {
      EXPECT_FALSE(in_file.contains(parameter.name)) << parameter.name;
      continue;
    }
    ++settable;
    ASSERT_TRUE(in_file.contains(parameter.name)) << parameter.name;
    const std::string& text = in_file[parameter.name];
    if (text.empty() || parameter.name == "diagnostics_rate") continue;  // the latter is faster in these tests
    if (parameter.type == 4) {
      EXPECT_EQ(text, value(parameter.name).text) << parameter.name;
    } else {
      // ROS takes a number with a point for a double, and one without for an integer.
      EXPECT_EQ(parameter.type, 3) << parameter.name;
      EXPECT_NE(text.find('.'), std::string::npos) << parameter.name;
      EXPECT_EQ(std::stod(text), value(parameter.name).number) << parameter.name;
    }
  }
  EXPECT_EQ(settable, in_file.size());
  EXPECT_TRUE(stop().ok());
}

TEST_F(ParametersOnBus, AreSetToldOfAndTakeEffect) {
  std::mutex mutex;
  std::vector<interfaces::RosParameterEvent> events;
  interfaces::DdsOptions options;
  options.domain = tests::own_domain();
  auto listener = interfaces::DdsNode::create(options, {});
  ASSERT_TRUE(listener.ok()) << listener.status().message();
  ASSERT_TRUE((*listener)
                  ->subscribe("/parameter_events", "rcl_interfaces/msg/ParameterEvent", interfaces::TopicQos::kCommands,
                              [&](interfaces::ReceivedMessage&& message) {
                                const auto event = interfaces::decode_cdr<interfaces::RosParameterEvent>(message.cdr);
                                const std::lock_guard lock(mutex);
                                if (event) events.push_back(*event);
                              })
                  .ok());
  begin();
  while ((*listener)->matched_writers("/parameter_events") == 0) robot_.wait(std::chrono::milliseconds(1));
  EXPECT_TRUE(sets("history", ParamValue::of(std::int64_t{30})));
  EXPECT_EQ(value("history"), ParamValue::of(30.0));
  EXPECT_THAT(refusal("history", ParamValue::of(-1.0)), HasSubstr("0 to 3600"));
  EXPECT_THAT(refusal("depth_topic", ParamValue::of("/other")), HasSubstr("restart the service"));
  EXPECT_EQ(value("history"), ParamValue::of(30.0));
  const auto both = client_.set_atomically({{"max_wait", ParamValue::of(0.02)}, {"log_level", ParamValue::of("loud")}});
  ASSERT_TRUE(both.has_value());
  EXPECT_FALSE(both->successful);
  EXPECT_EQ(value("max_wait"), ParamValue::of(0.05));
  EXPECT_TRUE(sets("history", ParamValue::of(0.0)));
  EXPECT_TRUE(robot_.send_until(
      [&] {
        const std::lock_guard lock(mutex);
        return events.size() >= 2;
      },
      kNoon));
  (*listener)->stop_receiving();
  EXPECT_EQ(events[0].node, "/prescene");
  ASSERT_EQ(events[0].changed_parameters.size(), 1U);
  EXPECT_EQ(events[0].changed_parameters[0], wish("history", 30.0));
  EXPECT_EQ(events[1].changed_parameters[0], wish("history", 0.0));
  ASSERT_TRUE(tracks_from(kNoon + 10 * kSecond));
  tests::ServiceClient ask(tests::own_domain(), "/prescene/ask", true);
  ASSERT_TRUE(ask.wait_for_service());
  const auto explained = ask.call(R"({"explain": {}})");
  ASSERT_TRUE(explained.has_value());
  EXPECT_THAT(explained->text, HasSubstr("no frames are kept")) << "history = 0";
}

// What is set comes between the frames of a recording: a replay sets it at the same place. The scene has no object but
// what is found, which is not looked for at first.
TEST_F(ParametersOnBus, AReplaySetsThemWhereTheyWereSet) {
  std::string empty_table = tests::kBoxScene + "new_objects: true\n";
  empty_table.erase(empty_table.find("models:"), empty_table.find("supports:") - empty_table.find("models:"));
  empty_table.erase(empty_table.find("objects:"), empty_table.find("camera:") - empty_table.find("objects:"));
  const tests::ScratchDir folder;
  const auto path = folder.path() / "run.mcap";
  auto recording = RollingRecording::create(path, {"scene.yaml", empty_table, 1, ""});
  ASSERT_TRUE(recording.ok()) << recording.status().message();
  begin(*std::move(recording), empty_table);
  EXPECT_EQ(value("new_objects"), ParamValue::of(true));
  ASSERT_TRUE(sets("new_objects", ParamValue::of(false)));
  ASSERT_TRUE(tracks_from(kNoon));
  EXPECT_THAT(belief_summary_from_json(robot_.beliefs().back())->objects, IsEmpty());
  ASSERT_TRUE(client_
                  .set_atomically({{"new_objects", ParamValue::of(true)},
                                   {"max_wait", ParamValue::of(0.04)},
                                   {"max_stamp_difference", ParamValue::of(0.01)}})
                  ->successful);
  EXPECT_TRUE(robot_.send_until(
      [&] {
        const std::vector<std::string> beliefs = robot_.beliefs();
        const auto summary = beliefs.empty() ? belief_summary_from_json("") : belief_summary_from_json(beliefs.back());
        return summary && !summary->objects.empty();
      },
      kNoon + 100 * kSecond));
  ASSERT_TRUE(stop().ok());
  const auto scene = load_scene_text(empty_table, "scene.yaml", {});
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const auto tracker = Tracker::create(*scene, {}, 1, backends_);
  ASSERT_TRUE(tracker.ok()) << tracker.status().message();
  const auto summary = replay_recording(path, {}, **tracker, {}, {}, {}, {});
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_GT(summary->compared, 3u);
  EXPECT_EQ(summary->different, 0u);
  EXPECT_EQ(summary->refused, 0u);
  EXPECT_FALSE((*tracker)->belief()->objects.empty());
  EXPECT_EQ((*tracker)->settings().assembler.max_wait_s, 0.04);
  EXPECT_EQ((*tracker)->settings().assembler.max_stamp_difference_s, 0.01);
}

TEST_F(ParametersOnBus, WhatWasSetIsReadAgain) { set_and_read(300); }
TEST_F(ParametersOnBus, TenThousandSetsLeaveTheServiceUp) { set_and_read(10'000); }

}  // namespace
}  // namespace prescene::service::node_parameters_test
