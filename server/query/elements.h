#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/query/sql_text.h"

namespace oblique::server {

// Names under which a query reads the lists as the table `results` has them, where the view `runs`
// shows them in another form.
inline constexpr std::string_view kStoredPhases = "stored_phases";
inline constexpr std::string_view kStoredFtPeaks = "stored_ft_peaks";

/// An element of a list: peaks[0].fn_N, peaks[0], fn_peaks_N[-1] or peaks.count; or
/// count_mode('SC SR'). Elements count from 0, as `seq` of the views does; -1 is the last. An
/// element that a list lacks is NULL.
struct ElementReference {
  std::size_t tokens = 0;  ///< number of tokens that write it; 0: none
  std::string sql;
  std::string unit;
};

/// The element at the beginning of `tokens`. Throws solver::InputError for an element of a list
/// that has no such member, or a wrong index.
ElementReference element_at(std::span<const SqlToken> tokens);

/// `text` with its elements in SQLite's terms. Throws as element_at does.
std::string with_elements(std::string_view text);

/// The same with each decimal number as the double nearest to it: SQLite 3.40 reads some numbers of
/// seven digits as a neighbour, and an axis has the number that was typed.
std::string in_sqlite(std::string_view text);

/// The same for selected columns. `*` becomes `all_columns`; a column whose text was changed is
/// named as it was written.
std::string columns_in_sqlite(std::string_view text, std::span<const std::string> all_columns);

/// How elements are written, with unit and meaning, for listings.
struct WrittenForm {
  std::string form;
  std::string unit;
  std::string meaning;
};
std::vector<WrittenForm> element_forms();

}  // namespace oblique::server
