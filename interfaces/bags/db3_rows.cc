// SPDX-License-Identifier: Apache-2.0
#include "db3_rows.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <tuple>

namespace prescene::interfaces {
namespace {

constexpr std::size_t kMostRows = 4'000'000;
// Row numbers are looked up behind damage in steps of at most so many, so often; then the steps grow. A page holds some
// hundred short messages.
constexpr std::int64_t kSmallStep = 16;
constexpr int kSmallSteps = 200;
constexpr int kMostFailures = 20'000;
constexpr std::int64_t kMostLost = 1'000'000;  // between two rows
constexpr int kMostFalse = 8;                  // damaged row numbers in a row
constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();

class RowFinder {
 public:
  RowFinder(sqlite3* database, int* checks) : database_(database), checks_(checks) {}

  Db3Rows find() {
    from_ = prepare_statement(database_, "SELECT rowid, timestamp FROM messages WHERE rowid >= ?1 ORDER BY rowid");
    out_.damaged = !from_;
    std::optional<std::int64_t> next = std::numeric_limits<std::int64_t>::min();
    while (next && from_) {
      next = walk(*next);
      if (next) next = behind_damage(std::max<std::int64_t>(*next, 0));
    }
    add_indexed();
    std::sort(out_.rows.begin(), out_.rows.end(),
              [](const Db3Row& a, const Db3Row& b) { return std::tie(a.time_ns, a.row) < std::tie(b.time_ns, b.row); });
    return std::move(out_);
  }

 private:
  int first_step(std::int64_t low) {
    sqlite3_reset(from_.get());
    sqlite3_bind_int64(from_.get(), 1, low);
    *checks_ = 0;
    return sqlite3_step(from_.get());
  }

  /// From the row number on; the first number that can't be found, or nothing at the end.
  std::optional<std::int64_t> walk(std::int64_t low) {
    for (int code = first_step(low); code != SQLITE_DONE; code = sqlite3_step(from_.get())) {
      if (code != SQLITE_ROW) return before_false_end(low);
      const std::int64_t row = sqlite3_column_int64(from_.get(), 0);
      // Some last numbers were wrong, or a page is in the place of another.
      if (row < low && (++failures_ > kMostFailures || !drop_from(row))) return low;
      if (!keep(from_.get()) || row == kLast) return std::nullopt;
      low = row + 1;
      *checks_ = 0;
    }
    return std::nullopt;
  }

  /// Takes away the last rows with this number or a higher one; false where these are too many to be a few damaged
  /// ones.
  bool drop_from(std::int64_t row) {
    const auto first = std::lower_bound(out_.rows.begin(), out_.rows.end(), Db3Row{0, row},
                                        [](const Db3Row& a, const Db3Row& b) { return a.row < b.row; });
    if (out_.rows.end() - first > kMostFalse) return false;
    out_.damaged = true;
    out_.rows.erase(first, out_.rows.end());
    return true;
  }

  /// The number behind the rows so far, without last ones that leave others out and that nothing follows: damaged
  /// numbers that are too large.
  std::int64_t before_false_end(std::int64_t low) {
    for (int dropped = 0; dropped < kMostFalse && out_.rows.size() > 1; ++dropped) {
      const std::int64_t before = out_.rows[out_.rows.size() - 2].row;
      if (out_.rows.back().row == before + 1 || first_step(low) != SQLITE_DONE) break;
      out_.rows.pop_back();
      low = before + 1;
    }
    return low;
  }

  bool can_read_at(std::int64_t row) {
    const int code = first_step(row);
    if (code == SQLITE_DONE) return true;
    return code == SQLITE_ROW && sqlite3_column_int64(from_.get(), 0) >= row;
  }

  /// The first number behind `bad` that can be looked up: by steps that grow, and then by halves.
  std::optional<std::int64_t> behind_damage(std::int64_t bad) {
    out_.damaged = true;
    const std::int64_t first_bad = bad;
    std::int64_t step = 1;
    for (int probes = 0;; ++probes) {
      if (bad > kLast - step || ++failures_ > kMostFailures) return std::nullopt;  // not counted: nobody knows them
      if (can_read_at(bad + step)) break;
      bad += step;
      if (step < kSmallStep || probes > kSmallSteps) step = step > kLast / 2 ? kLast : 2 * step;
    }
    std::int64_t good = bad + step;
    while (good - bad > 1) {
      const std::int64_t middle = bad + (good - bad) / 2;
      (can_read_at(middle) ? good : bad) = middle;
    }
    // At the end of the table every further number can be looked up; a number far off is a damaged one.
    if (first_step(good) == SQLITE_ROW) {
      const std::int64_t lost = sqlite3_column_int64(from_.get(), 0) - first_bad;
      if (lost > 0 && lost < kMostLost) out_.missing += static_cast<std::uint64_t>(lost);
    }
    return good;
  }

  /// Of the row at which the statement is; negative = it has none.
  static std::int64_t time_of(sqlite3_stmt* statement) {
    return sqlite3_column_type(statement, 1) == SQLITE_INTEGER ? sqlite3_column_int64(statement, 1) : -1;
  }

  bool keep(sqlite3_stmt* statement) {
    out_.too_many = out_.rows.size() >= kMostRows;
    if (out_.too_many) return false;
    out_.rows.push_back({time_of(statement), sqlite3_column_int64(statement, 0)});
    return true;
  }

  /// The rows so far are in the order of their numbers, and none is there twice.
  void add_indexed() {
    const Db3Statement order =
        prepare_statement(database_, "SELECT rowid, timestamp FROM messages ORDER BY timestamp, rowid");
    const std::size_t walked = out_.rows.size();
    const auto number_less = [](const Db3Row& a, const Db3Row& b) { return a.row < b.row; };
    // Pages of a damaged index may stand in it again and again.
    for (std::size_t seen = 0; order && !out_.too_many && seen < 2 * kMostRows; ++seen) {
      *checks_ = 0;
      if (sqlite3_step(order.get()) != SQLITE_ROW) break;
      const Db3Row row{0, sqlite3_column_int64(order.get(), 0)};
      const auto end = out_.rows.begin() + static_cast<std::ptrdiff_t>(walked);
      const auto known = std::lower_bound(out_.rows.begin(), end, row, number_less);
      if (known == end || known->row != row.row) {
        keep(order.get());
      } else if (known->time_ns < 0) {
        known->time_ns = time_of(order.get());  // that of the row is damaged
      }
    }
    const auto middle = out_.rows.begin() + static_cast<std::ptrdiff_t>(walked);
    std::stable_sort(middle, out_.rows.end(), number_less);
    out_.rows.erase(
        std::unique(middle, out_.rows.end(), [](const Db3Row& a, const Db3Row& b) { return a.row == b.row; }),
        out_.rows.end());
  }

  sqlite3* database_;
  int* checks_;
  Db3Statement from_;  ///< Rows from a number on.
  Db3Rows out_;
  int failures_ = 0;
};

}  // namespace

Db3Statement prepare_statement(sqlite3* database, const char* sql) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, sql, -1, &statement, nullptr);
  return Db3Statement(statement);
}

Db3Rows find_rows(sqlite3* database, int* checks) { return RowFinder(database, checks).find(); }

}  // namespace prescene::interfaces
