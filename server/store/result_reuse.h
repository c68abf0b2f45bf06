#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>

#include "server/database/sqlite.h"
#include "server/store/changes.h"
#include "server/store/completed_ranges.h"
#include "server/store/result_rows.h"

namespace oblique::server {

/// Carries out ReuseResults: looks up the open points of a study among the solved points of others,
/// by the index `solved_points`, and copies the rows that it finds. A copy differs from its source
/// only in its study, its point and `reused_from`.
///
/// A row is copied only if its checksum is right. Rows that were edited by hand have none and are
/// not copied.
class ResultReuse {
 public:
  /// All must outlive this.
  ResultReuse(sqlite3* database, CompletedRanges& ranges);

  /// Fills in `change.outcome`. Throws StorageError.
  void run(const ReuseResults& change);
  void end(const EndReuse& change);

 private:
  /// A study that rows are copied from.
  struct Source {
    std::string name;
    bool wants_errors = false;
    std::uint64_t copied = 0;  ///< rows
  };

  std::uint64_t first_open(std::uint64_t study_id, std::uint64_t point);
  std::int64_t stored_model(const protocol::PointTable& table, std::uint64_t model);
  void reuse(const ReuseResults& change, std::uint64_t point, std::int64_t model_id);
  Source* source_of(std::uint64_t study_id);
  void count_origins(const ReuseResults& change);

  sqlite3* database_;
  CompletedRanges& ranges_;
  Statement model_;
  Statement find_;
  Statement copy_;
  Statement source_;
  // Valid for one change: later, studies may have other names and models may be deleted.
  std::map<std::uint64_t, std::optional<Source>> sources_;
  std::unordered_map<std::uint64_t, std::int64_t> models_;  // row by model number; 0: none
  /// By study, whether it requests estimated errors, which never changes.
  std::map<std::uint64_t, bool> wants_errors_;
};

}  // namespace oblique::server
