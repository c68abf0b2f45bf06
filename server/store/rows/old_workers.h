#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "server/database/sqlite.h"

namespace oblique::server {

/// Rows of schemas before `kFirstPacked` said themselves of which solver they are; now their worker
/// does. Where both said different things, or no worker is known, there is another worker for them.
class OldWorkers {
 public:
  /// The connection must have `row_checksum`.
  explicit OldWorkers(sqlite3* database);

  /// The number of the worker for a row that names `worker` (0: none) and says this of its solver.
  /// Throws StorageError.
  std::int64_t number_of(std::int64_t worker, const std::string& solver_version,
                         const std::string& instruction_set);

 private:
  using Solver = std::pair<std::string, std::string>;  // version and instruction set

  sqlite3* database_;
  Statement find_;
  Statement insert_;
  std::map<std::int64_t, Solver> known_;  // by worker
  std::map<Solver, std::int64_t> made_;
};

}  // namespace oblique::server
