#include "server/store/result_reuse.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "server/store/result_rows.h"

namespace oblique::server {
namespace {

/// Resets a statement at the end of a scope, also when an exception leaves it: a statement that
/// stays open would keep the connection at an old state of the database.
struct ResetAtEnd {
  Statement& statement;
  ~ResetAtEnd() { statement.reset(); }
};

/// Most point numbers and most lookups of one change: about 50 ms of the writer if all find a row.
constexpr std::uint64_t kPart = 4096;

/// The columns of a copy: those of the row `r`, except the study ?1, the point ?2 and the source
/// ?3.
std::vector<std::string> copied_columns() {
  std::vector<std::string> columns;
  for (const std::string_view column : result_columns()) {
    columns.push_back(column == "study_id"      ? "?1"
                      : column == "point"       ? "?2"
                      : column == "reused_from" ? "?3"
                                                : fmt::format("r.{}", column));
  }
  return columns;
}

/// Selects the solved rows of other studies with these inputs, lowest study number first, and
/// whether each has a right checksum and the wanted solver version.
std::string find_sql() {
  return fmt::format(
      "SELECT study_id, point, checksum IS {} AND EXISTS (SELECT 1 FROM workers AS w"
      " WHERE w.worker_id = results.worker_id AND w.solver_version = ?5)"
      " FROM results INDEXED BY solved_points"
      " WHERE model_id = ?1 AND H = ?2 AND mu = ?3 AND e = ?4 AND error IS NULL AND study_id <> ?6"
      " ORDER BY study_id, point",
      result_checksum_sql());
}

std::string copy_sql() {
  const auto columns = copied_columns();
  return fmt::format(
      "INSERT INTO results ({0}, checksum) SELECT {1}, row_checksum({1}) FROM results AS r"
      " WHERE r.study_id = ?4 AND r.point = ?5 ON CONFLICT (study_id, point) DO NOTHING",
      fmt::join(result_columns(), ", "), fmt::join(columns, ", "));
}

}  // namespace

ResultReuse::ResultReuse(sqlite3* database, CompletedRanges& ranges)
    : database_(database),
      ranges_(ranges),
      model_(database, "SELECT model_id FROM models WHERE definition = ?"),
      find_(database, find_sql()),
      copy_(database, copy_sql()),
      source_(database, "SELECT name, recipe FROM studies WHERE study_id = ?") {}

void ResultReuse::run(const ReuseResults& change) {
  ReusedResults& outcome = *change.outcome;
  outcome = {};  // an earlier attempt at this change may have failed
  sources_.clear();
  models_.clear();
  if (source_of(change.study_id) == nullptr) {
    return;  // it was deleted
  }
  const protocol::PointTable& table = *change.table;
  std::uint64_t point = first_open(change.study_id, change.first_point);
  const std::uint64_t last = std::min(point + kPart, table.size());
  const IntervalSet completed = ranges_.overlapping(change.study_id, {point, last});
  while (point < last && outcome.probes < kPart) {
    const protocol::Segment segment = table.segment_at(point);
    const std::uint64_t segment_end = segment.first_point + segment.count;
    const std::int64_t model_id = stored_model(table, segment.model);
    if (model_id == 0) {  // no row has that model
      ++outcome.probes;
      point = segment_end;
      continue;
    }
    for (const std::uint64_t end = std::min(segment_end, last);
         point < end && outcome.probes < kPart; ++point) {
      if (!completed.contains(point) && table.is_left_in(point) && table.fault(point).empty()) {
        reuse(change, point, model_id);
      }
    }
  }
  count_origins(change);
  if (point < table.size()) {
    outcome.next_point = point;
  }
}

void ResultReuse::end(const EndReuse& change) {
  execute_with(database_, "UPDATE studies SET reuses = 0 WHERE study_id = ?", change.study_id);
}

/// `point`, or the end of the completed range that contains it.
std::uint64_t ResultReuse::first_open(std::uint64_t study_id, std::uint64_t point) {
  std::uint64_t first = point;
  ranges_.overlapping(study_id, {point, point + 1}).for_each([&](const Interval& range) {
    first = range.end;
  });
  return first;
}

/// The row of the model in `models`; 0: there is none.
std::int64_t ResultReuse::stored_model(const protocol::PointTable& table, std::uint64_t model) {
  const auto [known, is_new] = models_.emplace(model, 0);
  if (is_new) {
    const std::string definition = protocol::canonical_model(table.model(model));
    model_.bind(1, definition);
    known->second = model_.step() ? model_.integer(0) : 0;
    model_.reset();
  }
  return known->second;
}

/// Copies the first usable row that has the inputs of `point`.
void ResultReuse::reuse(const ReuseResults& change, std::uint64_t point, std::int64_t model_id) {
  ReusedResults& outcome = *change.outcome;
  ++outcome.probes;
  const protocol::Point inputs = change.table->point(point);
  const ResetAtEnd reset{find_};
  find_.bind_all(model_id, inputs.H_m, inputs.mu, inputs.e_star, change.solver_version,
                 change.study_id);
  for (; find_.step(); ++outcome.probes) {
    const auto source_id = static_cast<std::uint64_t>(find_.integer(0));
    Source* const source = source_of(source_id);
    if (source == nullptr || source->wants_errors != change.table->wants_errors() ||
        find_.integer(2) == 0) {
      continue;
    }
    const std::string reused_from = fmt::format("{}/{}", source->name, find_.integer(1));
    const ResetAtEnd reset_copy{copy_};
    copy_.bind_all(change.study_id, point, reused_from, source_id, find_.integer(1));
    copy_.run();
    if (sqlite3_changes(database_) > 0) {
      ++source->copied;
      outcome.points.insert(point);
    }
    ranges_.add(change.study_id, point);  // also if it already had a row
    break;
  }
}

/// Null for a study that was deleted.
ResultReuse::Source* ResultReuse::source_of(std::uint64_t study_id) {
  const auto [known, is_new] = sources_.emplace(study_id, std::nullopt);
  if (is_new) {
    source_.bind(1, study_id);
    if (source_.step()) {
      const auto [wants_errors, is_unread] = wants_errors_.emplace(study_id, false);
      protocol::Recipe recipe;
      if (is_unread && recipe.ParseFromString(source_.text(1))) {
        wants_errors->second = recipe.errors();
      }
      known->second = Source{source_.text(0), wants_errors->second};
    }
    source_.reset();
  }
  return known->second ? &*known->second : nullptr;
}

void ResultReuse::count_origins(const ReuseResults& change) {
  for (const auto& [id, source] : sources_) {
    if (!source || source->copied == 0) {
      continue;
    }
    change.outcome->origins[source->name] = source->copied;
    execute_with(database_,
                 "INSERT INTO reused_points (study_id, source, points) VALUES (?1, ?2, ?3)"
                 " ON CONFLICT DO UPDATE SET points = points + excluded.points",
                 change.study_id, source->name, source->copied);
  }
}

}  // namespace oblique::server
