#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "server/database/sqlite.h"

namespace oblique::server {

/// The first schema whose rows have checksums. Outputs of later ones stand behind all other columns
/// in them, where rows that lack them have the checksum that they always had.
inline constexpr int kFirstWithChecksums = 4;

/// The statement that inserts one row into `results` unless the point has one; `bind_result` binds
/// it. The connection must have `row_checksum`.
std::string insert_result_sql();

/// The columns of `results` but the checksum, which a database of that schema has, in the order in
/// which they count in it.
std::vector<std::string_view> result_columns(int schema);

/// What `checksum` of a row of `results` must be, as an expression over the columns that a database
/// of that schema has. Those of outputs that a later schema brought come last, and so count only
/// where they are not NULL: earlier rows keep their checksums.
std::string result_checksum_sql(int schema);
/// The same for `studies`.
std::string study_checksum_sql();

/// The columns of outputs, in no particular order, that schemas up to this one brought. A failed
/// row lacks them, and a solved one has those that are older than it.
std::vector<std::string> output_columns(int schema);

/// What stands in a row of `results` beside the outputs of the solver.
struct RowContext {
  std::uint64_t study_id;
  std::int64_t model_id;
  protocol::Point point;
  std::uint64_t worker_id;  ///< 0: NULL
  std::string_view solver_version;
  std::string_view instruction_set;
  std::uint32_t attempt;
  std::string_view solved_at;
};

/// Binds every parameter of the statement. Of a solved point `protocol::fault_of` must find
/// nothing.
void bind_result(Statement& insert, const RowContext& context, const protocol::PointResult& result);

}  // namespace oblique::server
