#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

// Names of columns, and what is computed of them.
namespace oblique::server {

/// The columns of `packed_results` but the checksum, in their order.
std::span<const std::string_view> packed_columns();
/// Where it stands among them, from 0. It must be one of them.
int packed_column(std::string_view name);
/// Those that come from the solver; a failed row lacks them all.
std::span<const std::string_view> packed_outputs();
/// Those of them that every solved row has.
std::span<const std::string_view> certain_outputs();

/// What `checksum` of a row of `packed_results` must be, as an expression over its columns.
std::string result_checksum_sql();
/// The same for `studies`, `texts` and `workers`.
std::string study_checksum_sql();
std::string text_checksum_sql();
std::string worker_checksum_sql();

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
