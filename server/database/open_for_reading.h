#pragma once

#include <string>

#include "server/database/sqlite.h"

namespace oblique::server {

/// A database that is only read, and a remark on how.
struct OpenedForReading {
  DatabaseHandle database;
  std::string remark;  ///< a sentence; empty: nothing is unusual
};

/// Opens the database at `path` for reading only; does not check whether it is ours. SQLite may
/// create an index of the write-ahead log beside it. In a folder that cannot be written the
/// database is read without that file, including the rows in the log. Throws StorageError when
/// there is no such file or it cannot be opened.
OpenedForReading open_for_reading(const std::string& path);

/// The same, but never creates or changes a file beside it and never waits for a lock. If there is
/// a log without its index, the index is made in memory. If there is no log, the database is read
/// without locks, and writes by another program are not noticed.
DatabaseHandle open_without_traces(const std::string& path);

/// As `open_for_reading`; throws StorageError, which says what was found, unless the file is a
/// database of ours with tables.
OpenedForReading open_stored(const std::string& path);

}  // namespace oblique::server
