// SPDX-License-Identifier: Apache-2.0
#include "db3_reader.h"

#include <sqlite3.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include "db3_rows.h"
#include "prescene/interfaces/bags/other_encodings.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

constexpr int kMostMessageBytes = 256 << 20;
constexpr std::size_t kMostTopics = 65'535;   // as many as MCAP has channels
constexpr std::size_t kMostNameBytes = 4096;  // of a topic or type; ROS allows 255
constexpr int kCacheKib = 8 << 10;
constexpr std::uint64_t kMostCounted = 1'000'000;  // lost messages; more come of damaged row numbers
// SQLite asks after so many instructions of its machine whether to go on. Reading a message takes some hundred; what
// takes a billion before the next row (minutes) is no bag.
constexpr int kInstructionsBetweenChecks = 1'000'000;
constexpr int kMostChecks = 1000;

struct Closer {
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
using Database = std::unique_ptr<sqlite3, Closer>;

constexpr const char* kDb3Remedy =
    "; copy it again, read what is sound by `replay --salvage`, or mend it with `sqlite3 FILE .recover`";

/// As a URI of SQLite.
std::string uri_of(const std::filesystem::path& path, bool has_log) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '%' || c == '?' || c == '#' || byte < 0x20) {
      uri += '%';
      uri += kDigits[byte / 16];
      uri += kDigits[byte % 16];
    } else {
      uri += c;
    }
  }
  // A recorder that did not end well leaves its log of writes; without one nothing has to be written or locked.
  return uri + (has_log ? "?mode=ro" : "?mode=ro&immutable=1");
}

bool is_nonempty_file(const std::filesystem::path& path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  return !error && bytes > 0;
}

std::string text_of(sqlite3_stmt* row, int column) {
  const unsigned char* text = sqlite3_column_text(row, column);
  if (text == nullptr) return {};
  const auto bytes = static_cast<std::size_t>(std::max(0, sqlite3_column_bytes(row, column)));
  return {reinterpret_cast<const char*>(text), std::min(bytes, kMostNameBytes + 1)};
}

}  // namespace

struct Db3Reader::Impl {
  std::filesystem::path path;
  bool salvage = false;
  int checks = 0;  // of the work for the present row

  Database database;
  Db3Statement order;  ///< Rows of the messages in the order of time; only their keys are sorted. Not to salvage.
  Db3Rows found;       ///< To salvage: the same, of what can be read.
  std::size_t next_found = 0;
  Db3Statement message;  ///< One of them.
  std::vector<McapChannel> channels;
  std::map<std::int64_t, int> channel_of_topic;
  std::map<std::int64_t, std::pair<std::string, std::string>> left_out_topics;  // their names and encodings
  OtherEncodings other_encodings;
  std::uint64_t damaged = 0, stray = 0;
  bool ended = false;

  Status open_database();
  Status check_table(const char* name, std::initializer_list<const char*> columns);
  Status read_topics();
  Result<Db3Statement> prepare(const char* sql);
  /// True: there is a row; false: the end.
  Result<bool> step(sqlite3_stmt* statement);
  Status failure(const std::string& what) const;
  /// The next in the order of time; nothing at the end.
  Result<std::optional<Db3Row>> next_row();
  Result<bool> read_message(const Db3Row& at, McapMessage* out);

  static int is_too_much(void* impl) { return ++static_cast<Impl*>(impl)->checks > kMostChecks ? 1 : 0; }
};

Status Db3Reader::Impl::failure(const std::string& what) const {
  const int code = sqlite3_errcode(database.get());
  const std::string place = path.string() + ": " + what;
  const std::string reason = std::string(" (") + sqlite3_errmsg(database.get()) + ")";
  switch (code & 0xff) {
    case SQLITE_NOTADB:
      return core::invalid_input(path.string() + ": not an SQLite file" + reason + "; give a bag of rosbag2");
    case SQLITE_TOOBIG:
      return core::resource_exhausted(place + " has more than " + size_text(kMostMessageBytes) + reason +
                                      "; up to that are read");
    case SQLITE_INTERRUPT:
      return core::resource_exhausted(place + " takes more work than any bag needs" + reason + kDb3Remedy);
    case SQLITE_NOMEM:
      return core::resource_exhausted(place + ": out of memory");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return core::unavailable(place + " is in use" + reason + "; stop the recorder first");
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
      return core::unavailable(place + " can't be opened" + reason +
                               "; its recorder did not end well: copy it with its -wal or -journal file to a folder "
                               "that can be written");
    case SQLITE_ERROR:
      return core::invalid_input(place + " is not as rosbag2 writes it" + reason + "; give a bag of rosbag2");
    default:
      return core::data_loss(place + " is cut or damaged" + reason + kDb3Remedy);
  }
}

