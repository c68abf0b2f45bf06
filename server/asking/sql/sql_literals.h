#pragma once

#include <string>
#include <string_view>

#include <sqlite3.h>

namespace oblique::server {

/// `text` with each number written so that SQLite reads the double that is nearest to it.
/// SQLite 3.40 reads some of seven digits, and more of longer ones, as a neighbour, and an axis has
/// the value that was typed. `text` passed check_sql_part.
std::string with_exact_numbers(sqlite3* database, std::string_view text);

}  // namespace oblique::server
