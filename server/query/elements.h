#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/asking/sql/sql_tokens.h"

namespace oblique::server {

/// An element of a list column: peaks[0].fn_N, fn_peaks_N[-1] or peaks.count. Elements count from
/// 0, as `seq` of the views does; -1 is the last. An element that a list lacks is NULL.
struct ElementReference {
  std::size_t tokens = 0;  ///< number of tokens that write it; 0: there is none
  std::string sql;
  std::string unit;
};

/// The element at the beginning of `tokens`. Throws solver::InputError for an element of a list
/// that has no such member, or a wrong number.
ElementReference element_at(std::span<const SqlToken> tokens);

/// `text` with elements and count_mode('SC SR') in SQLite's terms. Throws as element_at does.
std::string with_elements(std::string_view text);

/// The same with each decimal number as the double nearest to it: SQLite 3.40 reads some numbers of
/// seven digits as a neighbour, and an axis has the number that was typed.
std::string in_sqlite(std::string_view text);

/// The same for columns: those that were changed keep the written text as their name.
std::string columns_in_sqlite(std::string_view text);

/// How elements are written, with unit and meaning, for listings.
struct WrittenForm {
  std::string form;
  std::string unit;
  std::string meaning;
};
std::vector<WrittenForm> element_forms();

}  // namespace oblique::server