Status Db3Reader::Impl::open_database() {
  PRESCENE_TRY(const InputFile file, InputFile::open(path));  // for its errors
  if (file.size() == 0) return core::data_loss(path.string() + ": is empty; copy it again, or record again");
  const bool has_log = is_nonempty_file(path.string() + "-wal") || is_nonempty_file(path.string() + "-journal");
  sqlite3* opened = nullptr;
  const int code = sqlite3_open_v2(uri_of(path, has_log).c_str(), &opened,
                                   SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  database.reset(opened);
  if (!database) return core::resource_exhausted(path.string() + ": out of memory");
  if (code != SQLITE_OK) return failure("the file");
  sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, kMostMessageBytes);
  sqlite3_limit(opened, SQLITE_LIMIT_COLUMN, 100);
  sqlite3_limit(opened, SQLITE_LIMIT_ATTACHED, 0);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_progress_handler(opened, kInstructionsBetweenChecks, &Impl::is_too_much, this);
  static const std::string kCache = "PRAGMA cache_size = -" + std::to_string(kCacheKib);
  for (const char* setting :
       {"PRAGMA cell_size_check = ON", "PRAGMA mmap_size = 0", "PRAGMA temp_store = FILE", kCache.c_str()}) {
    if (sqlite3_exec(opened, setting, nullptr, nullptr, nullptr) != SQLITE_OK) return failure("the file");
  }
  return core::ok_status();
}

Result<Db3Statement> Db3Reader::Impl::prepare(const char* sql) {
  checks = 0;
  Db3Statement statement = prepare_statement(database.get(), sql);
  if (!statement) return failure("its schema");
  return statement;
}

Result<bool> Db3Reader::Impl::step(sqlite3_stmt* statement) {
  checks = 0;
  const int code = sqlite3_step(statement);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return failure("its content");
}

