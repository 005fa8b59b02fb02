// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bags/bag_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "db3_files.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/mcap/mcap_writer.h"
#include "tests/support/paths.h"

namespace prescene::interfaces::bag_reader_test {
namespace {

using core::StatusCode;
using testing::ElementsAre;
using testing::HasSubstr;
using tests::Db3Layout;
using tests::Db3Message;
using tests::Db3Topic;

const std::vector<Db3Topic> kTopics = {{"/tf", "tf2_msgs/msg/TFMessage"}, {"/a", "std_msgs/msg/String"}};

/// "topic time first-byte" of each message.
std::vector<std::string> read_all(BagReader& reader) {
  std::vector<std::string> all;
  for (;;) {
    const auto message = reader.next();
    EXPECT_TRUE(message.ok()) << message.status().message();
    if (!message || !*message) return all;
    const McapMessage& m = **message;
    all.push_back(reader.channels()[static_cast<std::size_t>(m.channel)].topic + " " + std::to_string(m.log_time_ns) +
                  (m.data.empty() ? "" : " " + std::to_string(m.data.front())));
  }
}

class Bags : public testing::Test {
 protected:
  std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }
  core::Status failure_of(const std::filesystem::path& bag, const BagReaderOptions& options = {}) const {
    const auto reader = BagReader::open(bag, options);
    if (!reader) return reader.status();
    for (;;) {
      const auto message = (*reader)->next();
      if (!message) return message.status();
      if (!*message) return core::ok_status();
    }
  }
  tests::ScratchDir folder_;
};

TEST_F(Bags, EveryLayoutOfRosbag2IsReadInTheOrderOfTime) {
  for (const Db3Layout layout : {Db3Layout::kDashing, Db3Layout::kEloquent, Db3Layout::kHumble, Db3Layout::kJazzy}) {
    const auto file = path("bag" + std::to_string(static_cast<int>(layout)) + ".db3");
    const std::vector<std::uint8_t> large(5000, 9);  // over several pages
    tests::write_db3(file, kTopics, {{2, 30, {3}}, {1, 10, {1}}, {2, 20, large}, {1, 20, {}}}, layout);
    const auto reader = BagReader::open(file);
    ASSERT_TRUE(reader.ok()) << reader.status().message();
    EXPECT_EQ((*reader)->storage(), "sqlite3");
    EXPECT_EQ((*reader)->channels()[0].schema.name, "tf2_msgs/msg/TFMessage");
    EXPECT_THAT(read_all(**reader), ElementsAre("/tf 10 1", "/a 20 9", "/tf 20", "/a 30 3"));
    EXPECT_EQ((*reader)->loss_text(), "");
    EXPECT_THAT((*reader)->unchecked_text(), HasSubstr("no checksums"));
  }
}

TEST_F(Bags, AFolderIsReadFileByFile) {
  tests::write_db3(path("bag_0.db3"), kTopics, {{1, 10, {1}}});
  tests::write_db3(path("bag_1.db3"), {{"/new", "std_msgs/msg/String"}, {"/tf", "tf2_msgs/msg/TFMessage"}},
                   {{1, 20, {2}}, {2, 30, {3}}});
  // The folder's own name stands before the first, as early versions wrote it.
  ASSERT_TRUE(
      write_file(path("metadata.yaml"), tests::bag_metadata("sqlite3", {"bag/bag_0.db3", "bag_1.db3"}, 3)).ok());
  const auto reader = BagReader::open(folder_.path());
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ((*reader)->message_count(), 3u);
  EXPECT_THAT(read_all(**reader), ElementsAre("/tf 10 1", "/new 20 2", "/tf 30 3"));
}

TEST_F(Bags, AFolderThatWasNotClosedIsReadInTheOrderOfItsNumbers) {
  for (const int number : {0, 2, 10}) {
    const auto writer = McapWriter::create(path("run_" + std::to_string(number) + ".mcap"), {});
    ASSERT_TRUE(writer.ok());
    const auto channel = (*writer)->add_channel(ros_channel("/a", "std_msgs/msg/String"));
    ASSERT_TRUE((*writer)->write({*channel, 0, number, number, {7}}).ok());
    ASSERT_TRUE((*writer)->close().ok());
  }
  EXPECT_TRUE(is_bag(folder_.path()));
  const auto reader = BagReader::open(folder_.path());
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_THAT(read_all(**reader), ElementsAre("/a 0 7", "/a 2 7", "/a 10 7"));
  EXPECT_THAT((*reader)->loss_text(), HasSubstr("no metadata.yaml"));
  std::filesystem::copy(path("run_0.mcap"), path("other.mcap"));
  EXPECT_THAT(failure_of(folder_.path()).message(), HasSubstr("different recordings"));
}

/// As tools that know types of ROS by package and name alone write them.
TEST_F(Bags, ShortNamesOfTypesAreThoseOfRos2) {
  const std::vector<std::pair<std::string, std::string>> names = {
      {"sensor_msgs/Image", "sensor_msgs/msg/Image"}, {"a/msg/B", "a/msg/B"}, {"/B", "/B"}, {"a/", "a/"}, {"B", "B"}};
  const auto writer = McapWriter::create(path("run.mcap"), {});
  ASSERT_TRUE(writer.ok());
  for (const auto& [given, known] : names) {
    const auto channel = (*writer)->add_channel({"/a", "cdr", {given, "ros2msg", ""}, {}});
    ASSERT_TRUE((*writer)->write({*channel, 0, 1, 1, {7}}).ok());
  }
  const auto of_ros1 = (*writer)->add_channel({"/a", "ros1", {"sensor_msgs/Image", "ros1msg", ""}, {}});
  ASSERT_TRUE((*writer)->write({*of_ros1, 0, 1, 1, {7}}).ok());
  ASSERT_TRUE((*writer)->close().ok());
  const auto reader = BagReader::open(path("run.mcap"));
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ(read_all(**reader).size(), names.size() + 1);
  ASSERT_EQ((*reader)->channels().size(), names.size() + 1);
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ((*reader)->channels()[i].schema.name, names[i].second);
  EXPECT_EQ((*reader)->channels().back().schema.name, "sensor_msgs/Image");
}

TEST_F(Bags, AFolderOfImagesIsNone) {
  std::filesystem::create_directory(path("frames"));
  ASSERT_TRUE(write_file(path("run.mcap"), std::string_view("x")).ok());
  EXPECT_FALSE(is_bag(folder_.path()));
  EXPECT_TRUE(is_bag(path("run.mcap")));
  EXPECT_TRUE(is_bag(path("not there")));
}

TEST_F(Bags, MetadataNameNoFileOutsideOfTheFolder) {
  tests::write_db3(path("bag_0.db3"), kTopics, {});
  for (const char* name : {"../bag_0.db3", "/etc/passwd", "a/../../bag_0.db3"}) {
    ASSERT_TRUE(write_file(path("metadata.yaml"), tests::bag_metadata("sqlite3", {name}, 0)).ok());
    const core::Status failed = failure_of(folder_.path());
    EXPECT_EQ(failed.code(), StatusCode::kInvalidInput) << name;
    EXPECT_THAT(failed.message(), HasSubstr("metadata.yaml:5: ")) << name;
  }
  ASSERT_TRUE(write_file(path("metadata.yaml"), tests::bag_metadata("sqlite3", {"none.db3"}, 0)).ok());
  EXPECT_EQ(failure_of(folder_.path()).code(), StatusCode::kNotFound);
  std::string packed = tests::bag_metadata("sqlite3", {"bag_0.db3"}, 0);
  packed.replace(packed.find("compression_mode: \"\""), 20, "compression_mode: FILE");
  ASSERT_TRUE(write_file(path("metadata.yaml"), packed).ok());
  EXPECT_EQ(failure_of(folder_.path()).code(), StatusCode::kUnsupported);
  for (const char* text :
       {"", "a: 1\n", "rosbag2_bagfile_information: 3\n", "rosbag2_bagfile_information: {}\n", "{"}) {
    ASSERT_TRUE(write_file(path("metadata.yaml"), std::string_view(text)).ok());
    EXPECT_EQ(failure_of(folder_.path()).code(), StatusCode::kInvalidInput) << text;
  }
}

TEST_F(Bags, ForeignDatabasesAreRefused) {
  const auto refused = [this](const std::string& sql, const std::string& reason) {
    const auto file = path("foreign.db3");
    std::filesystem::remove(file);
    tests::run_sql(file, sql);
    const core::Status failed = failure_of(file);
    EXPECT_EQ(failed.code(), StatusCode::kInvalidInput) << failed.message();
    EXPECT_THAT(failed.message(), HasSubstr(reason));
  };
  const std::string topics = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, serialization_format);";
  refused("CREATE TABLE cats(name)", "has no table 'topics'");
  refused(topics, "has no table 'messages'");
  refused("CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type)", "has no column 'serialization_format'");
  refused(topics + "CREATE TABLE messages(topic_id, timestamp)", "has no column 'data'");
  // Tables that are made up while they are read could go on for ever.
  refused(topics +
              "CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT 1 AS "
              "topic_id, i AS timestamp, zeroblob(9) AS data FROM n;",
          "has no table 'messages'");
  refused(topics + "CREATE TABLE messages(topic_id, timestamp, data, id PRIMARY KEY) WITHOUT ROWID",
          "not as rosbag2 writes it");
  refused(topics + "INSERT INTO topics VALUES(1, '', 'a', 'cdr'); CREATE TABLE messages(topic_id, timestamp, data)",
          "no sensible name");
}

