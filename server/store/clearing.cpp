#include "server/store/clearing.h"

#include <algorithm>
#include <limits>
#include <string>

namespace oblique::server {
namespace {

/// Fewer free pages are left for what comes.
constexpr std::int64_t kFewPages = 16;
/// To give a page back takes as long as to delete about so many rows, for it is moved with what
/// names it.
constexpr std::size_t kRowsAPage = 128;
/// So many rows are looked at while one is deleted.
constexpr std::size_t kLooksARow = 16;
/// Study and point of no row, below those of all.
constexpr std::pair kBeforeAll{std::numeric_limits<std::int64_t>::min(), std::int64_t{0}};

std::int64_t number_of(sqlite3* database, const char* sql) {
  Statement statement(database, sql);
  return statement.step() ? statement.integer(0) : 0;
}

void run_for(sqlite3* database, const char* sql, std::uint64_t study_id) {
  Statement statement(database, sql);
  statement.bind(1, study_id);
  statement.run();
}

}  // namespace

void DoubtfulNumbers::insert(std::uint64_t begin, std::uint64_t end) {
  runs_.insert(begin, std::min(end, end_));
  bound();
}

void DoubtfulNumbers::erase(std::uint64_t number) {
  runs_.erase(number);
  bound();  // it may have parted a run
}

void DoubtfulNumbers::clear() {
  runs_ = {};
  end_ = kNoEnd;
}

/// Leaves the higher half for later, so that this is seldom done.
void DoubtfulNumbers::bound() {
  if (runs_.intervals() <= most_runs_) {
    return;
  }
  std::size_t left = (most_runs_ + 1) / 2;
  runs_.for_each([&](const Interval& run) {
    if (left == 0) {
      end_ = std::min(end_, run.begin);
    } else {
      --left;
    }
  });
  runs_.erase(end_, kNoEnd);
}

std::uint64_t DoubtfulNumbers::next_round() {
  const std::uint64_t first = end_;
  clear();
  return first;
}

Clearing::Clearing(sqlite3* database, std::size_t most_runs)
    : database_(database),
      last_worker_(number_of(database_, "SELECT max(worker_id) FROM workers")),
      doubtful_{DoubtfulNumbers(most_runs), DoubtfulNumbers(most_runs)} {
  begin();
}

/// As the database says.
void Clearing::begin() {
  left_.clear();
  doubtful_.models.clear();
  doubtful_.workers.clear();
  Statement list(database_, "SELECT study_id FROM deletions");
  while (list.step()) {
    left_.insert(static_cast<std::uint64_t>(list.integer(0)));
  }
  doubts_all_ = !left_.empty();
  if (!left_.empty()) {
    phase_ = Phase::kRows;
  } else {
    phase_ = pages_to_give_back() > kFewPages ? Phase::kGivesBack : Phase::kIdle;
  }
  must_begin_anew_ = false;
}

void Clearing::remove(std::uint64_t study_id) {
  run_for(database_, "UPDATE about SET last_study_id = max(last_study_id, ?)", study_id);
  run_for(database_, "INSERT OR IGNORE INTO deletions (study_id) VALUES (?)", study_id);
  run_for(database_, "DELETE FROM retries WHERE study_id = ?", study_id);
  run_for(database_, "DELETE FROM taken_points WHERE study_id = ?", study_id);
  run_for(database_,
          "UPDATE origins SET name = name || ' (deleted)' WHERE origin_id = ?1"
          " AND EXISTS (SELECT 1 FROM studies WHERE study_id = ?1)",
          study_id);
  run_for(database_, "DELETE FROM studies WHERE study_id = ?", study_id);
  removed_now_.insert(study_id);
  deleted_.insert(study_id);
  left_.insert(study_id);
  phase_ = Phase::kRows;
}

void Clearing::undo() {
  for (const std::uint64_t study : removed_now_) {
    deleted_.erase(study);
  }
  must_begin_anew_ = must_begin_anew_ || !removed_now_.empty();
  removed_now_.clear();
}

void Clearing::note_use(std::int64_t model, std::uint64_t worker) {
  doubtful_.models.erase(static_cast<std::uint64_t>(model));
  doubtful_.workers.erase(worker);
}

bool Clearing::step(std::size_t most) {
  if (must_begin_anew_) {
    begin();
  }
  switch (phase_) {
    case Phase::kRows:
      delete_rows(most);
      return false;
    case Phase::kUses:
      look_for_uses(kLooksARow * most);
      return false;
    case Phase::kReferences:
      return delete_references(most);
    case Phase::kEntries:
      if (!keeps_entries_) {
        execute(database_, "DELETE FROM deletions");
        execute(database_,
                "DELETE FROM origins WHERE origin_id NOT IN (SELECT study_id FROM studies)"
                " AND origin_id NOT IN (SELECT origin_id FROM taken_points)");
      }
      phase_ = Phase::kGivesBack;
      return false;
    case Phase::kGivesBack:
      execute(database_, "PRAGMA incremental_vacuum(" +
                             std::to_string(std::max<std::size_t>(most / kRowsAPage, 1)) + ")");
      phase_ = pages_to_give_back() > kFewPages ? Phase::kGivesBack : Phase::kIdle;
      return false;
    case Phase::kIdle:
      return false;
  }
  return false;
}

void Clearing::delete_rows(std::size_t most) {
  if (left_.empty()) {
    if (doubts_all_) {
      doubt_all(0, 0);
      doubts_all_ = false;
    }
    looked_until_ = kBeforeAll;
    phase_ = Phase::kUses;
    if (doubtful_.empty()) {
      end_round();
    }
    return;
  }
  const std::uint64_t study = *left_.begin();
  Statement rows(database_,
                 "SELECT point, model_id, worker FROM packed_results WHERE study_id = ?"
                 " ORDER BY point LIMIT ?");
  rows.bind(1, study);
  rows.bind(2, std::uint64_t{most});
  std::int64_t last_point = -1;
  std::uint64_t found = 0;
  while (rows.step()) {
    last_point = rows.integer(0);
    ++found;
    if (!doubts_all_) {
      doubtful_.insert(rows, 1, 2);
    }
  }
  rows.reset();
  Statement remove(database_, "DELETE FROM packed_results WHERE study_id = ? AND point <= ?");
  remove.bind(1, study);
  remove.bind(2, last_point);
  remove.run();
  rows_ += found;
  if (found < most) {
    // Runs of neighbours: few beside the rows, and one for each row at worst.
    Statement settled(database_,
                      "DELETE FROM settled_points WHERE study_id = ?1 AND first_point <= coalesce("
                      "(SELECT first_point FROM settled_points WHERE study_id = ?1"
                      " ORDER BY first_point LIMIT 1 OFFSET ?2), 9223372036854775807)");
    settled.bind(1, study);
    settled.bind(2, std::uint64_t{most});
    settled.run();
    Statement more(database_, "SELECT 1 FROM settled_points WHERE study_id = ?");
    more.bind(1, study);
    if (!more.step()) {
      left_.erase(study);
    }
  }
}

/// All that there are from these on may be named by no row. Those that come later are named by the
/// row with which they come.
void Clearing::doubt_all(std::uint64_t first_model, std::uint64_t first_worker) {
  doubtful_.models.insert(
      first_model,
      static_cast<std::uint64_t>(number_of(database_, "SELECT max(model_id) FROM models")) + 1);
  Statement workers(database_, "SELECT worker_id FROM workers WHERE worker_id >= ?");
  workers.bind(1, first_worker);
  while (workers.step()) {
    const auto worker = static_cast<std::uint64_t>(workers.integer(0));
    doubtful_.workers.insert(worker, worker + 1);
  }
}

void Clearing::look_for_uses(std::size_t most) {
  Statement rows(database_,
                 "SELECT study_id, point, model_id, worker FROM packed_results"
                 " WHERE (study_id, point) > (?, ?) ORDER BY study_id, point LIMIT ?");
  rows.bind(1, looked_until_.first);
  rows.bind(2, looked_until_.second);
  rows.bind(3, std::uint64_t{most});
  std::size_t found = 0;
  while (rows.step()) {
    ++found;
    looked_until_ = {rows.integer(0), rows.integer(1)};
    doubtful_.erase(rows, 2, 3);
  }
  if (doubtful_.empty()) {
    end_round();
  } else if (found < most) {
    phase_ = Phase::kReferences;
  }
}

bool Clearing::delete_references(std::size_t most) {
  const auto first_later = static_cast<std::uint64_t>(last_worker_) + 1;
  if (doubtful_.workers.runs().first_from(first_later)) {
    keeps_entries_ = true;
    doubtful_.workers.erase({first_later, doubtful_.workers.end()});
  }
  std::size_t done = 0;
  const auto remove = [&](DoubtfulNumbers& numbers, const std::string& table,
                          const std::string& key) {
    Statement find(database_, "SELECT count(*), max(n) FROM (SELECT " + key + " AS n FROM " +
                                  table + " WHERE n >= ? AND n < ? ORDER BY n LIMIT ?)");
    Statement remove_run(database_, "DELETE FROM " + table + " WHERE " + key + " BETWEEN ? AND ?");
    while (!numbers.empty() && done < most) {
      Interval run = numbers.runs().front();
      find.bind(1, run.begin);
      find.bind(2, run.end);
      find.bind(3, std::uint64_t{most - done});
      find.step();
      const auto found = static_cast<std::size_t>(find.integer(0));
      if (found == most - done) {
        run.end = static_cast<std::uint64_t>(find.integer(1)) + 1;
      }
      find.reset();
      remove_run.bind(1, run.begin);
      remove_run.bind(2, run.end - 1);
      remove_run.run();
      numbers.erase(run);
      done += found + 1;
    }
  };
  const bool any_model = !doubtful_.models.empty();
  remove(doubtful_.models, "models", "model_id");
  remove(doubtful_.workers, "workers", "worker_id");
  if (doubtful_.empty()) {
    end_round();
  }
  return any_model;
}

/// What was left for later is in doubt now.
void Clearing::end_round() {
  if (!doubtful_.models.has_more() && !doubtful_.workers.has_more()) {
    phase_ = Phase::kEntries;
    return;
  }
  const std::uint64_t first_model = doubtful_.models.next_round();
  doubt_all(first_model, doubtful_.workers.next_round());
  looked_until_ = kBeforeAll;
  phase_ = doubtful_.empty() ? Phase::kEntries : Phase::kUses;
}

std::int64_t Clearing::pages_to_give_back() {
  constexpr std::int64_t kIncremental = 2;
  return number_of(database_, "PRAGMA auto_vacuum") == kIncremental
             ? number_of(database_, "PRAGMA freelist_count")
             : 0;
}

void Clearing::References::insert(const Statement& row, int model, int worker) {
  const auto add = [&](DoubtfulNumbers& numbers, int column) {
    const auto number = static_cast<std::uint64_t>(row.integer(column));
    numbers.insert(number, number + 1);
  };
  add(models, model);
  if (!row.is_null(worker)) {
    add(workers, worker);
  }
}

void Clearing::References::erase(const Statement& row, int model, int worker) {
  models.erase(static_cast<std::uint64_t>(row.integer(model)));
  if (!row.is_null(worker)) {
    workers.erase(static_cast<std::uint64_t>(row.integer(worker)));
  }
}

}  // namespace oblique::server
