#include "server/store/store.h"

#include <algorithm>
#include <optional>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/canonical.h"
#include "proto/recipe/point_inputs.h"
#include "proto/result_message.h"
#include "server/database/row_checksum.h"
#include "server/store/rows/model_rows.h"
#include "server/store/rows/packed_row.h"
#include "server/store/rows/row_columns.h"
#include "server/store/schema/schema_setup.h"

namespace oblique::server {
namespace {

constexpr int kBusyTimeout_ms = 2000;
constexpr std::size_t kMostCachedModels = 65536;
/// Of SQLite's virtual machine, whether the statement is interrupted: some 10 us.
constexpr int kStepsBetweenLooks = 1000;

/// While it lives the connection waits for no other one.
class Impatience {
 public:
  explicit Impatience(sqlite3* database) : database_(database) {
    sqlite3_busy_timeout(database_, 0);
  }
  ~Impatience() { sqlite3_busy_timeout(database_, kBusyTimeout_ms); }
  Impatience(const Impatience&) = delete;
  Impatience& operator=(const Impatience&) = delete;

 private:
  sqlite3* database_;
};

// Whether losing power must not undo a change: results are solved again, and what people asked for
// would be gone.
bool is_lasting(const AddStudy& /*change*/) {
  return true;
}
bool is_lasting(const SetStudyState& /*change*/) {
  return true;
}
bool is_lasting(const SetStudyTerms& /*change*/) {
  return true;
}
bool is_lasting(const ForgetFailures& /*change*/) {
  return true;
}
bool is_lasting(const GrowStudy& /*change*/) {
  return true;
}
bool is_lasting(const RenameStudy& /*change*/) {
  return true;
}
bool is_lasting(const ReuseResults& /*change*/) {
  return false;
}
bool is_lasting(const EndTaking& /*change*/) {
  return false;
}
bool is_lasting(const DeleteStudy& /*change*/) {
  return true;
}
bool is_lasting(const AddWorker& /*change*/) {
  return false;
}
bool is_lasting(const AddResults& /*change*/) {
  return false;
}

}  // namespace

struct Store::Statements {
  explicit Statements(sqlite3* database)
      : add_study(database,
                  "INSERT INTO studies (study_id, name, recipe, points, state, created_at,"
                  " changed_at, priority, weight, mixes_versions, checksum, submitted_by, counted, "
                  "takes_over)"
                  " VALUES (?1, ?2, ?3, ?4, 'running', ?5, ?5, ?6, ?7, ?8,"
                  " row_checksum(?1, ?2, ?3, ?4, ?5), nullif(?9, ''), 1, ?10)"),
        set_state(database, "UPDATE studies SET state = ?2, changed_at = ?3 WHERE study_id = ?1"),
        set_terms(database,
                  "UPDATE studies SET priority = ?2, weight = ?3, mixes_versions = ?4"
                  " WHERE study_id = ?1"),
        note_retries(database,
                     // Neighbours of one attempt have one difference between number and rank.
                     "INSERT INTO retries (study_id, first_point, points, attempt, retried_at)"
                     " SELECT ?1, min(point), count(*), attempt, ?4 FROM"
                     " (SELECT point, attempt,"
                     " point - row_number() OVER (PARTITION BY attempt ORDER BY point) AS run"
                     " FROM packed_results INDEXED BY failed_points WHERE study_id = ?1"
                     " AND point >= ?2 AND point < ?3 AND error IS NOT NULL)"
                     " GROUP BY attempt, run"),
        forget_failures(database,
                        "DELETE FROM packed_results INDEXED BY failed_points WHERE study_id = ?1 "
                        "AND point >= ?2"
                        " AND point < ?3 AND error IS NOT NULL"),
        reopen(database,
               "UPDATE studies SET state = 'running', changed_at = ?2"
               " WHERE study_id = ?1 AND state = 'done'"),
        grow(database,
             "UPDATE studies SET recipe = ?2, points = ?3, state = 'running', changed_at = ?4,"
             " priority = ?5, weight = ?6, mixes_versions = ?7, takes_over = takes_over OR ?8,"
             " checksum = row_checksum(study_id, name, ?2, ?3, created_at) WHERE study_id = ?1"),
        rename(database,
               "UPDATE studies SET name = ?2,"
               " checksum = row_checksum(study_id, ?2, recipe, points, created_at)"
               " WHERE study_id = ?1"),
        rename_origin(database, "UPDATE origins SET name = ?2 WHERE origin_id = ?1"),
        add_worker(database,
                   "INSERT INTO workers (worker_id, name, threads, solver_version,"
                   " instruction_set, joined_at, checksum) VALUES (?1, ?2, ?3, ?4, ?5, ?6,"
                   " row_checksum(?1, ?2, ?3, ?4, ?5, ?6))"),
        note_left_out(database, "UPDATE studies SET left_out = left_out + ?2 WHERE study_id = ?1"),
        find_study(database, "SELECT 1 FROM studies WHERE study_id = ?"),
        find_model(database, "SELECT model_id FROM models WHERE definition = ?"),
        add_model(database, insert_model_sql()),
        texts(database),
        add_result(database) {}

