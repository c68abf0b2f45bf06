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

/// How a question is answered.
struct Plan {
  std::string statement;               ///< one that only reads
  std::vector<PlannedColumn> columns;  ///< of the answer
  /// Rows come in the order of their points, and `statement` gives one column more than `columns`,
  /// the last: the point. Whoever has read up to point N may go on later with the question whose
  /// `after_point` is N and whose `limit`, if any, is so much less.
  bool goes_on_by_point = false;
};

/// Plans the answer to `question` from `database`, which has kNumberFunction and the functions of
/// lists. Throws solver::InputError for a wrong question, naming the flag or the column and what is
/// allowed; StorageError for what cannot be read.
Plan plan(sqlite3* database, protocol::StudyQuery question);

}  // namespace oblique::server
