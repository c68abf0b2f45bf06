#include "server/store/result_reuse.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/canonical.h"
#include "server/store/rows/row_columns.h"

namespace oblique::server {
namespace {

/// Resets a statement at the end of a scope, also when an exception leaves it: a statement that
/// stays open would keep the connection at an old state of the database.
struct ResetAtEnd {
  Statement& statement;
  ~ResetAtEnd() { statement.reset(); }
};

/// Point numbers of one change, and lookups: some 50 ms of the writer when all have a row.
constexpr std::uint64_t kPart = 4096;

/// Columns of `rows_sql` before those of the row.
constexpr int kChecksum = 0;
constexpr int kIsUsable = 1;
constexpr int kRow = 2;

/// All rows of solved points with these inputs, those of lower study numbers first.
std::string rows_sql() {
  const auto fits = [](std::string_view column) {
    return fmt::format(
        " AND (r.{0} IS NULL OR EXISTS (SELECT 1 FROM texts WHERE text_id = r.{0}"
        " AND checksum = {1}))",
        column, text_checksum_sql());
  };
  std::vector<std::string> columns;
  for (const std::string_view column : packed_columns()) {
    columns.push_back(fmt::format("r.{}", column));
  }
  return fmt::format(
      "SELECT r.checksum, EXISTS (SELECT 1 FROM workers WHERE worker_id = r.worker"
      " AND solver_version = ?5 AND checksum = {}){}{}{}, {}"
      " FROM packed_results AS r INDEXED BY solved_points"
      " WHERE r.model_id = ?1 AND r.H = ?2 AND r.mu = ?3 AND r.e = ?4 AND r.error IS NULL"
      " ORDER BY r.study_id, r.point",
      worker_checksum_sql(), fits("mode"), fits("major_mode"), fits("margin_event"),
      fmt::join(columns, ", "));
}

void set_whole(PackedValue& value, std::uint64_t whole) {
  value.type = PackedValue::Type::kWhole;
  value.whole = static_cast<std::int64_t>(whole);
}

}  // namespace

ResultReuse::ResultReuse(sqlite3* database, SettledRuns& settled)
    : database_(database),
      settled_(settled),
      settled_run_(database,
                   "SELECT p.first_point + p.points FROM settled_points AS p JOIN studies AS s"
                   " USING (study_id) WHERE p.study_id = ?1 AND first_point <= ?2 AND s.counted"
                   " ORDER BY first_point DESC LIMIT 1"),
      model_(database, "SELECT model_id FROM models WHERE definition = ?"),
      rows_(database, rows_sql()),
      source_(database, "SELECT name, recipe FROM studies WHERE study_id = ?"),
      name_origin_(database, "INSERT OR IGNORE INTO origins (origin_id, name) VALUES (?, ?)"),
      count_(database,
             "INSERT INTO taken_points (study_id, origin_id, points) VALUES (?1, ?2, ?3)"
             " ON CONFLICT DO UPDATE SET points = points + excluded.points"),
      end_(database, "UPDATE studies SET takes_over = 0 WHERE study_id = ?"),
      insert_(database) {}

void ResultReuse::run(const ReuseResults& change) {
  ReusedResults& outcome = *change.outcome;
  outcome = {};  // the change may have been tried before
  sources_.clear();
  models_.clear();
  if (source_of(change.study_id) == nullptr) {
    return;  // it was deleted
  }
  const protocol::PointTable& table = *change.table;
  std::uint64_t point = first_unsettled(change.study_id, change.first_point);
  const std::uint64_t last = std::min(point + kPart, table.size());
  const IntervalSet settled = points_with_row(database_, change.study_id, {point, last});
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
      if (!settled.contains(point) && table.is_left_in(point) && table.fault(point).empty()) {
        reuse(change, point, model_id);
      }
    }
  }
  count_origins(change);
  if (point < table.size()) {
    outcome.next_point = point;
  }
}

void ResultReuse::end(const EndTaking& change) {
  end_.bind(1, change.study_id);
  end_.run();
}

/// `point`, or the end of the run of settled points that it is in.
std::uint64_t ResultReuse::first_unsettled(std::uint64_t study_id, std::uint64_t point) {
  settled_run_.bind(1, study_id);
  settled_run_.bind(2, point);
  const std::uint64_t end =
      settled_run_.step() ? static_cast<std::uint64_t>(settled_run_.integer(0)) : 0;
  settled_run_.reset();
  return std::max(point, end);
}

/// Its row in `models`; 0: there is none.
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

/// Copies the first usable row that has the inputs of that point.
void ResultReuse::reuse(const ReuseResults& change, std::uint64_t point, std::int64_t model_id) {
  static const int kStudy = packed_column("study_id");
  static const int kPoint = packed_column("point");
  static const int kTakenFrom = packed_column("taken_from");
  ReusedResults& outcome = *change.outcome;
  ++outcome.probes;
  const protocol::Point inputs = change.table->point(point);
  const ResetAtEnd reset{rows_};
  rows_.bind(1, model_id);
  rows_.bind(2, inputs.H_m);
  rows_.bind(3, inputs.mu);
  rows_.bind(4, inputs.e_star);
  rows_.bind(5, change.solver_version);
  for (; rows_.step(); ++outcome.probes) {
    row_.read(rows_, kRow);
    const auto source_id = static_cast<std::uint64_t>(row_.at(kStudy).whole);
    Source* const source = source_id == change.study_id ? nullptr : source_of(source_id);
    if (source == nullptr || source->wants_errors != change.table->wants_errors() ||
        rows_.integer(kIsUsable) == 0 || rows_.is_null(kChecksum) ||
        rows_.integer(kChecksum) != row_.checksum(checksum_)) {
      continue;
    }
    PackedValue& origin = row_.at(kTakenFrom);
    origin.type = PackedValue::Type::kText;
    origin.text = fmt::format("{}/{}", source_id, row_.at(kPoint).whole);
    set_whole(row_.at(kStudy), change.study_id);
    set_whole(row_.at(kPoint), point);
    if (insert_.run(row_)) {
      ++source->copied;
      outcome.points.insert(point);
      settled_.add(change.study_id, {point, point + 1});
    }
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
  for (const auto& [source_id, source] : sources_) {
    if (!source || source->copied == 0) {
      continue;
    }
    change.outcome->origins[source->name] = source->copied;
    name_origin_.bind(1, source_id);
    name_origin_.bind(2, source->name);
    name_origin_.run();
    count_.bind(1, change.study_id);
    count_.bind(2, source_id);
    count_.bind(3, source->copied);
    count_.run();
  }
}

}  // namespace oblique::server
