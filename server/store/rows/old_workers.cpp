#include "server/store/rows/old_workers.h"

#include <string_view>

namespace oblique::server {

OldWorkers::OldWorkers(sqlite3* database)
    : database_(database),
      find_(database, "SELECT solver_version, instruction_set FROM workers WHERE worker_id = ?"),
      insert_(database,
              "INSERT INTO workers (worker_id, name, threads, solver_version, instruction_set,"
              " joined_at, checksum) SELECT n, 'of an older schema', 1, ?1, ?2, '',"
              " row_checksum(n, 'of an older schema', 1, ?1, ?2, '')"
              " FROM (SELECT coalesce(max(worker_id), 0) + 1 AS n FROM workers)") {}

std::int64_t OldWorkers::number_of(std::int64_t worker, const std::string& solver_version,
                                   const std::string& instruction_set) {
  const auto is_of_this = [&](const Solver& solver) {
    return solver.first == solver_version && solver.second == instruction_set;
  };
  auto known = known_.find(worker);
  if (known == known_.end()) {
    find_.bind(1, worker);
    const bool is_there = find_.step();
    known =
        known_.emplace(worker, is_there ? Solver(find_.text(0), find_.text(1)) : Solver()).first;
    find_.reset();
  }
  if (is_of_this(known->second)) {
    return worker;
  }
  const auto [made, is_new] = made_.try_emplace({solver_version, instruction_set}, 0);
  if (is_new) {
    insert_.bind(1, std::string_view(solver_version));
    insert_.bind(2, std::string_view(instruction_set));
    insert_.run();
    made->second = sqlite3_last_insert_rowid(database_);
  }
  return made->second;
}

}  // namespace oblique::server
