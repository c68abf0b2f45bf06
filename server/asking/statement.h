#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <sqlite3.h>

#include "proto/oblique.pb.h"
#include "server/asking/point_spans.h"

namespace oblique::server {

/// What is known of the study of a question.
struct AskedStudy {
  std::int64_t study_id;
  std::uint64_t points;     ///< without those that filters leave out
  protocol::Recipe recipe;  ///< empty: it cannot be read, or is not that of so many points
};

/// Throws solver::InputError for a name that no study has.
AskedStudy asked_study(sqlite3* database, const std::string& name);

/// How the rows of a question are found and put into order.
struct RowsAsked {
  bool by_spans = false;  ///< only rows in `spans`, else all
  std::vector<PointSpan> spans;
  bool come_in_order = false;  ///< spans are read in the order that is asked for
};

/// Chooses how rows are found: by the spans that the condition leaves of the recipe, unless they
/// are as many as the points.
RowsAsked rows_asked(const protocol::StudyQuery& question, const AskedStudy& study);

/// Whether a question asks for the order of points, rising.
bool is_in_point_order(const protocol::StudyQuery& question);

/// The columns that a statement of SQL gives. Throws solver::InputError with what SQLite has
/// against it.
std::vector<std::string> columns_of_statement(sqlite3* database, const std::string& sql);

/// The statement that answers a question that was checked. `selected` is what stands behind SELECT.
std::string statement_of(sqlite3* database, const protocol::StudyQuery& question,
                         const std::string& selected, const AskedStudy& study,
                         const RowsAsked& rows);

}  // namespace oblique::server
