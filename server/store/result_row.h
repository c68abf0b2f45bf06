#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"
#include "server/database/sqlite.h"

namespace oblique::server {

/// Why a result from the network cannot be stored, or an empty text: a number that is not finite or
/// that the database cannot hold, packed arrays of impossible length, texts too long.
std::string fault_of(const protocol::PointResult& result);

/// The statement that inserts one row into `results` unless the point has one; `bind_result` binds
/// it. The connection must have `row_checksum`.
std::string insert_result_sql();

/// What `checksum` of a row of `results` must be, as an expression over its columns. A later schema
/// leaves columns that it adds out of it: earlier rows keep their checksums.
std::string result_checksum_sql();
/// The same for `studies`.
std::string study_checksum_sql();

/// The columns that a solved row has and a failed one lacks, in no particular order; without
/// reaction_peaks, which rows of earlier schemas lack.
std::vector<std::string> output_columns();

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

/// Binds every parameter of the statement.
void bind_result(Statement& insert, const RowContext& context, const protocol::PointResult& result);

/// JSON text of the packed columns. Doubles keep their bits; a whole number keeps its ".0", so that
/// SQL takes it for a real.
std::string peaks_json(const protocol::PointResult& result);
std::string ft_peaks_json(const protocol::PointResult& result);
std::string phases_json(const protocol::PointResult& result);
std::string stick_intervals_json(const protocol::PointResult& result);
std::string reaction_peaks_json(const protocol::PointResult& result);

}  // namespace oblique::server
