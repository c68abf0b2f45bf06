// Looks up open points of a study in the results of other studies, by the index `solved_points`,
// and copies the rows that it finds.
#include <algorithm>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/store/result_rows.h"
#include "server/store/store.h"

namespace oblique::server {
namespace {

/// Maximum number of points, and of lookups, in one change; the change takes at most about 50 ms.
constexpr std::uint64_t kPart = 4096;

/// Selects study, point and study name of the first row of another study that has these inputs, is
/// solved and has a correct checksum, as its worker has. `i` is an entry of the index and `r` the
/// row itself, because one of them may be damaged. The unary plus keeps SQLite from reading the
/// inputs of `r` in the index.
std::string find_sql() {
  return fmt::format(
      "SELECT r.study_id, r.point, s.name FROM results AS i INDEXED BY solved_points"
      " CROSS JOIN results AS r ON r.study_id = i.study_id AND r.point = i.point"
      " CROSS JOIN studies AS s ON s.study_id = r.study_id"
      " WHERE i.model_id = ?1 AND i.H = ?2 AND i.mu = ?3 AND i.e = ?4 AND i.error IS NULL"
      " AND +r.model_id = ?1 AND +r.H = ?2 AND +r.mu = ?3 AND +r.e = ?4 AND r.error IS NULL"
      " AND r.study_id <> ?5 AND s.errors = ?7 AND EXISTS (SELECT 1 FROM workers WHERE"
      " worker_id = r.worker_id AND solver_version = ?6 AND checksum = {})"
      " AND r.checksum = row_checksum(r.{})"
      " ORDER BY i.study_id, i.point LIMIT 1",
      kWorkerChecksum, fmt::join(result_columns(), ", r."));
}

/// Copies a row for study ?1 and point ?2, with ?3 as `reused_from`.
std::string copy_sql() {
  std::vector<std::string> copied;
  for (const std::string_view column : result_columns()) {
    copied.push_back(column == "study_id"      ? "?1"
                     : column == "point"       ? "?2"
                     : column == "reused_from" ? "?3"
                                               : fmt::format("r.{}", column));
  }
  return fmt::format(
      "INSERT INTO results ({0}, checksum) SELECT {1}, row_checksum({1}) FROM results AS r"
      " WHERE r.study_id = ?4 AND r.point = ?5 ON CONFLICT (study_id, point) DO NOTHING",
      fmt::join(result_columns(), ", "), fmt::join(copied, ", "));
}

class Lookup {
 public:
  Lookup(sqlite3* database, const ReuseResults& change, ModelRows& models)
      : database_(database),
        change_(change),
        models_(models),
        find_(database, find_sql()),
        copy_(database, copy_sql()) {}

  /// Looks up the open points in [first, last). Returns the point before which it stopped.
  std::uint64_t run(std::uint64_t first, std::uint64_t last, const IntervalSet& completed) {
    const protocol::PointTable& table = *change_.table;
    std::uint64_t& probes = change_.outcome->probes;
    std::uint64_t point = first;
    while (point < last && probes < kPart) {
      const protocol::Segment segment = table.segment_at(point);
      const std::uint64_t segment_end = segment.first_point + segment.count;
      const std::int64_t model_id = stored_model(segment.model);
      if (model_id == 0) {  // no study has results of this model
        ++probes;
        point = segment_end;
        continue;
      }
      for (const std::uint64_t end = std::min(segment_end, last); point < end && probes < kPart;
           ++point) {
        if (!completed.contains(point) && table.passes_filter(point) &&
            table.fault(point).empty()) {
          copy_to(point, model_id);
        }
      }
    }
    return point;
  }

 private:
  std::int64_t stored_model(std::uint64_t model) {
    const auto [known, is_new] = model_ids_.emplace(model, 0);
    if (is_new) {
      known->second = models_.find(change_.table->model(model));
    }
    return known->second;
  }

  void copy_to(std::uint64_t point, std::int64_t model_id) {
    ReusedResults& outcome = *change_.outcome;
    ++outcome.probes;
    const protocol::Point inputs = change_.table->point(point);
    find_.reset();
    find_.bind_all(model_id, inputs.H_m, inputs.mu, inputs.e_star, change_.study_id,
                   change_.solver_version, change_.table->wants_errors());
    if (!find_.step()) {
      return;
    }
    const std::string source = find_.text(2);
    copy_.bind_all(change_.study_id, point, fmt::format("{}/{}", source, find_.number(1)),
                   find_.number(0), find_.number(1));
    copy_.run();
    if (sqlite3_changes(database_) > 0) {
      outcome.points.insert(point);
      ++outcome.origins[source];
    }
  }

  sqlite3* database_;
  const ReuseResults& change_;
  ModelRows& models_;
  Statement find_;
  Statement copy_;
  // row number in `models` by model number in the recipe; 0 for a model without a row
  std::unordered_map<std::uint64_t, std::int64_t> model_ids_;
};

}  // namespace

void Store::add(const ReuseResults& change) {
  ReusedResults& outcome = *change.outcome;
  outcome = {};  // removes the outcome of an earlier attempt that failed
  if (!has_study(change.study_id)) {
    return;
  }
  std::uint64_t first = change.first_point;
  ranges_->overlapping(change.study_id, {first, first + 1}).for_each([&](const Interval& range) {
    first = range.end;
  });
  const std::uint64_t last = std::min(first + kPart, change.table->size());
  const std::uint64_t end =
      Lookup(database_.get(), change, statements_->models)
          .run(first, last, ranges_->overlapping(change.study_id, {first, last}));
  if (end < change.table->size()) {
    outcome.next_point = end;
  }
  outcome.points.for_each([&](const Interval& range) { ranges_->add(change.study_id, range); });
  for (const auto& [source, points] : outcome.origins) {
    execute_with(database_.get(),
                 "INSERT INTO reused_points (study_id, source, points) VALUES (?1, ?2, ?3)"
                 " ON CONFLICT DO UPDATE SET points = points + excluded.points",
                 change.study_id, source, points);
  }
}

}  // namespace oblique::server
