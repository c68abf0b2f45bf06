#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/query/sql_text.h"

namespace oblique::server {

// Names of lists in the form of the table `results`, for lists that the view `runs` shows in
// another form.
inline constexpr std::string_view kStoredPhases = "stored_phases";
inline constexpr std::string_view kStoredFtPeaks = "stored_ft_peaks";

/// An element of a list: peaks[0].fn_N, peaks[0], fn_peaks_N[-1] or peaks.count; or
/// count_mode('SC SR'). Elements count from 0, as `seq` of the views does; -1 is the last. An
/// element that a list lacks is NULL.
struct ElementReference {
  std::size_t tokens = 0;  ///< number of its tokens; 0: there is no element
  std::string sql;
  std::string unit;
};

/// The element at the beginning of `tokens`. Throws solver::InputError for an element of a list
/// that has no such member, or a wrong index.
ElementReference element_at(std::span<const SqlToken> tokens);

/// `text` with each element replaced by its SQL expression. Throws as element_at does.
std::string with_elements(std::string_view text);

/// The same, and each decimal replaced by the double nearest to it. SQLite 3.40 reads some decimals
/// of seven digits as another double, which would differ from the value of an axis.
std::string in_sqlite(std::string_view text);

/// The same for selected columns. `*` becomes `all_columns`; a column whose text is replaced keeps
/// the written text as its name.
std::string columns_in_sqlite(std::string_view text, std::span<const std::string> all_columns);

/// A form of elements, with unit and meaning, for listings.
struct WrittenForm {
  std::string form;
  std::string unit;
  std::string meaning;
};
std::vector<WrittenForm> element_forms();

}  // namespace oblique::server