TEST_F(Bags, WhatCanNotBeASqliteFileIsSaid) {
  EXPECT_EQ(failure_of(path("none.db3")).code(), StatusCode::kNotFound);
  ASSERT_TRUE(write_file(path("a.db3"), std::string_view("")).ok());
  EXPECT_EQ(failure_of(path("a.db3")).code(), StatusCode::kDataLoss);
  ASSERT_TRUE(write_file(path("a.db3"), std::string(5000, 'x')).ok());
  EXPECT_EQ(failure_of(path("a.db3")).code(), StatusCode::kInvalidInput);
}

TEST_F(Bags, TopicsOfADb3ThatAreNotInCdrAreNamedWhereTheyHaveMessages) {
  const auto file = path("other.db3");
  tests::write_db3(file, {{"/a", "x/msg/Y", "json"}, {"/none", "x/msg/Y", "json"}, {"/b", "x/msg/Y", "ros1"}},
                   {{3, 10, {1}}, {1, 20, {1}}, {3, 30, {1}}});
  const auto reader = BagReader::open(file);
  ASSERT_TRUE(reader.ok());
  EXPECT_TRUE(read_all(**reader).empty());
  EXPECT_EQ((*reader)->loss_text(), "3 messages that are not in CDR were left out: '/a' ('json'), '/b' ('ros1')");
}

