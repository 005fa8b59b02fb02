// SPDX-License-Identifier: Apache-2.0
// Which messages of a damaged .db3 can still be found.
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace prescene::interfaces {

struct Db3StatementCloser {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Db3Statement = std::unique_ptr<sqlite3_stmt, Db3StatementCloser>;
/// Null where SQLite refuses it; sqlite3_errcode says why.
Db3Statement prepare_statement(sqlite3* database, const char* sql);

struct Db3Row {
  std::int64_t time_ns = -1;  ///< -1 where it is no integer.
  std::int64_t row = 0;
  bool operator==(const Db3Row&) const = default;
};

struct Db3Rows {
  std::vector<Db3Row> rows;  ///< In the order of time, of the row among equals.
  bool damaged = false;      ///< Some pages could not be read.
  /// Row numbers between readable rows that lie on such pages: at most so many messages are lost there. Those behind
  /// the last readable row are not counted.
  std::uint64_t missing = 0;
  bool too_many = false;  ///< There are more than are kept: those found first are here.
};

/// Walks through the table `messages` by its row numbers. Where a page can't be read, it looks numbers up behind it and
/// goes on at the first that can be read, so that little more than the rows of damaged pages is missing. What the index
/// of times names is added. At most four million rows (64 MB) are kept. `checks` is set to 0 before each step, for the
/// database's progress handler.
Db3Rows find_rows(sqlite3* database, int* checks);

}  // namespace prescene::interfaces
