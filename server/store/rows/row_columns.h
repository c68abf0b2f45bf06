#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

// Names of columns, and what is computed of them.
namespace oblique::server {

/// The first schema whose rows have checksums. Outputs of later ones stand behind all other columns
/// in them, where rows that lack them have the checksum that they always had.
inline constexpr int kFirstWithChecksums = 4;

/// The first schema with the table `packed_results`. In it and later ones `results` is a view.
inline constexpr int kFirstPacked = 8;

/// The table that has the results in a database of that schema.
constexpr std::string_view results_table(int schema) {
  return schema >= kFirstPacked ? "packed_results" : "results";
}

/// The columns of `packed_results` but the checksum, in their order.
std::span<const std::string_view> packed_columns();
/// Where it stands among them, from 0. It must be one of them.
int packed_column(std::string_view name);
/// Those that come from the solver.
std::span<const std::string_view> packed_outputs();

/// The columns of the table `results` but the checksum, which a database of that schema before
/// `kFirstPacked` has, in the order in which they count in it.
std::vector<std::string_view> result_columns(int schema);

/// What `checksum` of a row of `results_table(schema)` must be, as an expression over its columns.
/// Columns that a later schema brought come last, and so count only where they are not NULL:
/// earlier rows keep their checksums.
std::string result_checksum_sql(int schema);
/// The same for `studies`, and since `kFirstPacked` for `texts` and `workers`.
std::string study_checksum_sql();
std::string text_checksum_sql();
std::string worker_checksum_sql();

/// The columns of outputs of `results_table(schema)`, in no particular order, that schemas up to
/// this one brought. A failed row lacks them all.
std::vector<std::string> output_columns(int schema);
/// Those that every solved row has.
std::vector<std::string> certain_columns(int schema);

/// An expression over `packed_results` that is true when every list is NULL, or JSON of at most as
/// many numbers as a worker may send. Others would fail queries of the views that unfold them, or
/// make them quadratic.
std::string lists_are_sound_sql();

/// An expression for the highest number that any table has given to a study; 0: none. Rows of a
/// study whose row in `studies` was deleted by hand count too.
std::string last_study_id_sql();

/// What views call a column of `packed_results`.
std::string_view shown_name(std::string_view packed_column);

}  // namespace oblique::server
