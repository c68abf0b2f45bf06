#include "server/store/rows/settled_runs.h"

#include <algorithm>
#include <limits>

namespace oblique::server {
namespace {

std::uint64_t number(const Statement& row, int column) {
  return static_cast<std::uint64_t>(row.integer(column));
}

}  // namespace

IntervalSet points_with_row(sqlite3* database, std::uint64_t study_id, const Interval& points) {
  IntervalSet found;
  Interval run{0, 0};
  Statement rows(database,
                 "SELECT point FROM packed_results WHERE study_id = ? AND point >= ? AND point < ?"
                 " ORDER BY point");
  rows.bind(1, study_id);
  rows.bind(2, points.begin);
  rows.bind(3, points.end);
  while (rows.step()) {
    const std::uint64_t point = number(rows, 0);
    if (point != run.end) {
      found.insert(run.begin, run.end);
      run.begin = point;
    }
    run.end = point + 1;
  }
  found.insert(run.begin, run.end);
  return found;
}

std::map<std::uint64_t, std::optional<IntervalSet>> noted_points(sqlite3* database) {
  std::map<std::uint64_t, std::optional<IntervalSet>> found;
  Statement studies(database, "SELECT study_id, counted FROM studies");
  while (studies.step()) {
    found[number(studies, 0)] =
        studies.integer(1) != 0 ? std::optional(IntervalSet()) : std::nullopt;
  }
  Statement runs(database,
                 "SELECT study_id, first_point, points FROM settled_points"
                 " ORDER BY study_id, first_point");
  while (runs.step()) {
    const auto study = found.find(number(runs, 0));
    if (study != found.end() && study->second) {
      study->second->insert(number(runs, 1), number(runs, 1) + number(runs, 2));
    }
  }
  return found;
}

std::optional<IntervalSet> noted_points_of(sqlite3* database, std::uint64_t study_id) {
  Statement study(database, "SELECT 1 FROM studies WHERE study_id = ? AND counted");
  study.bind(1, study_id);
  if (!study.step()) {
    return std::nullopt;
  }
  IntervalSet found;
  Statement runs(database,
                 "SELECT first_point, points FROM settled_points WHERE study_id = ?"
                 " ORDER BY first_point");
  runs.bind(1, study_id);
  while (runs.step()) {
    found.insert(number(runs, 0), number(runs, 0) + number(runs, 1));
  }
  return found;
}

struct SettledRuns::Statements {
  explicit Statements(sqlite3* database)
      : before(database,
               "SELECT first_point, points FROM settled_points WHERE study_id = ?"
               " AND first_point BETWEEN 0 AND ? ORDER BY first_point DESC LIMIT 1"),
        swallow(database,
                "DELETE FROM settled_points WHERE study_id = ? AND first_point BETWEEN ? AND ?"
                " RETURNING first_point + points"),
        put(database, "INSERT OR REPLACE INTO settled_points VALUES (?, ?, ?)"),
        is_doubtful(database, "SELECT 1 FROM studies WHERE study_id = ? AND NOT counted"),
        set_certain(database, "UPDATE studies SET counted = 1 WHERE study_id = ? AND NOT counted"),
        clear(database, "DELETE FROM settled_points WHERE study_id = ?"),
        forget_left_out(database, "UPDATE studies SET left_out = 0 WHERE study_id = ?") {}

  Statement before;
  Statement swallow;
  Statement put;
  Statement is_doubtful;
  Statement set_certain;
  Statement clear;
  Statement forget_left_out;
};

SettledRuns::SettledRuns(sqlite3* database)
    : database_(database), statements_(std::make_unique<Statements>(database)) {}
SettledRuns::~SettledRuns() = default;

void SettledRuns::flush() {
  for (const auto& [study_id, points] : gathered_) {
    points.for_each([this, id = study_id](const Interval& run) { write(id, run); });
  }
  gathered_.clear();
}

void SettledRuns::write(std::uint64_t study_id, const Interval& run) {
  Interval whole = run;
  Statement& before = statements_->before;
  before.bind(1, study_id);
  before.bind(2, run.begin);
  if (before.step() && number(before, 0) + number(before, 1) >= run.begin) {
    whole.begin = number(before, 0);
    whole.end = std::max(whole.end, whole.begin + number(before, 1));
  }
  before.reset();
  // Runs do not touch each other: what begins in this one or right behind it ends before another.
  Statement& swallow = statements_->swallow;
  swallow.bind(1, study_id);
  swallow.bind(2, whole.begin + 1);
  swallow.bind(3, whole.end);
  while (swallow.step()) {
    whole.end = std::max(whole.end, number(swallow, 0));
  }
  swallow.reset();
  Statement& put = statements_->put;
  put.bind(1, study_id);
  put.bind(2, whole.begin);
  put.bind(3, whole.end - whole.begin);
  put.run();
}

void SettledRuns::erase(std::uint64_t study_id, const Interval& points) {
  Statement& before = statements_->before;
  before.bind(1, study_id);
  before.bind(2, points.begin);
  const bool overlaps = before.step() && number(before, 0) + number(before, 1) > points.begin;
  const Interval run = overlaps ? Interval{number(before, 0), number(before, 0) + number(before, 1)}
                                : Interval{points.begin, points.begin};
  before.reset();
  std::uint64_t end = run.end;
  Statement& swallow = statements_->swallow;
  swallow.bind(1, study_id);
  swallow.bind(2, run.begin);
  swallow.bind(3, points.end - 1);
  while (swallow.step()) {
    end = std::max(end, number(swallow, 0));
  }
  swallow.reset();
  for (const Interval& rest :
       {Interval{run.begin, points.begin}, Interval{points.end, std::max(end, points.end)}}) {
    if (rest.begin < rest.end) {
      write(study_id, rest);
    }
  }
}

void SettledRuns::look_again(std::uint64_t study_id, const Interval& points, bool was_doubtful) {
  if (points.begin >= points.end) {
    return;
  }
  erase(study_id, points);
  points_with_row(database_, study_id, points).for_each([&](const Interval& run) {
    write(study_id, run);
  });
  if (!was_doubtful) {
    set_certain(study_id);
  }
}

bool SettledRuns::is_doubtful(std::uint64_t study_id) {
  Statement& query = statements_->is_doubtful;
  query.bind(1, study_id);
  const bool found = query.step();
  query.reset();
  return found;
}

void SettledRuns::set_certain(std::uint64_t study_id) {
  statements_->set_certain.bind(1, study_id);
  statements_->set_certain.run();
}

void SettledRuns::count_again(std::uint64_t study_id) {
  constexpr auto kLast = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  const IntervalSet points = points_with_row(database_, study_id, {0, kLast});
  for (Statement* statement : {&statements_->clear, &statements_->forget_left_out}) {
    statement->bind(1, study_id);
    statement->run();
  }
  points.for_each([&](const Interval& run) { write(study_id, run); });
  set_certain(study_id);
}

}  // namespace oblique::server
