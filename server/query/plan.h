#pragma once

#include <string>
#include <vector>

#include <sqlite3.h>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// One column of an answer.
struct PlannedColumn {
  std::string name;
  std::string unit;  ///< SI; empty: a pure number, a text, or not known

  bool operator==(const PlannedColumn&) const = default;
};

/// How a query of a study is answered.
struct Plan {
  std::string statement;  ///< a SELECT
  std::vector<PlannedColumn> columns;
};

/// Plans the answer to `question` from `database`, which has kNumberFunction. Throws
/// solver::InputError for a wrong question, naming the flag or the column and what is allowed;
/// StorageError where the database cannot be read.
Plan plan(sqlite3* database, protocol::StudyQuery question);

/// An addition to SQLite's message about `sql` if a name that does not exist stands in double
/// quotes, where a text may have been meant; else empty.
std::string quotes_hint(const std::string& message, std::string_view sql);

}  // namespace oblique::server
