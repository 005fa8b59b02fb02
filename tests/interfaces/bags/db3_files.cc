// SPDX-License-Identifier: Apache-2.0
#include "db3_files.h"

#include <sqlite3.h>

#include "prescene/core/check.h"

namespace prescene::tests {
namespace {

sqlite3* opened(const std::filesystem::path& path) {
  sqlite3* database = nullptr;
  PRESCENE_CHECK(sqlite3_open(path.string().c_str(), &database) == SQLITE_OK);
  return database;
}

void run(sqlite3* database, const std::string& sql) {
  char* reason = nullptr;
  PRESCENE_CHECK_MSG(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, &reason) == SQLITE_OK,
                     std::string(reason ? reason : "") + ": " + sql);
}

std::string tables(Db3Layout layout) {
  std::string topics =
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
      "serialization_format TEXT NOT NULL";
  if (layout != Db3Layout::kDashing) topics += ", offered_qos_profiles TEXT NOT NULL DEFAULT ''";
  if (layout == Db3Layout::kJazzy) topics += ", type_description_hash TEXT NOT NULL DEFAULT ''";
  std::string all = topics + ");";
  if (layout >= Db3Layout::kHumble)
    all +=
        "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
        "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);"
        "INSERT INTO schema VALUES(" +
        std::string(layout == Db3Layout::kJazzy ? "4, 'jazzy'" : "3, 'humble'") + ");";
  if (layout == Db3Layout::kJazzy)
    all +=
        "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL, "
        "encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);";
  return all +
         "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data "
         "BLOB NOT NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC);";
}

}  // namespace

void write_db3(const std::filesystem::path& path, const std::vector<Db3Topic>& topics,
               const std::vector<Db3Message>& messages, Db3Layout layout) {
  sqlite3* database = opened(path);
  run(database, "PRAGMA page_size = 512; PRAGMA journal_mode = MEMORY; PRAGMA synchronous = OFF; BEGIN;");
  run(database, tables(layout));
  sqlite3_stmt* insert = nullptr;
  const char* const add_topic = "INSERT INTO topics(name, type, serialization_format) VALUES(?1, ?2, ?3)";
  PRESCENE_CHECK(sqlite3_prepare_v2(database, add_topic, -1, &insert, nullptr) == SQLITE_OK);
  for (const Db3Topic& topic : topics) {
    sqlite3_bind_text(insert, 1, topic.name.c_str(), -1, SQLITE_STATIC);
    sqlite3_bind_text(insert, 2, topic.type.c_str(), -1, SQLITE_STATIC);
    sqlite3_bind_text(insert, 3, topic.format.c_str(), -1, SQLITE_STATIC);
    PRESCENE_CHECK(sqlite3_step(insert) == SQLITE_DONE);
    sqlite3_reset(insert);
  }
  sqlite3_finalize(insert);
  const char* const add_message = "INSERT INTO messages(topic_id, timestamp, data) VALUES(?1, ?2, ?3)";
  PRESCENE_CHECK(sqlite3_prepare_v2(database, add_message, -1, &insert, nullptr) == SQLITE_OK);
  for (const Db3Message& message : messages) {
    sqlite3_bind_int64(insert, 1, message.topic);
    sqlite3_bind_int64(insert, 2, message.time_ns);
    sqlite3_bind_blob(insert, 3, message.data.empty() ? "" : static_cast<const void*>(message.data.data()),
                      static_cast<int>(message.data.size()), SQLITE_STATIC);
    PRESCENE_CHECK(sqlite3_step(insert) == SQLITE_DONE);
    sqlite3_reset(insert);
  }
  sqlite3_finalize(insert);
  run(database, "COMMIT;");
  PRESCENE_CHECK(sqlite3_close(database) == SQLITE_OK);
}

void run_sql(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* database = opened(path);
  run(database, sql);
  PRESCENE_CHECK(sqlite3_close(database) == SQLITE_OK);
}

std::string bag_metadata(const std::string& storage, const std::vector<std::string>& files, std::size_t messages) {
  std::string text =
      "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: " + storage + "\n  relative_file_paths:\n";
  for (const std::string& file : files) text += "    - " + file + "\n";
  return text +
         "  duration:\n    nanoseconds: 1000\n  starting_time:\n    nanoseconds_since_epoch: 10\n"
         "  message_count: " +
         std::to_string(messages) +
         "\n  topics_with_message_count:\n    []\n  compression_format: \"\"\n  compression_mode: \"\"\n";
}

}  // namespace prescene::tests
