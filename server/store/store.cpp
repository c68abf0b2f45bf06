#include "server/store/store.h"

#include <algorithm>
#include <optional>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/canonical.h"
#include "proto/recipe/point_inputs.h"
#include "proto/result_message.h"
#include "server/database/row_checksum.h"
#include "server/store/result_rows.h"
#include "server/store/schema.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMostCachedModels = 65536;
/// Instructions of SQLite's virtual machine between checks for an interrupt: about 10 us.
constexpr int kStepsBetweenLooks = 1000;

}  // namespace

/// Prepared statements for batches of results.
struct Store::Statements {
  explicit Statements(sqlite3* database)
      : find_study(database, "SELECT 1 FROM studies WHERE study_id = ?"),
        find_model(database, "SELECT model_id FROM models WHERE definition = ?"),
        add_model(database, insert_model_sql()),
        add_result(database) {}

  Statement find_study;
  Statement find_model;
  Statement add_model;
  ResultInsert add_result;
};

Store::Store(const std::string& path) {
  check_path(path);
  files_ = std::make_unique<DatabaseFiles>(path);
  database_ = open_database(path, SQLITE_OPEN_READWRITE);
  sqlite3_progress_handler(
      database_.get(), kStepsBetweenLooks,
      [](void* interrupted) {
        return static_cast<std::atomic<bool>*>(interrupted)->load() ? 1 : 0;
      },
      &interrupted_);
  add_row_checksum(database_.get());
  // Overwriting deleted rows with zeros would write many pages.
  execute(database_.get(), "PRAGMA secure_delete = OFF");
  // Applies to a new file only. Rows waste less space in pages of this size than in smaller ones.
  execute(database_.get(), "PRAGMA page_size = 8192");
  log_ = std::make_unique<WriteAheadLog>(database_.get());
  const DatabaseKind kind = identify(database_.get(), path);
  if (Statement journal(database_.get(), "PRAGMA journal_mode = WAL");
      !journal.step() || journal.text(0) != "wal") {
    throw StorageError("the file system of " + path + " cannot hold a write-ahead log");
  }
  execute(database_.get(), "PRAGMA synchronous = FULL");
  log_->rewrite();
  if (kind == DatabaseKind::kEmpty) {
    create_tables(database_.get());
  }
  prepare_schema(path);
  if (kind == DatabaseKind::kEmpty) {
    log_->merge();  // a new file is a complete database from the start
  }
  deletion_ = std::make_unique<StudyDeletion>(database_.get());
  in_transaction(true, [this] { deletion_->remove_orphans(); });
  statements_ = std::make_unique<Statements>(database_.get());
  ranges_ = std::make_unique<CompletedRanges>(database_.get());
  reuse_ = std::make_unique<ResultReuse>(database_.get(), *ranges_);
}

/// Creates the views, and refuses a file whose tables or triggers are not those of this schema.
void Store::prepare_schema(const std::string& path) {
  // A view in place of a table could return rows without end.
  if (const auto missing = missing_tables(database_.get()); !missing.empty()) {
    throw StorageError(fmt::format("{} lacks the table {}: `oblique check --db {}` tells more",
                                   path, fmt::join(missing, " and "), path));
  }
  // Checked before `create_views`, which may change rows. A trigger with the name of ours is
  // replaced there.
  auto triggers = other_triggers(database_.get());
  std::erase(triggers, "row_deleted");
  if (!triggers.empty()) {
    constexpr std::size_t kMostNames = 10;
    const std::size_t count = triggers.size();
    triggers.resize(std::min(count, kMostNames));
    throw StorageError(fmt::format(
        "{} has {} triggers that are not ours, and would run with each change of its rows: {}{}. "
        "Drop them, as with DROP TRIGGER in the program sqlite3",
        path, count, fmt::join(triggers, ", "), count > kMostNames ? " and more" : ""));
  }
  try {
    create_views(database_.get());
  } catch (const StorageGone&) {
    throw;
  } catch (const StorageError& error) {
    throw StorageError(
        fmt::format("the views of {} cannot be created: {}. If a table has the name of a view, "
                    "rename the table",
                    path, error.what()));
  }
}