/// A table, not a view or a virtual table, with these columns.
Status Db3Reader::Impl::check_table(const char* name, std::initializer_list<const char*> columns) {
  PRESCENE_TRY(const Db3Statement kind, prepare("SELECT sql FROM sqlite_schema WHERE type = 'table' AND name = ?1"));
  sqlite3_bind_text(kind.get(), 1, name, -1, SQLITE_STATIC);
  PRESCENE_TRY(const bool is_table, step(kind.get()));
  std::string sql = is_table ? text_of(kind.get(), 0) : "";
  std::transform(sql.begin(), sql.end(), sql.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  if (!is_table || !sql.starts_with("CREATE TABLE")) {
    return core::invalid_input(path.string() + ": has no table '" + name +
                               "', which every bag of rosbag2 has; give the .db3 of a bag");
  }
  std::set<std::string> there;
  PRESCENE_TRY(const Db3Statement info, prepare("SELECT name FROM pragma_table_xinfo(?1) WHERE hidden = 0"));
  sqlite3_bind_text(info.get(), 1, name, -1, SQLITE_STATIC);
  for (;;) {
    PRESCENE_TRY(const bool more, step(info.get()));
    if (!more) break;
    there.insert(text_of(info.get(), 0));
  }
  for (const char* column : columns) {
    if (there.contains(column)) continue;
    return core::invalid_input(path.string() + ": its table '" + name + "' has no column '" + column +
                               "', which every bag of rosbag2 has; give the .db3 of a bag");
  }
  return core::ok_status();
}

Status Db3Reader::Impl::read_topics() {
  PRESCENE_TRY(const Db3Statement rows, prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id"));
  for (;;) {
    PRESCENE_TRY(const bool more, step(rows.get()));
    if (!more) return core::ok_status();
    const std::int64_t id = sqlite3_column_int64(rows.get(), 0);
    const std::string name = text_of(rows.get(), 1), type = text_of(rows.get(), 2), format = text_of(rows.get(), 3);
    if (channels.size() + left_out_topics.size() >= kMostTopics)
      return core::resource_exhausted(path.string() + ": has more than " + std::to_string(kMostTopics) + " topics");
    if (name.empty() || type.empty() || std::max(name.size(), type.size()) > kMostNameBytes) {
      return core::invalid_input(path.string() + ": the topic of number " + std::to_string(id) +
                                 " has no sensible name or type: " + quote(name) + " of " + quote(type) +
                                 "; record again");
    }
    if (channel_of_topic.contains(id) || left_out_topics.contains(id))
      return core::data_loss(path.string() + ": two topics have the number " + std::to_string(id) + kDb3Remedy);
    if (format != "cdr") {
      left_out_topics.emplace(id, std::pair(name, format));
      continue;
    }
    channel_of_topic.emplace(id, static_cast<int>(channels.size()));
    channels.push_back({name, "cdr", {type, "", ""}, {}});
  }
}

Result<std::optional<Db3Row>> Db3Reader::Impl::next_row() {
  if (salvage) {
    if (next_found == found.rows.size()) return std::optional<Db3Row>();
    return std::optional<Db3Row>(found.rows[next_found++]);
  }
  PRESCENE_TRY(const bool more, step(order.get()));
  if (!more) return std::optional<Db3Row>();
  const bool has_time = sqlite3_column_type(order.get(), 1) == SQLITE_INTEGER;
  return std::optional<Db3Row>(
      {has_time ? sqlite3_column_int64(order.get(), 1) : -1, sqlite3_column_int64(order.get(), 0)});
}

/// False where it is left out.
Result<bool> Db3Reader::Impl::read_message(const Db3Row& at, McapMessage* out) {
  sqlite3_reset(message.get());
  sqlite3_bind_int64(message.get(), 1, at.row);
  PRESCENE_TRY(const bool is_there, step(message.get()));
  if (!is_there) return core::data_loss(path.string() + ": its index is damaged" + kDb3Remedy);
  if (sqlite3_column_type(message.get(), 0) != SQLITE_INTEGER) {
    ++stray;
    return false;
  }
  const std::int64_t topic = sqlite3_column_int64(message.get(), 0);
  if (const auto left_out = left_out_topics.find(topic); left_out != left_out_topics.end()) {
    other_encodings.note(left_out->second.first, left_out->second.second);
    return false;
  }
  const auto channel = channel_of_topic.find(topic);
  if (channel == channel_of_topic.end()) {
    ++stray;
    return false;
  }
  if (at.time_ns < 0) {
    return core::data_loss(path.string() + ": a message on " +
                           quote(channels[static_cast<std::size_t>(channel->second)].topic) + " has the time " +
                           std::to_string(at.time_ns) + " ns; times begin with 1970" + kDb3Remedy);
  }
  const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(message.get(), 1));
  const int bytes = sqlite3_column_bytes(message.get(), 1);
  // Null for an empty blob, and where there was no memory for it.
  if (data == nullptr && sqlite3_errcode(database.get()) == SQLITE_NOMEM) return failure("a message");
  *out = {channel->second, 0, at.time_ns, at.time_ns, {}};
  if (data != nullptr && bytes > 0) out->data.assign(data, data + bytes);
  return true;
}

Db3Reader::Db3Reader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Db3Reader::~Db3Reader() = default;

Result<std::unique_ptr<Db3Reader>> Db3Reader::open(const std::filesystem::path& path, bool salvage) {
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  impl->salvage = salvage;
  PRESCENE_RETURN_IF_ERROR(impl->open_database());
  PRESCENE_RETURN_IF_ERROR(impl->check_table("topics", {"id", "name", "type", "serialization_format"}));
  PRESCENE_RETURN_IF_ERROR(impl->check_table("messages", {"topic_id", "timestamp", "data"}));
  PRESCENE_RETURN_IF_ERROR(impl->read_topics());
  // Sorting reads the whole table before the first row, and one damaged page would hide all.
  if (salvage) {
    impl->found = find_rows(impl->database.get(), &impl->checks);
  } else {
    PRESCENE_TRY(impl->order, impl->prepare("SELECT rowid, timestamp FROM messages ORDER BY timestamp, rowid"));
  }
  PRESCENE_TRY(impl->message, impl->prepare("SELECT topic_id, data FROM messages WHERE rowid = ?1"));
  return std::unique_ptr<Db3Reader>(new Db3Reader(std::move(impl)));
}

const std::vector<McapChannel>& Db3Reader::channels() const { return impl_->channels; }

Result<std::optional<McapMessage>> Db3Reader::next() {
  Impl& impl = *impl_;
  while (!impl.ended) {
    PRESCENE_TRY(const std::optional<Db3Row> row, impl.next_row());
    impl.ended = !row;
    if (!row) break;
    McapMessage message;
    const Result<bool> read = impl.read_message(*row, &message);
    if (!read && !impl.salvage) return read.status();
    if (!read) ++impl.damaged;
    if (read && *read) return std::optional<McapMessage>(std::move(message));
  }
  return std::optional<McapMessage>();
}

std::string Db3Reader::loss_text() const {
  const Impl& impl = *impl_;
  std::string out;
  const auto say = [&](const std::string& sentence) { out += (out.empty() ? "" : "; ") + sentence; };
  if (impl.found.damaged) {
    const bool is_known = impl.found.missing < kMostCounted;
    say("the file is cut or damaged: pages that can't be read were passed over, with " +
        (is_known ? "up to " + std::to_string(impl.found.missing) + " messages before the last that was found"
                  : std::string("nobody knows how many messages")));
  }
  if (impl.found.too_many) say("only the first " + std::to_string(impl.found.rows.size()) + " messages were looked at");
  if (impl.damaged > 0) say(std::to_string(impl.damaged) + " damaged messages were left out");
  if (impl.stray > 0) say(std::to_string(impl.stray) + " messages of unknown topics were left out");
  if (const std::string others = impl.other_encodings.text(); !others.empty()) say(others);
  return out;
}

}  // namespace prescene::interfaces
