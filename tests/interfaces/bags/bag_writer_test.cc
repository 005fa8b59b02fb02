// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bags/bag_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "prescene/interfaces/bags/bag_reader.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/mcap/mcap_writer.h"
#include "prescene/interfaces/scene_files/located_value.h"
#include "tests/support/paths.h"

namespace prescene::interfaces::bag_writer_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kStart = 1'700'000'000'000'000'000;

/// A scalar that has to be there, as `node[key].as<...>()` of rosbag2 would throw.
std::string text_of(const LocatedValue* map, const std::string& key) {
  const LocatedValue* value = map != nullptr ? map->find(key) : nullptr;
  EXPECT_TRUE(value != nullptr && value->kind == LocatedValue::Kind::kScalar) << key;
  return value != nullptr ? value->text : "absent";
}
std::int64_t number_of(const LocatedValue* map, const std::string& key) {
  const std::string text = text_of(map, key);
  char* end = nullptr;
  const std::int64_t number = std::strtoll(text.c_str(), &end, 10);
  EXPECT_EQ(*end, '\0') << key << ": " << text;
  return number;
}
std::int64_t start_of(const LocatedValue& map) {
  return number_of(map.find("starting_time"), "nanoseconds_since_epoch");
}
std::int64_t duration_of(const LocatedValue& map) { return number_of(map.find("duration"), "nanoseconds"); }

/// The items of a list that has to be there.
std::vector<LocatedValue> items_of(const LocatedValue& map, const std::string& key) {
  const LocatedValue* value = map.find(key);
  EXPECT_TRUE(value != nullptr && value->kind == LocatedValue::Kind::kList) << key;
  return value != nullptr ? value->items : std::vector<LocatedValue>();
}

class BagWriter : public testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  /// Of messages "topic, time after kStart"; not closed with `is_cut`.
  void write(const std::string& name, const std::vector<std::pair<std::string, int>>& messages, bool is_cut = false) {
    const auto writer = McapWriter::create(path(name), {});
    ASSERT_TRUE(writer.ok()) << writer.status().message();
    for (const auto& [topic, time] : messages) {
      const std::string type = topic.starts_with("/tf") ? "tf2_msgs/msg/TFMessage" : "std_msgs/msg/String";
      const auto channel = (*writer)->add_channel(ros_channel(topic, type, topic == "/tf_static"));
      ASSERT_TRUE(channel.ok());
      ASSERT_TRUE((*writer)->write({*channel, 0, kStart + time, kStart + time, {0, 1, 0, 0}}).ok());
    }
    ASSERT_TRUE((is_cut ? (*writer)->flush() : (*writer)->close()).ok());
    if (is_cut) std::filesystem::copy_file(path(name), path("copy"));  // before it is closed all the same
  }
  /// What rosbag2 reads first.
  LocatedValue information() const {
    const auto document = read_yaml(path("metadata.yaml"));
    EXPECT_TRUE(document.ok()) << document.status().message();
    const LocatedValue* found = document ? document->find("rosbag2_bagfile_information") : nullptr;
    EXPECT_NE(found, nullptr);
    return found != nullptr ? *found : LocatedValue();
  }
  tests::ScratchDir folder_;
};

