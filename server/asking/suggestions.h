#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace oblique::server {

/// An addition to SQLite's message about `sql` if a name that does not exist stands in double
/// quotes, where a text may have been meant; else empty.
std::string what_quotes_mean(const std::string& message, std::string_view sql);

/// SQLite's message about a question, with the column, element or function that may have been
/// meant. `columns` are those that questions have.
std::string with_suggestions(const std::string& message, const std::vector<std::string>& columns);

}  // namespace oblique::server
