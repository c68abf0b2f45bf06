#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/database/sqlite.h"
#include "server/store/rows/old_workers.h"
#include "server/store/rows/packed_row.h"
#include "worker/solver/model/case_result.h"

namespace oblique::server {

/// Makes packed rows of rows of the table `results`, as schemas before `kFirstPacked` had it.
class OldRows {
 public:
  /// The connection must have `model_definition` and its models that schema's definitions.
  OldRows(sqlite3* database, int schema);

  /// What `pack` needs, as a list for SQL.
  static std::string columns_sql(int schema);

  /// Makes `to` the row whose columns stand from `first` on in `row`; model and worker are the
  /// numbers that stood there. False when that cannot be: outputs are missing, or a list is none.
  bool pack(const Statement& row, int first, TextNumbers& texts, PackedRow& to);

  /// Gives a solved row that was made of that one, with its worker's number in the present
  /// database, the worker that says of which solver it is.
  static void name_worker(const Statement& row, int first, OldWorkers& workers, PackedRow& packed);

  static std::string solver_version(const Statement& row, int first);  ///< empty: none

 private:
  double accuracy_of_model(std::int64_t model_id);
  bool read_outputs(const Statement& row, int first);
  bool read_lists(const Statement& row, int first);

  int schema_;
  Statement definition_;
  std::unordered_map<std::int64_t, double> accuracies_;  // some of them
  solver::CaseResult result_{};
  std::vector<double> numbers_;
};

}  // namespace oblique::server