Store::~Store() {
  try {
    files_->check();
    if (!sync_failed_) {
      log_->delete_on_close();
    }
  } catch (const StorageGone&) {
    // Another file is at the path. Our log must not remain beside it, so it is merged into the file
    // that this process has open.
    try {
      if (!sync_failed_) {
        log_->merge();
      }
    } catch (const StorageError&) {
      // The log stays.
    }
  }
}

void Store::guard_syncs(const std::function<void()>& work) {
  try {
    work();
  } catch (const StorageGone&) {
    sync_failed_ = true;
    throw;
  }
}

void Store::in_transaction(bool full_sync, const std::function<void()>& work) {
  guard_syncs([&] {
    if (full_sync != full_sync_) {
      execute(database_.get(),
              full_sync ? "PRAGMA synchronous = FULL" : "PRAGMA synchronous = NORMAL");
      full_sync_ = full_sync;
    }
    Transaction transaction(database_.get());
    work();
    transaction.commit();
  });
}

void Store::commit(std::span<const Change> changes) {
  try {
    in_transaction(std::ranges::any_of(changes, needs_full_sync), [&] {
      for (const Change& change : changes) {
        std::visit([this](const auto& kind) { add(kind); }, change);
      }
      ranges_->flush();
    });
  } catch (...) {
    models_.clear();
    ranges_->forget();
    throw;
  }
  files_->check();  // throws if the transaction went into a file that is no longer at the path
  guard_syncs([this] { log_->shorten(); });
}

bool Store::merge_log() {
  files_->check();
  bool is_merged = false;
  guard_syncs([&] { is_merged = log_->merge(); });
  return is_merged;
}

ClearedAway Store::clear_away(std::size_t most) {
  if (!deletion_->has_rows()) {
    return ClearedAway::kAll;
  }
  guard_syncs([this] { log_->shorten(); });
  if (log_->is_held_long()) {
    return ClearedAway::kMustWait;
  }
  // Without a sync: rows that a loss of power restores are deleted again.
  in_transaction(false, [&] { deletion_->delete_rows(most); });
  files_->check();
  return ClearedAway::kPart;
}

void Store::add(const AddStudy& change) {
  execute_with(database_.get(),
               "INSERT INTO studies (study_id, name, recipe, points, state, created_at, changed_at,"
               " priority, submitted_by, reuses, checksum)"
               " VALUES (?1, ?2, ?3, ?4, 'running', ?5, ?5, ?6, nullif(?7, ''), ?8,"
               " row_checksum(?1, ?2, ?3, ?4, ?5))",
               change.study_id, change.name, Blob{change.table.recipe_bytes()}, change.table.size(),
               change.created_at, change.priority, change.submitted_by, change.reuses);
}

void Store::add(const SetPriority& change) {
  execute_with(database_.get(), "UPDATE studies SET priority = ?2 WHERE study_id = ?1",
               change.study_id, change.priority);
}

void Store::add(const ForgetFailures& change) {
  if (!has_study(change.study_id)) {
    return;
  }
  ranges_->flush();
  const bool was_counted = ranges_->is_counted(change.study_id);
  // Consecutive failed points of one attempt have the same difference of point and row number.
  Statement note(database_.get(),
                 "INSERT INTO retries (study_id, first_point, points, attempt, retried_at)"
                 " SELECT ?1, min(point), count(*), attempt, ?4 FROM"
                 " (SELECT point, attempt,"
                 " point - row_number() OVER (PARTITION BY attempt ORDER BY point) AS run"
                 " FROM results INDEXED BY failed_points WHERE study_id = ?1"
                 " AND point >= ?2 AND point < ?3 AND error IS NOT NULL)"
                 " GROUP BY attempt, run");
  Statement forget(database_.get(),
                   "DELETE FROM results INDEXED BY failed_points WHERE study_id = ?1"
                   " AND point >= ?2 AND point < ?3 AND error IS NOT NULL RETURNING point");
  IntervalSet forgotten;
  change.points.for_each([&](const Interval& interval) {
    note.bind_all(change.study_id, interval.begin, interval.end, change.changed_at);
    note.run();
    forget.bind_all(change.study_id, interval.begin, interval.end);
    while (forget.step()) {
      forgotten.insert(static_cast<std::uint64_t>(forget.integer(0)));
    }
    forget.reset();
  });
  ranges_->remove(change.study_id, forgotten);
  if (was_counted) {  // the trigger has counted these deletions as those of another program
    ranges_->set_counted(change.study_id);
  }
  execute_with(database_.get(),
               "UPDATE studies SET state = 'running', changed_at = ?2"
               " WHERE study_id = ?1 AND state = 'done'",
               change.study_id, change.changed_at);
}

