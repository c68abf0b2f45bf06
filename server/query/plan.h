#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <sqlite3.h>

#include "proto/oblique.pb.h"
#include "server/query/reader.h"

namespace oblique::server {

/// One column of an answer.
struct PlannedColumn {
  std::string name;
  std::string unit;  ///< SI unit; empty for a number without unit, a text, or an unknown unit
};

/// The statement for a query of a study.
struct Plan {
  std::string sql;            ///< a SELECT
  StatementHandle statement;  ///< the same, prepared
  std::vector<PlannedColumn> columns;
};

/// Turns `question` into a statement. `database` must have passed restrict_to_reading. Throws
/// solver::InputError for a wrong query; the message names the flag or column and what is allowed.
/// Throws NoSuchStudy, and StorageError or QueryError if the database cannot be read.
Plan plan(sqlite3* database, const protocol::StudyQuery& question);

/// Throws solver::InputError, which names `flag`, unless a query can select `text` as one value of
/// each point. `text` must have passed check_sql_part.
void check_output(const char* flag, const std::string& text);

/// Returns the error message for an unknown study, which suggests the nearest study name.
std::string no_such_study(sqlite3* database, const std::string& name);

/// Consecutive points, both ends included.
struct PointRange {
  std::uint64_t first;
  std::uint64_t last;

  bool operator==(const PointRange&) const = default;
};

/// Returns disjoint ascending ranges that contain every point of `recipe` that meets `condition`,
/// and possibly other points. Uses only comparisons of an axis of a product block with numbers (=,
/// <, <=, >, >=, BETWEEN), joined by AND. Widens ranges of an axis by one value at each end,
/// because another machine may round values differently. `condition` must have passed
/// check_sql_part. Every point meets an empty condition.
std::vector<PointRange> point_ranges(const protocol::Recipe& recipe, std::string_view condition);

std::uint64_t points_in(const std::vector<PointRange>& ranges);

}  // namespace oblique::server
