#include "server/care/merge.h"

#include <spdlog/fmt/fmt.h>

#include "proto/frames.h"
#include "server/care/merged_rows.h"
#include "server/care/merged_studies.h"
#include "server/database/open_for_reading.h"
#include "server/database/row_checksum.h"
#include "server/database/sqlite.h"
#include "server/store/schema/schema_setup.h"
#include "server/store/store.h"

namespace oblique::server {
namespace {

/// Views and columns that are computed can hold anything, without end. A value that a server stores
/// came in one message.
void bound_what_is_read(sqlite3* source) {
  sqlite3_limit(source, SQLITE_LIMIT_LENGTH, static_cast<int>(2 * protocol::kMaxFrameBytes));
  const std::string tables =
      fmt::format("COLLATE NOCASE IN ('{}')", fmt::join(our_tables(), "', '"));
  Statement list(source,
                 fmt::format("SELECT t.name FROM pragma_table_list AS t WHERE t.name {}"
                             " AND (t.type <> 'table' OR NOT t.strict OR EXISTS"
                             " (SELECT 1 FROM pragma_table_xinfo(t.name) WHERE hidden > 1))",
                             tables));
  if (list.step()) {
    throw StorageError(fmt::format("{} in it is no table as servers make it", list.text(0)));
  }
}

}  // namespace

struct Merger::Parts {
  explicit Parts(const std::string& path)
      : target(path), database(open_database(path, SQLITE_OPEN_READWRITE)) {
    add_row_checksum(database.get());
    // The store makes the checkpoints; pages that do not fit into so many KiB go to the log.
    execute(database.get(), "PRAGMA wal_autocheckpoint = 0");
    execute(database.get(), "PRAGMA synchronous = FULL");
    execute(database.get(), "PRAGMA cache_size = -65536");
    sqlite3_db_config(database.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  }

  Store target;  // has the schema, and the lock
  DatabaseHandle database;
};

Merger::Merger(const std::string& target) : parts_(std::make_unique<Parts>(target)) {}
Merger::~Merger() = default;

Merged Merger::merge(const std::string& source, const MergeSettings& settings,
                     const Progress& progress) {
  const OpenedForReading opened = open_stored(source);
  sqlite3* const from = opened.database.get();
  sqlite3* const to = parts_->database.get();
  add_row_checksum(from);
  Merged merged;
  if (!opened.remark.empty()) {
    merged.remarks.push_back(opened.remark);
  }
  try {
    bound_what_is_read(from);
    execute(from, "BEGIN");  // one instant of it, whatever a server writes meanwhile
    Transaction transaction(to);
    StudyPlaces places = place_studies(from, to, settings, merged);
    merge_rows(from, to, places, merged, progress);
    settle_studies(from, to, places);
    parts_->target.check();
    transaction.commit();
  } catch (const MergeRefused& error) {
    throw MergeRefused(fmt::format("{} was not merged: {}", source, error.what()));
  } catch (const StorageGone&) {
    throw;
  } catch (const StorageError& error) {
    throw StorageError(fmt::format("{} was not merged: {}", source, error.what()));
  }
  parts_->target.check();
  return merged;
}

bool Merger::finish() {
  return parts_->target.merge_log();
}

}  // namespace oblique::server