void Store::add(const GrowStudy& change) {
  execute_with(database_.get(),
               "UPDATE studies SET recipe = ?2, points = ?3, state = 'running', changed_at = ?4,"
               " priority = ?5, reuses = reuses OR ?6,"
               " checksum = row_checksum(study_id, name, ?2, ?3, created_at) WHERE study_id = ?1",
               change.study_id, Blob{change.table.recipe_bytes()}, change.table.size(),
               change.changed_at, change.priority, change.reuses);
}

void Store::add(const RenameStudy& change) {
  execute_with(database_.get(),
               "UPDATE studies SET name = ?2,"
               " checksum = row_checksum(study_id, ?2, recipe, points, created_at)"
               " WHERE study_id = ?1",
               change.study_id, change.name);
}

void Store::add(const SetStudyState& change) {
  execute_with(database_.get(),
               "UPDATE studies SET state = ?2, changed_at = ?3 WHERE study_id = ?1",
               change.study_id, std::string_view(state_name(change.state)), change.changed_at);
}

void Store::add(const AddWorker& change) {
  execute_with(database_.get(),
               "INSERT INTO workers (worker_id, name, threads, solver_version, instruction_set,"
               " joined_at) VALUES (?, ?, ?, ?, ?, ?)",
               change.worker_id, change.name, change.threads, change.solver_version,
               change.instruction_set, change.joined_at);
}

void Store::add(const AddResults& change) {
  if (!has_study(change.study_id)) {
    return;
  }
  solver::CaseResult outputs;
  for (const protocol::PointResult& result : change.results) {
    const protocol::Point point = protocol::inputs_of(result, *change.table);
    const bool is_solved = result.error().empty();
    if (is_solved) {
      outputs = protocol::from_message(result);
    }
    const ResultRow row{.study_id = change.study_id,
                        .point = result.point(),
                        .model_id = stored_model(change, point.model),
                        .inputs = point,
                        .result = is_solved ? &outputs : nullptr,
                        .error = result.error(),
                        .worker_id = change.worker_id,
                        .attempt = change.attempt,
                        .solved_at = change.solved_at};
    statements_->add_result.run(row);
    ranges_->add(change.study_id, result.point());  // also if it already had a row
  }
  if (const IntervalSet left_out = ranges_->open_points(change.study_id, change.left_out);
      !left_out.empty()) {
    left_out.for_each([&](const Interval& points) { ranges_->add(change.study_id, points); });
    execute_with(database_.get(), "UPDATE studies SET left_out = left_out + ?2 WHERE study_id = ?1",
                 change.study_id, left_out.size());
  }
}

/// False for a deleted study, of which late results may arrive.
bool Store::has_study(std::uint64_t study_id) {
  Statement& find = statements_->find_study;
  find.bind(1, study_id);
  const bool found = find.step();
  find.reset();
  return found;
}

/// The row of `models` that has model number `model` of the study. Inserts it if there is none.
std::int64_t Store::stored_model(const AddResults& change, std::uint64_t model) {
  const std::pair key{change.study_id, model};
  if (const auto known = models_.find(key); known != models_.end()) {
    return known->second;
  }
  const solver::ModelParameters parameters = change.table->model(model);
  const std::string definition = protocol::canonical_model(parameters);
  bind_model(statements_->add_model, parameters, definition);
  statements_->add_model.run();
  Statement& find = statements_->find_model;
  find.bind(1, definition);
  const std::int64_t id = find.step() ? find.integer(0) : 0;
  find.reset();
  if (models_.size() >= kMostCachedModels) {
    models_.clear();
  }
  models_.emplace(key, id);
  return id;
}

}  // namespace oblique::server
