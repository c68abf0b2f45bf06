#pragma once

#include <string>
#include <vector>

#include <sqlite3.h>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// One column of an answer.
struct PlannedColumn {
  std::string name;
  std::string unit;  ///< SI; empty: a pure number, a text, or unknown

  bool operator==(const PlannedColumn&) const = default;
};

/// The statement that answers a query about a study.
struct Plan {
  std::string statement;  ///< a SELECT
  std::vector<PlannedColumn> columns;
};

/// Plans the answer to `question`. `database` must have kNumberFunction. Throws solver::InputError
/// for a wrong query, which names the flag or the column and what is allowed, and StorageError if
/// the database cannot be read.
Plan plan(sqlite3* database, protocol::StudyQuery question);

/// A hint to append to SQLite's message about `sql` if an unknown name is in double quotes, because
/// a text in single quotes may have been meant; else empty.
std::string quotes_hint(const std::string& message, std::string_view sql);

}  // namespace oblique::server
