#include "server/care/merged_origins.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "server/store/rows/row_columns.h"

namespace oblique::server {

MergedOrigins::MergedOrigins(sqlite3* source, sqlite3* target, const StudyPlaces& places)
    : places_(places),
      read_(source, "SELECT name FROM origins WHERE origin_id = ?"),
      find_(target,
            "SELECT origin_id FROM origins WHERE name = ?"
            " AND origin_id NOT IN (SELECT study_id FROM studies) LIMIT 1"),
      reserve_(target, "UPDATE about SET last_study_id = 1 + " + last_study_id_sql() +
                           " RETURNING last_study_id"),
      insert_(target, "INSERT OR IGNORE INTO origins (origin_id, name) VALUES (?, ?)") {}

std::string MergedOrigins::in_target(const std::string& taken_from) {
  const std::size_t slash = std::min(taken_from.find('/'), taken_from.size());
  std::int64_t in_source = 0;
  std::from_chars(taken_from.data(), taken_from.data() + slash, in_source);
  return fmt::format("{}{}", number_of(in_source), std::string_view(taken_from).substr(slash));
}

std::int64_t MergedOrigins::number_of(std::int64_t in_source) {
  if (const auto known = known_.find(in_source); known != known_.end()) {
    return known->second;
  }
  std::int64_t number = 0;
  std::string name;
  if (const auto place = places_.find(static_cast<std::uint64_t>(in_source));
      place != places_.end()) {
    number = static_cast<std::int64_t>(place->second.id);
    name = place->second.name;
  } else {
    read_.bind(1, in_source);
    name = read_.step() ? read_.text(0) : fmt::format("study number {} (deleted)", in_source);
    read_.reset();
    number = number_without_study(name);
  }
  insert_.bind(1, number);
  insert_.bind(2, std::string_view(name));
  insert_.run();
  known_.emplace(in_source, number);
  return number;
}

/// The one that this name has already, or one that no study will ever have.
std::int64_t MergedOrigins::number_without_study(const std::string& name) {
  find_.bind(1, std::string_view(name));
  Statement& statement = find_.step() ? find_ : reserve_;
  if (&statement == &reserve_) {
    reserve_.step();
  }
  const std::int64_t number = statement.integer(0);
  find_.reset();
  reserve_.reset();
  return number;
}

void count_taken_points(sqlite3* database, std::uint64_t study_id) {
  for (const char* sql :
       {"DELETE FROM taken_points WHERE study_id = ?1",
        "INSERT INTO taken_points (study_id, origin_id, points)"
        " SELECT ?1, CAST(taken_from AS INTEGER) AS origin, count(*) FROM packed_results"
        " WHERE study_id = ?1 AND taken_from IS NOT NULL GROUP BY origin",
        "INSERT OR IGNORE INTO origins (origin_id, name)"
        " SELECT t.origin_id, coalesce((SELECT s.name FROM studies AS s"
        " WHERE s.study_id = t.origin_id), 'study number ' || t.origin_id || ' (deleted)')"
        " FROM taken_points AS t WHERE t.study_id = ?1"}) {
    Statement statement(database, sql);
    statement.bind(1, study_id);
    statement.run();
  }
}

}  // namespace oblique::server
