#pragma once

#include <string>

#include "server/database/sqlite.h"

namespace oblique::server {

/// A database that is only read, and what there is to say of how.
struct OpenedForReading {
  DatabaseHandle database;
  std::string remark;  ///< a sentence for people; empty: nothing is unusual
};

/// Opens the database at `path`, whose contents may be anything, for reading only; nothing is
/// changed beside it either where that is possible. SQLite wants to put an index of the write-ahead
/// log beside a database; where nothing can be written, in a folder of somebody else or on a
/// read-only disk, it is read without one, rows in the log included. Throws StorageError when there
/// is no such file or it cannot be opened.
OpenedForReading open_for_reading(const std::string& path);

/// The same, and surely nothing is made or changed beside it, and nobody is waited for: where a log
/// lies beside it without its index, its rows are read into memory, and where none does, the
/// database is read without regard to who may begin to write to it.
DatabaseHandle open_without_traces(const std::string& path);

/// As `open_for_reading` for a database that is ours and has had a study stored in it; throws
/// StorageError, saying what it is instead, for any other.
OpenedForReading open_stored(const std::string& path);

}  // namespace oblique::server