TEST_F(Bags, ATopicsNameIsNeverShownAsItIs) {
  const auto file = path("hostile.db3");
  tests::write_db3(file, {{"/a\x1b[2J", "x/msg/Y"}}, {{1, -5, {1}}});
  EXPECT_THAT(failure_of(file).message(), HasSubstr("a message on '/a\\x1b[2J' has the time -5 ns"));
}

TEST_F(Bags, OddMessagesAreRefusedOrCounted) {
  const auto file = path("odd.db3");
  tests::write_db3(file, {{"/a", "std_msgs/msg/String"}, {"/json", "x/msg/Y", "json"}},
                   {{1, 10, {1}}, {2, 20, {2}}, {77, 30, {3}}, {1, 40, {4}}});
  const auto reader = BagReader::open(file);
  ASSERT_TRUE(reader.ok());
  EXPECT_THAT(read_all(**reader), ElementsAre("/a 10 1", "/a 40 4"));
  EXPECT_THAT((*reader)->loss_text(), HasSubstr("1 messages of unknown topics"));
  EXPECT_THAT((*reader)->loss_text(), HasSubstr("1 messages that are not in CDR were left out: '/json' ('json')"));
  tests::run_sql(file, "INSERT INTO messages(topic_id, timestamp, data) VALUES(1, -5, 'text'), (1, 'noon', 'text')");
  EXPECT_EQ(failure_of(file).code(), StatusCode::kDataLoss);
  const auto salvaging = BagReader::open(file, {.salvage = true});
  ASSERT_TRUE(salvaging.ok());
  EXPECT_THAT(read_all(**salvaging), ElementsAre("/a 10 1", "/a 40 4"));
  EXPECT_THAT((*salvaging)->loss_text(), HasSubstr("2 damaged messages"));
}

