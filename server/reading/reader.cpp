#include "server/reading/reader.h"

#include <string_view>
#include <utility>
#include <vector>

#include "proto/suggestion.h"
#include "server/database/open_for_reading.h"

namespace oblique::server {
namespace {

constexpr int kBusyTimeout_ms = 2000;
/// The solver of a study's results, which are all of one unless it mixes them.
constexpr const char* kVersionOfRows =
    "SELECT w.solver_version FROM packed_results AS r CROSS JOIN workers AS w"
    " ON w.worker_id = r.worker WHERE r.study_id = s.study_id ORDER BY r.point LIMIT 1";
/// For what a study took over from others.
constexpr const char* kOrigins =
    "SELECT o.name, t.points FROM taken_points AS t JOIN origins AS o USING (origin_id)"
    " WHERE t.study_id = ? ORDER BY points DESC";

void add_taken(Statement& origins, protocol::StudyStatus& status) {
  constexpr int kMostNamed = 20;
  origins.bind(1, status.study_id());
  while (origins.step()) {
    auto& taken = *status.mutable_taken();
    const auto points = static_cast<std::uint64_t>(origins.integer(1));
    taken.set_points(taken.points() + points);
    if (taken.from_size() < kMostNamed) {
      auto& from = *taken.add_from();
      from.set_study(origins.text(0));
      from.set_points(points);
    }
  }
  origins.reset();
}

}  // namespace

Reader::Reader(const std::string& path) {
  auto opened = open_for_reading(path);
  database_ = std::move(opened.database);
  remark_ = std::move(opened.remark);
  sqlite3_busy_timeout(database_.get(), kBusyTimeout_ms);
  if (identify(database_.get(), path) == DatabaseKind::kEmpty) {
    throw StorageError(path + " is empty: no study was ever stored in it");
  }
  restrict_to_reading(database_.get());
}

protocol::QueryReply Reader::query(const std::string& sql, const QueryLimits& limits) {
  protocol::QueryRequest request;
  request.set_sql(sql);
  Answer rows = answer(request, limits);
  protocol::QueryReply whole;
  for (bool ends = false; !ends;) {
    const protocol::QueryReply chunk = rows.next();
    protocol::append_rows(chunk, whole);
    ends = chunk.ends();
  }
  return whole;
}

Answer Reader::answer(const protocol::QueryRequest& request, const QueryLimits& limits) {
  return {database_.get(), request, limits, interrupted_};
}

/// " (did you mean `x`?)" with the study whose name is nearest, or nothing.
std::string Reader::nearest_study(const std::string& name) {
  constexpr std::size_t kMostCompared = 10'000;
  Statement list(database_.get(), "SELECT name FROM studies");
  std::vector<std::string> names;
  while (names.size() < kMostCompared && list.step()) {
    names.push_back(list.text(0));
  }
  return protocol::did_you_mean(name, std::vector<std::string_view>(names.begin(), names.end()));
}

std::vector<protocol::StudyStatus> Reader::study_status(const std::string& name) {
  // Counts come from indices and the table for them where they can: rows are not touched.
  Statement list(
      database_.get(),
      std::string("SELECT s.study_id, s.name, s.state, s.points, s.created_at,"
                  " CASE s.counted WHEN 1 THEN (SELECT coalesce(sum(c.points), 0) FROM"
                  " settled_points AS c WHERE c.study_id = s.study_id) ELSE"
                  " (SELECT count(*) FROM packed_results AS r WHERE r.study_id = s.study_id) END,"
                  " (SELECT count(*) FROM packed_results AS r INDEXED BY failed_points"
                  " WHERE r.study_id = s.study_id AND r.error IS NOT NULL),"
                  " s.priority, s.weight, coalesce(s.submitted_by, ''), s.mixes_versions,"
                  " coalesce((") +
          kVersionOfRows +
          "), ''), CASE s.counted WHEN 1 THEN s.left_out ELSE 0 END FROM studies AS s WHERE ?1 = "
          "'' OR s.name = ?1 ORDER BY s.study_id");
  list.bind(1, name);
  Statement origins(database_.get(), kOrigins);
  std::vector<protocol::StudyStatus> found;
  while (list.step()) {
    protocol::StudyStatus status;
    const std::int64_t settled = list.integer(5);
    status.set_study_id(static_cast<std::uint64_t>(list.integer(0)));
    status.set_name(list.text(1));
    // A server that was killed may not have noted the end of a study.
    status.set_state(settled == list.integer(3) ? "done" : list.text(2));
    status.set_points(static_cast<std::uint64_t>(list.integer(3)));
    status.set_created_at(list.text(4));
    status.set_failed(static_cast<std::uint64_t>(list.integer(6)));
    status.set_left_out(static_cast<std::uint64_t>(list.integer(12)));
    status.set_solved(static_cast<std::uint64_t>(settled) - status.failed() - status.left_out());
    status.set_priority(static_cast<std::int32_t>(list.integer(7)));
    status.set_weight(list.real(8));
    status.set_submitted_by(list.text(9));
    status.set_mixes_versions(list.integer(10) != 0);
    status.set_solver_version(list.text(11));
    add_taken(origins, status);
    found.push_back(std::move(status));
  }
  if (found.empty() && !name.empty()) {
    throw QueryError("there is no study called \"" + name + "\"" + nearest_study(name));
  }
  return found;
}

}  // namespace oblique::server
