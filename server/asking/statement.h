#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <sqlite3.h>

#include "proto/oblique.pb.h"

namespace oblique::server {

/// The study of a question.
struct AskedStudy {
  std::int64_t study_id;
  protocol::Recipe recipe;  ///< empty if it cannot be read or has another number of points
};

/// Throws solver::InputError for a name that no study has.
AskedStudy asked_study(sqlite3* database, const std::string& name);

/// Whether a question asks for rows in rising order of their points.
bool is_in_point_order(const protocol::StudyQuery& question);

/// The columns that a statement of SQL gives. Throws solver::InputError with SQLite's message.
std::vector<std::string> columns_of_statement(sqlite3* database, const std::string& sql);

/// The statement that answers a validated question. `selected` is the text behind SELECT.
std::string statement_of(sqlite3* database, const protocol::StudyQuery& question,
                         const std::string& selected, const AskedStudy& study);

}  // namespace oblique::server