// The fields are those that version 5 of rosbag2's BagMetadata has: it throws where one is missing or of another type.
TEST_F(BagWriter, EveryFieldOfVersionFiveIsThere) {
  write("run_0.mcap", {{"/tf_static", 0}, {"/a", 10}, {"/a", 30}});
  write("run_0_0001.mcap", {{"/tf", 40}, {"/a", 35}});
  const core::Status written = write_bag_metadata(folder_.path(), {path("run_0.mcap"), path("run_0_0001.mcap")});
  ASSERT_TRUE(written.ok()) << written.message();

  const LocatedValue bag = information();
  EXPECT_EQ(number_of(&bag, "version"), 5);
  EXPECT_EQ(text_of(&bag, "storage_identifier"), "mcap");
  EXPECT_EQ(start_of(bag), kStart);
  EXPECT_EQ(duration_of(bag), 40);
  EXPECT_EQ(number_of(&bag, "message_count"), 5);
  EXPECT_EQ(text_of(&bag, "compression_format"), "");
  EXPECT_EQ(text_of(&bag, "compression_mode"), "");
  const auto paths = items_of(bag, "relative_file_paths");
  ASSERT_EQ(paths.size(), 2u);
  EXPECT_EQ(paths[0].text, "run_0.mcap");
  EXPECT_EQ(paths[1].text, "run_0_0001.mcap");

  const auto files = items_of(bag, "files");
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(text_of(&files[1], "path"), "run_0_0001.mcap");
  EXPECT_EQ(start_of(files[1]), kStart + 35);
  EXPECT_EQ(duration_of(files[1]), 5);
  EXPECT_EQ(number_of(&files[1], "message_count"), 2);

  std::vector<std::string> topics;
  for (const LocatedValue& topic : items_of(bag, "topics_with_message_count")) {
    const LocatedValue* about = topic.find("topic_metadata");
    ASSERT_NE(about, nullptr);
    const std::string name = text_of(about, "name");
    topics.push_back(name + " " + text_of(about, "type") + " " + std::to_string(number_of(&topic, "message_count")));
    EXPECT_EQ(text_of(about, "serialization_format"), "cdr");
    // A text in which a list of profiles stands in YAML, with numbers for words.
    const LocatedValue* profiles = about->find("offered_qos_profiles");
    ASSERT_TRUE(profiles != nullptr && profiles->quoted);
    const auto parsed = parse_yaml(profiles->text, "profiles");
    ASSERT_TRUE(parsed.ok()) << parsed.status().message();
    ASSERT_EQ(parsed->items.size(), 1u);
    const LocatedValue& profile = parsed->items[0];
    EXPECT_EQ(number_of(&profile, "history"), 1);
    EXPECT_EQ(number_of(&profile, "depth"), 10);
    EXPECT_EQ(number_of(&profile, "reliability"), 1);
    EXPECT_EQ(number_of(&profile, "durability"), name == "/tf_static" ? 1 : 2);
    EXPECT_EQ(number_of(&profile, "liveliness"), 1);
    EXPECT_EQ(text_of(&profile, "avoid_ros_namespace_conventions"), "false");
    for (const char* key : {"deadline", "lifespan", "liveliness_lease_duration"}) {
      EXPECT_EQ(number_of(profile.find(key), "sec"), 9'223'372'036);
      EXPECT_EQ(number_of(profile.find(key), "nsec"), 854'775'807);
    }
  }
  EXPECT_THAT(topics, ElementsAre("/a std_msgs/msg/String 3", "/tf tf2_msgs/msg/TFMessage 1",
                                  "/tf_static tf2_msgs/msg/TFMessage 1"));
}

TEST_F(BagWriter, OurReaderReadsTheBagWithAndWithoutItsMetadata) {
  write("run_0.mcap", {{"/a", 10}});
  write("run_0_0002.mcap", {{"/a", 30}});
  write("run_0_0001.mcap", {{"/a", 20}});
  const auto times = [&] {
    std::vector<std::int64_t> all;
    const auto reader = BagReader::open(folder_.path());
    EXPECT_TRUE(reader.ok()) << reader.status().message();
    for (; reader.ok();) {
      const auto message = (*reader)->next();
      EXPECT_TRUE(message.ok());
      if (!message || !*message) break;
      all.push_back((*message)->log_time_ns - kStart);
    }
    return all;
  };
  // As a recorder leaves it that was killed.
  EXPECT_THAT(times(), ElementsAre(10, 20, 30));
  ASSERT_TRUE(
      write_bag_metadata(folder_.path(), {path("run_0.mcap"), path("run_0_0001.mcap"), path("run_0_0002.mcap")}).ok());
  EXPECT_THAT(times(), ElementsAre(10, 20, 30));
  EXPECT_EQ((*BagReader::open(folder_.path()))->message_count(), 3u);
  EXPECT_EQ((*BagReader::open(folder_.path()))->loss_text(), "");
  // Files of two recordings in one folder are still told apart.
  std::filesystem::remove(path("metadata.yaml"));
  write("other_0.mcap", {{"/a", 10}});
  EXPECT_THAT(BagReader::open(folder_.path()).status().message(), HasSubstr("different recordings"));
}

TEST_F(BagWriter, AFileThatWasCutIsCountedByReadingIt) {
  write("run_0.mcap", {{"/a", 10}, {"/a", 25}}, /*is_cut=*/true);
  std::filesystem::rename(path("copy"), path("run_0.mcap"));
  ASSERT_TRUE(write_bag_metadata(folder_.path(), {path("run_0.mcap")}).ok());
  const LocatedValue bag = information();
  EXPECT_EQ(number_of(&bag, "message_count"), 2);
  EXPECT_EQ(start_of(bag), kStart + 10);
  EXPECT_EQ(duration_of(bag), 15);
}

TEST_F(BagWriter, ABagWithoutMessagesIsOne) {
  write("run_0.mcap", {});
  ASSERT_TRUE(write_bag_metadata(folder_.path(), {path("run_0.mcap")}).ok());
  const LocatedValue bag = information();
  EXPECT_EQ(number_of(&bag, "message_count"), 0);
  EXPECT_EQ(duration_of(bag), 0);
  EXPECT_TRUE(items_of(bag, "topics_with_message_count").empty());
  EXPECT_TRUE(BagReader::open(folder_.path()).ok());
}

}  // namespace
}  // namespace prescene::interfaces::bag_writer_test
