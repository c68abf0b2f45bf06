#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <sqlite3.h>

#include "server/asking/sql/sql_tokens.h"

namespace oblique::server {

/// An element of a list that a column packs, as people write it: peaks[0].fn_N, fn_peaks_N[-1],
/// first_stick.t0_s, longest_phase.duration_s, peaks.count. Numbers count from 0, as `seq` of the
/// views does; -1 is the last. A list without that element has NULL there.
struct ElementReference {
  std::size_t tokens = 0;  ///< so many write it; 0: there is none
  std::string sql;
  std::string unit;
};

/// What stands at the beginning of `tokens`. Throws solver::InputError for an element of a list
/// that has no such member, or a number that is none.
ElementReference element_at(std::span<const SqlToken> tokens);

/// `text` with elements, counts of modes as count_mode('SC SR'), and numbers as SQLite understands
/// them; see with_exact_numbers. Throws as element_at does.
std::string in_sqlite(sqlite3* database, std::string_view text);

/// The same for columns: those that were changed keep what was written as their name.
std::string columns_in_sqlite(sqlite3* database, std::string_view text);

/// Every element of a list by itself, as peaks[0].fn_N and longest_phase.t1_s, for comparing.
std::vector<std::string> all_elements();

/// How elements and the like are written, with unit and meaning, for listings.
struct WrittenForm {
  std::string form;
  std::string unit;
  std::string meaning;
};
std::vector<WrittenForm> element_forms();

}  // namespace oblique::server
