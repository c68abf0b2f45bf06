#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace oblique::server {

/// " (did you mean `a`, `b` or `c`?)" with those of `candidates` that `word` may be short for or
/// misspelt from, the nearest first, or nothing. Letters that were left out count less than others,
/// so fn_pk is near to fn_peak_N.
std::string did_you_mean_some(std::string_view word, std::span<const std::string> candidates);

/// What to add to what SQLite has against `sql` when a name that it does not find stands there in
/// double quotes, where a text may have been meant; else nothing.
std::string what_quotes_mean(const std::string& message, std::string_view sql);

/// What SQLite has against a question, with the columns, elements of lists or functions that may
/// have been meant. `columns` are those that questions have.
std::string with_suggestions(const std::string& message, const std::vector<std::string>& columns);

}  // namespace oblique::server
