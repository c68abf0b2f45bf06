#pragma once

#include <string>
#include <vector>

#include <sqlite3.h>

#include "proto/oblique.pb.h"
#include "server/query/query_rules.h"

namespace oblique::server {

/// One column of an answer.
struct PlannedColumn {
  std::string name;
  std::string unit;  ///< SI; empty: a pure number, a text, or unknown

  bool operator==(const PlannedColumn&) const = default;
};

/// The statement that answers a query about a study.
struct Plan {
  std::string sql;            ///< a SELECT
  StatementHandle statement;  ///< the same, prepared
  std::vector<PlannedColumn> columns;
};

/// Plans the answer to `question`. `database` must have passed restrict_to_reading. Throws
/// solver::InputError for a wrong query, which names the flag or the column and what is allowed;
/// StorageError or QueryError if the database cannot be read.
Plan plan(sqlite3* database, const protocol::StudyQuery& question);

/// The error for a study that does not exist, with the nearest name.
std::string no_such_study(sqlite3* database, const std::string& name);

}  // namespace oblique::server