  Statement add_study;
  Statement set_state;
  Statement set_terms;
  Statement note_retries;
  Statement forget_failures;
  Statement reopen;
  Statement grow;
  Statement rename;
  Statement rename_origin;
  Statement add_worker;
  Statement note_left_out;
  Statement find_study;
  Statement find_model;
  Statement add_model;
  TextNumbers texts;
  RowInsert add_result;
  PackedRow row;
};

Store::Store(const std::string& path) {
  check_path(path);
  files_ = std::make_unique<DatabaseFiles>(path);
  database_ = open_database(path, SQLITE_OPEN_READWRITE);
  sqlite3_busy_timeout(database_.get(), kBusyTimeout_ms);
  sqlite3_progress_handler(
      database_.get(), kStepsBetweenLooks,
      [](void* interrupted) {
        return static_cast<std::atomic<bool>*>(interrupted)->load() ? 1 : 0;
      },
      &interrupted_);
  add_row_checksum(database_.get());
  // Zeros over what is deleted would go through the log, page by page.
  execute(database_.get(), "PRAGMA secure_delete = OFF");
  log_ = std::make_unique<WriteAheadLog>(database_.get());
  const DatabaseKind kind = identify(database_.get(), path);
  if (auto triggers = other_triggers(database_.get()); !triggers.empty()) {
    constexpr std::size_t kMostNames = 10;
    const std::size_t count = triggers.size();
    triggers.resize(std::min(count, kMostNames));
    throw StorageError(fmt::format(
        "{} has {} triggers that are not ours, and would run with each change of its rows: {}{}. "
        "Drop them, as with DROP TRIGGER in the program sqlite3",
        path, count, fmt::join(triggers, ", "), count > kMostNames ? " and more" : ""));
  }
  if (Statement journal(database_.get(), "PRAGMA journal_mode = WAL");
      !journal.step() || journal.text(0) != "wal") {
    throw StorageError("the file system of " + path + " cannot hold a write-ahead log");
  }
  execute(database_.get(), "PRAGMA synchronous = FULL");
  log_->make_sure();
  if (kind == DatabaseKind::kEmpty) {
    create_tables(database_.get());
  }
  // A view in the place of one could be read without end.
  if (const auto missing = missing_tables(database_.get()); !missing.empty()) {
    throw StorageError(fmt::format("{} lacks the table {}: `oblique check --db {}` tells more",
                                   path, fmt::join(missing, " and "), path));
  }
  try {
    create_views(database_.get());
  } catch (const StorageError& error) {
    throw StorageError(
        fmt::format("the views of {} cannot be created: {}. If a table has the name of a view, "
                    "rename the table",
                    path, error.what()));
  }
  if (kind == DatabaseKind::kEmpty) {
    log_->merge();  // a new file is a whole database from the start
  }
  deletion_ = std::make_unique<StudyDeletion>(database_.get());
  {
    Transaction transaction(database_.get());
    deletion_->remove_orphans();
    transaction.commit();
  }
  statements_ = std::make_unique<Statements>(database_.get());
  settled_ = std::make_unique<SettledRuns>(database_.get());
  reuse_ = std::make_unique<ResultReuse>(database_.get(), *settled_);
}

Store::~Store() {
  try {
    files_->check();
    log_->before_closing();
  } catch (const StorageGone&) {
    // What was acknowledged goes into our own file, wherever that is: the next program at the path
    // must not find our log beside another database.
    try {
      log_->merge();
    } catch (const StorageError&) {
      // Nothing more can be done for it.
    }
  }
}

void Store::set_sync(bool full) {
  if (full != full_sync_) {
    execute(database_.get(), full ? "PRAGMA synchronous = FULL" : "PRAGMA synchronous = NORMAL");
    full_sync_ = full;
  }
}

void Store::commit(std::span<const Change> changes) {
  const bool any_is_lasting = std::ranges::any_of(changes, [](const Change& change) {
    return std::visit([](const auto& kind) { return is_lasting(kind); }, change);
  });
  try {
    log_->make_sure();
    set_sync(any_is_lasting);
    Transaction transaction(database_.get());
    for (const Change& change : changes) {
      std::visit([this](const auto& kind) { add(kind); }, change);
    }
    settled_->flush();
    transaction.commit();
    files_->check();  // or it was committed to a file that nobody will find
    log_->shorten();
  } catch (...) {
    models_.clear();
    statements_->texts.forget();
    settled_->forget();
    log_->suspect();
    throw;
  }
}

bool Store::merge_log() {
  files_->check();
  // A reader may take long, and results would wait.
  const Impatience impatience(database_.get());
  return log_->merge();
}

ClearedAway Store::clear_away(std::size_t most) {
  if (!deletion_->has_rows()) {
    return ClearedAway::kAll;
  }
  try {
    log_->make_sure();
    log_->shorten();
    if (log_->is_held_long()) {
      return ClearedAway::kMustWait;
    }
    set_sync(false);  // what losing power undoes is deleted again
    Transaction transaction(database_.get());
    deletion_->delete_rows(most);
    transaction.commit();
    files_->check();
  } catch (...) {
    log_->suspect();
    throw;
  }
  return ClearedAway::kPart;
}

void Store::add(const AddStudy& change) {
  Statement& insert = statements_->add_study;
  insert.bind(1, change.study_id);
  insert.bind(2, change.name);
  insert.bind_blob(3, change.table.recipe_bytes());
  insert.bind(4, change.table.size());
  insert.bind(5, change.created_at);
  insert.bind(6, std::int64_t{change.terms.priority});
  insert.bind(7, change.terms.weight);
  insert.bind(8, std::int64_t{change.terms.mixes_versions});
  insert.bind(9, change.submitted_by);
  insert.bind(10, std::int64_t{change.takes_over});
  insert.run();
}

void Store::add(const SetStudyTerms& change) {
  Statement& update = statements_->set_terms;
  update.bind(1, change.study_id);
  update.bind(2, std::int64_t{change.terms.priority});
  update.bind(3, change.terms.weight);
  update.bind(4, std::int64_t{change.terms.mixes_versions});
  update.run();
}

void Store::add(const ForgetFailures& change) {
  if (!has_study(change.study_id)) {
    return;
  }
  settled_->flush();
  const bool was_doubtful = settled_->is_doubtful(change.study_id);
  change.points.for_each([&](const Interval& interval) {
    Statement& note = statements_->note_retries;
    note.bind(1, change.study_id);
    note.bind(2, interval.begin);
    note.bind(3, interval.end);
    note.bind(4, change.changed_at);
    note.run();
    Statement& forget = statements_->forget_failures;
    forget.bind(1, change.study_id);
    forget.bind(2, interval.begin);
    forget.bind(3, interval.end);
    forget.run();
    settled_->look_again(change.study_id, interval, was_doubtful);
  });
  Statement& reopen = statements_->reopen;
  reopen.bind(1, change.study_id);
  reopen.bind(2, change.changed_at);
  reopen.run();
}

void Store::add(const GrowStudy& change) {
  Statement& update = statements_->grow;
  update.bind(1, change.study_id);
  update.bind_blob(2, change.table.recipe_bytes());
  update.bind(3, change.table.size());
  update.bind(4, change.changed_at);
  update.bind(5, std::int64_t{change.terms.priority});
  update.bind(6, change.terms.weight);
  update.bind(7, std::int64_t{change.terms.mixes_versions});
  update.bind(8, std::int64_t{change.takes_over});
  update.run();
}

void Store::add(const RenameStudy& change) {
  for (Statement* update : {&statements_->rename, &statements_->rename_origin}) {
    update->bind(1, change.study_id);
    update->bind(2, change.name);
    update->run();
  }
}

void Store::add(const DeleteStudy& change) {
  deletion_->remove(change.study_id);
}

void Store::add(const SetStudyState& change) {
  Statement& update = statements_->set_state;
  update.bind(1, change.study_id);
  update.bind(2, std::string_view(state_name(change.state)));
  update.bind(3, change.changed_at);
  update.run();
}

void Store::add(const AddWorker& change) {
  Statement& insert = statements_->add_worker;
  insert.bind(1, change.worker_id);
  insert.bind(2, change.name);
  insert.bind(3, std::uint64_t{change.threads});
  insert.bind(4, change.solver_version);
  insert.bind(5, change.instruction_set);
  insert.bind(6, change.joined_at);
  insert.run();
}

void Store::add(const AddResults& change) {
  if (!has_study(change.study_id)) {
    return;
  }
  PackedRow& row = statements_->row;
  for (const protocol::PointResult& result : change.results) {
    const protocol::Point point = protocol::inputs_of(result, *change.table);
    const StoredModel model = stored_model(change, point.model);
    const RowContext context{change.study_id, model.id,         model.accuracy, point,
                             result.point(),  change.worker_id, change.attempt, change.solved_at};
    if (result.error().empty()) {
      const solver::CaseResult outputs = protocol::from_message(result);
      row.pack(context, &outputs, {}, statements_->texts);
    } else {
      row.pack(context, nullptr, result.error(), statements_->texts);
    }
    if (statements_->add_result.run(row)) {  // else the point has a row already
      settled_->add(change.study_id, {result.point(), result.point() + 1});
    }
  }
  if (!change.left_out.empty()) {
    change.left_out.for_each(
        [&](const Interval& points) { settled_->add(change.study_id, points); });
    Statement& note = statements_->note_left_out;
    note.bind(1, change.study_id);
    note.bind(2, change.left_out.size());
    note.run();
  }
}

/// False for a deleted study: results of it are late ones.
bool Store::has_study(std::uint64_t study_id) {
  Statement& find = statements_->find_study;
  find.bind(1, study_id);
  const bool found = find.step();
  find.reset();
  return found;
}

Store::StoredModel Store::stored_model(const AddResults& change, std::uint64_t model) {
  const std::pair key{change.study_id, model};
  if (const auto known = models_.find(key); known != models_.end()) {
    return known->second;
  }
  const solver::ModelParameters parameters = change.table->model(model);
  const std::string definition = protocol::canonical_model(parameters);
  bind_model(statements_->add_model, parameters, definition);
  statements_->add_model.run();
  const bool is_new = sqlite3_changes(database_.get()) > 0;
  const std::int64_t id =
      is_new ? sqlite3_last_insert_rowid(database_.get()) : known_model(definition);
  const StoredModel stored{id, accuracy_of(parameters)};
  if (models_.size() >= kMostCachedModels) {
    models_.clear();
  }
  models_.emplace(key, stored);
  return stored;
}

std::int64_t Store::known_model(std::string_view definition) {
  Statement& find = statements_->find_model;
  find.bind(1, definition);
  const std::int64_t id = find.step() ? find.integer(0) : 0;
  find.reset();
  return id;
}

}  // namespace oblique::server