/// Each leaf of the table of messages in turn is made unreadable by one byte, with an index of times and without one.
TEST_F(Bags, OneDamagedPageCostsOnlyItsMessages) {
  for (const bool has_index : {true, false}) {
    const auto file = path(has_index ? "indexed.db3" : "plain.db3");
    std::vector<Db3Message> messages;
    for (int i = 0; i < 300; ++i) messages.push_back({1, 1000 + (7 * i) % 300, {static_cast<std::uint8_t>(i % 250)}});
    tests::write_db3(file, kTopics, messages);
    if (!has_index) tests::run_sql(file, "DROP INDEX timestamp_idx");
    const auto whole = *read_file(file, 1 << 20);
    int pages = 0;
    for (std::size_t page = 512; page < whole.size(); page += 512) {
      if (whole[page] != 0x0d) continue;  // no leaf of a table
      auto bytes = whole;
      bytes[page] = 0;
      ASSERT_TRUE(write_file(file, bytes).ok());
      if (!BagReader::open(file).ok() || failure_of(file).ok()) continue;  // of another table
      ++pages;
      const auto reader = BagReader::open(file, {.salvage = true});
      ASSERT_TRUE(reader.ok()) << reader.status().message();
      std::size_t count = 0;
      std::int64_t before = 0;
      for (;; ++count) {
        const auto message = (*reader)->next();
        ASSERT_TRUE(message.ok()) << message.status().message();
        if (!*message) break;
        EXPECT_GT((*message)->log_time_ns, before);
        before = (*message)->log_time_ns;
      }
      EXPECT_GE(count, messages.size() - 60) << "page " << page / 512;
      EXPECT_LT(count, messages.size());
      EXPECT_THAT((*reader)->loss_text(), HasSubstr("the file is cut or damaged"));
    }
    EXPECT_GE(pages, 5);
  }
}

TEST_F(Bags, PathsMayHoldTheSignsOfAUri) {
  const auto file = path("a?b#c%41 d.db3");
  tests::write_db3(file, kTopics, {{1, 10, {1}}});
  const auto reader = BagReader::open(file);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ(read_all(**reader).size(), 1u);
}

TEST_F(Bags, AnAttachmentComesBackFromAnMcapFile) {
  const auto file = path("run.mcap");
  const McapAttachment mesh{"meshes/cup.ply", "model/ply", std::vector<std::uint8_t>(100'000, 5), 7, 8};
  {
    const auto writer = McapWriter::create(file, {});
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE((*writer)->write_attachment(mesh).ok());
    const auto channel = (*writer)->add_channel(ros_channel("/a", "std_msgs/msg/String"));
    ASSERT_TRUE((*writer)->write({*channel, 0, 1, 1, {7}}).ok());
    ASSERT_TRUE((*writer)->write_attachment({"empty", "", {}}).ok());
    ASSERT_TRUE((*writer)->close().ok());
  }
  const auto reader = BagReader::open(file);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  ASSERT_EQ((*reader)->attachments().size(), 2u);
  EXPECT_EQ((*reader)->attachments()[0].bytes, mesh.data.size());
  const auto read = (*reader)->attachment("meshes/cup.ply");
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(*read, mesh);
  EXPECT_EQ((*reader)->attachment("empty")->data.size(), 0u);
  EXPECT_EQ((*reader)->attachment("none").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(read_all(**reader).size(), 1u);

  // One wrong byte in its data.
  const auto whole = *read_file(file, 1 << 20);
  auto bytes = whole;
  const std::vector<std::uint8_t> inside(50, 5);
  *(std::search(bytes.begin(), bytes.end(), inside.begin(), inside.end()) + 20) = 6;
  ASSERT_TRUE(write_file(file, bytes).ok());
  EXPECT_EQ(BagReader::open(file).status().code(), StatusCode::kDataLoss) << "the data section has a checksum, too";
  const auto unchecked = BagReader::open(file, {.salvage = true});
  ASSERT_TRUE(unchecked.ok());
  EXPECT_EQ((*unchecked)->attachment("meshes/cup.ply").status().code(), StatusCode::kDataLoss);
  EXPECT_EQ(read_all(**unchecked).size(), 1u);
  // Cut behind it, as by a crash.
  bytes.assign(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(mesh.data.size() + 300));
  ASSERT_TRUE(write_file(file, bytes).ok());
  const auto cut = BagReader::open(file);
  ASSERT_TRUE(cut.ok()) << cut.status().message();
  EXPECT_EQ((*cut)->attachment("meshes/cup.ply")->data, mesh.data);
}

}  // namespace
}  // namespace prescene::interfaces::bag_reader_test
