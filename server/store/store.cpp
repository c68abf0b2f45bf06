#include "server/store/store.h"

#include <algorithm>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/point_table.h"
#include "server/store/schema.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMaxCachedModels = 65536;
/// Number of instructions of SQLite's virtual machine between checks for an interrupt: about 10 us.
constexpr int kStepsBetweenInterrupts = 1000;

}  // namespace

Store::Store(const std::string& path)
    : file_(path), database_(open_database(path, SQLITE_OPEN_READWRITE)) {
  sqlite3* const database = database_.get();
  sqlite3_progress_handler(
      database, kStepsBetweenInterrupts,
      [](void* interrupted) {
        return static_cast<std::atomic<bool>*>(interrupted)->load() ? 1 : 0;
      },
      &interrupted_);
  // Disables triggers: those of other programs might never end, and ours only serves other
  // programs.
  sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(database, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  // Does not overwrite deleted rows with zeros, because that would write many pages.
  execute(database, "PRAGMA secure_delete = OFF");
  // Applies to a new file only. Rows waste less space in pages of this size.
  execute(database, "PRAGMA page_size = 8192");
  log_ = std::make_unique<WriteAheadLog>(database);
  const DatabaseKind kind = identify(database, path);
  if (Statement journal(database, "PRAGMA journal_mode = WAL");
      !journal.step() || journal.text(0) != "wal") {
    throw StorageError("the file system of " + path + " cannot hold a write-ahead log");
  }
  execute(database, "PRAGMA synchronous = FULL");
  log_->rewrite();
  if (kind == DatabaseKind::kEmpty) {
    create_tables(database);
    log_->merge();  // empties the log, so that the new file contains the whole database
  }
  restore_schema(database, path);
  in_transaction(true, [this] {
    count_completed_points(database_.get());
    remove_orphans();
  });
  statements_ = std::make_unique<Statements>(database);
  ranges_ = std::make_unique<CompletedRanges>(database);
}

Store::~Store() {
  try {
    file_.check();
    if (!sync_failed_) {
      log_->delete_on_close();
    }
  } catch (const StorageGone&) {
    // The path belongs to another file now. Our log must not remain beside that file, so it is
    // merged into the file that is open.
    try {
      if (!sync_failed_) {
        log_->merge();
      }
    } catch (const StorageError&) {
      // The log remains, and nothing can be done about that.
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
  // Throws if another file is now at the path, because the transaction is then lost.
  file_.check();
  guard_syncs([this] { log_->shorten(); });
}

void Store::write(const std::function<void()>& work) {
  in_transaction(true, work);
  file_.check();
  guard_syncs([this] { log_->shorten(); });
}

bool Store::merge_log() {
  file_.check();
  bool is_merged = false;
  guard_syncs([&] { is_merged = log_->merge(); });
  return is_merged;
}

// ---- Deletion -----------------------------------------------------------------------------------

void Store::add(const DeleteStudy& change) {
  for (const char* sql :
       {"INSERT OR IGNORE INTO deletions (study_id) VALUES (?1)",
        "DELETE FROM reused_points WHERE study_id = ?1", "DELETE FROM studies WHERE study_id = ?1",
        "UPDATE about SET has_orphans = 1 WHERE ?1"}) {
    execute_with(database_.get(), sql, change.study_id);
  }
}

ClearedAway Store::clear_away(std::size_t most) {
  const std::uint64_t study = number("SELECT coalesce(min(study_id), 0) FROM deletions");
  if (study == 0) {
    return ClearedAway::kAll;
  }
  guard_syncs([this] { log_->shorten(); });
  if (log_->is_held_long()) {
    return ClearedAway::kMustWait;
  }
  const auto delete_some = [&](const char* sql, std::size_t rows) {
    execute_with(database_.get(), sql, study, rows);
    return static_cast<std::size_t>(sqlite3_changes(database_.get()));
  };
  std::size_t results = 0;
  // No sync is needed: if a power failure restores the rows, they are deleted again.
  in_transaction(false, [&] {
    results = delete_some(
        "DELETE FROM results WHERE study_id = ?1 AND point IN"
        " (SELECT point FROM results WHERE study_id = ?1 ORDER BY point LIMIT ?2)",
        most);
    const std::size_t ranges = delete_some(
        "DELETE FROM completed_ranges WHERE study_id = ?1 AND first_point IN (SELECT first_point"
        " FROM completed_ranges WHERE study_id = ?1 ORDER BY first_point LIMIT ?2)",
        most - results);
    if (results + ranges < most) {
      execute_with(database_.get(), "DELETE FROM deletions WHERE study_id = ?", study);
    }
  });
  cleared_rows_ += results;
  file_.check();
  return ClearedAway::kPart;
}

/// Deletes models and workers that have no rows, once all rows of deleted studies are gone. Reads
/// all rows of the file. Must be called at a start only, before any model or worker is in use.
void Store::remove_orphans() {
  if (number("SELECT has_orphans AND NOT EXISTS (SELECT 1 FROM deletions) FROM about") == 0) {
    return;
  }
  execute(database_.get(), R"sql(
    CREATE TEMP TABLE used AS SELECT DISTINCT model_id, worker_id FROM results;
    DELETE FROM models WHERE model_id NOT IN (SELECT model_id FROM used);
    DELETE FROM workers WHERE worker_id NOT IN (SELECT worker_id FROM used WHERE worker_id IS NOT NULL);
    DROP TABLE used;
    UPDATE about SET has_orphans = 0;
  )sql");
}

// ---- Other changes ------------------------------------------------------------------------------

void Store::add(const AddStudy& change) {
  protocol::Recipe recipe;
  recipe.ParseFromString(change.table.recipe_bytes());
  execute_with(database_.get(),
               "INSERT INTO studies (study_id, name, recipe, points, errors, state, created_at,"
               " changed_at, priority, submitted_by, reuses, uid, checksum)"
               " VALUES (?1, ?2, ?3, ?4, ?5, 'running', ?6, ?6, ?7, nullif(?8, ''), ?9, ?10,"
               " row_checksum(?1, ?3, ?4, ?5, ?6))",
               change.study_id, change.name, Blob{change.table.recipe_bytes()}, change.table.size(),
               recipe.errors(), change.created_at, change.priority, change.submitted_by,
               change.reuses, change.uid);
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
  Statement forget(database_.get(),
                   "DELETE FROM results INDEXED BY failed_points WHERE study_id = ?1"
                   " AND point >= ?2 AND point < ?3 AND error IS NOT NULL RETURNING point");
  IntervalSet forgotten;
  change.points.for_each([&](const Interval& interval) {
    forget.bind_all(change.study_id, interval.begin, interval.end);
    while (forget.step()) {
      forgotten.insert(forget.number(0));
    }
    forget.reset();
  });
  ranges_->remove(change.study_id, forgotten);
  execute_with(database_.get(),
               "UPDATE studies SET state = 'running', changed_at = ?2"
               " WHERE study_id = ?1 AND state = 'done'",
               change.study_id, change.changed_at);
}

void Store::add(const GrowStudy& change) {
  execute_with(database_.get(),
               "UPDATE studies SET recipe = ?2, points = ?3, state = 'running', changed_at = ?4,"
               " priority = ?5, reuses = reuses OR ?6,"
               " checksum = row_checksum(study_id, ?2, ?3, errors, created_at) WHERE study_id = ?1",
               change.study_id, Blob{change.table.recipe_bytes()}, change.table.size(),
               change.changed_at, change.priority, change.reuses);
}

void Store::add(const RenameStudy& change) {
  execute_with(database_.get(), "UPDATE studies SET name = ?2 WHERE study_id = ?1", change.study_id,
               change.name);
}

void Store::add(const EndReuse& change) {
  execute_with(database_.get(), "UPDATE studies SET reuses = 0 WHERE study_id = ?",
               change.study_id);
}

void Store::add(const SetStudyState& change) {
  execute_with(database_.get(),
               "UPDATE studies SET state = ?2, changed_at = ?3 WHERE study_id = ?1",
               change.study_id, std::string_view(state_name(change.state)), change.changed_at);
}

void Store::add(const AddWorker& change) {
  execute_with(database_.get(),
               "INSERT INTO workers (worker_id, name, threads, solver_version, instruction_set,"
               " joined_at, checksum)"
               " VALUES (?1, ?2, ?3, ?4, ?5, ?6, row_checksum(?2, ?3, ?4, ?5, ?6))",
               change.worker_id, change.name, change.threads, change.solver_version,
               change.instruction_set, change.joined_at);
}

void Store::add(const AddResults& change) {
  if (!has_study(change.study_id)) {
    return;
  }
  for (const protocol::PointResult& result : change.results) {
    const protocol::Point inputs = protocol::inputs_of(result, *change.table);
    statements_->add_result.run(change, result, inputs, stored_model(change, inputs.model));
    ranges_->add(change.study_id, result.point());  // even if the point already had a row
  }
  if (const IntervalSet left_out = ranges_->open_points(change.study_id, change.left_out);
      !left_out.empty()) {
    left_out.for_each([&](const Interval& points) { ranges_->add(change.study_id, points); });
    execute_with(database_.get(), "UPDATE studies SET left_out = left_out + ?2 WHERE study_id = ?1",
                 change.study_id, left_out.size());
  }
}

/// Returns false for a deleted study, for which late results may arrive.
bool Store::has_study(std::uint64_t study_id) {
  Statement& find = statements_->find_study;
  find.bind(1, study_id);
  const bool found = find.step();
  find.reset();
  return found;
}

/// Returns the row number in `models` of the study's model `model`. Inserts a missing row.
std::int64_t Store::stored_model(const AddResults& change, std::uint64_t model) {
  if (models_.size() >= kMaxCachedModels) {
    models_.clear();
  }
  const auto [known, is_new] = models_.emplace(std::pair{change.study_id, model}, 0);
  if (is_new) {
    known->second = statements_->models.find_or_insert(change.table->model(model));
  }
  return known->second;
}

}  // namespace oblique::server
