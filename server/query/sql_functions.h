#pragma once

#include <optional>
#include <span>
#include <string_view>

#include <sqlite3.h>

namespace oblique::server {

/// The error code of a statement that passes one of these functions a wrong argument.
inline constexpr int kWrongArgument = SQLITE_MISMATCH;

/// Gives statements on `database` the functions median(x), percentile(x, p), variance(x), stddev(x)
/// and corr(x, y), which aggregate the numbers of rows; NULLs do not count, and other values than
/// numbers are an error. The first two keep 8 bytes a row in memory that SQLite counts. And
/// kNumberFunction. Throws StorageError.
void add_functions(sqlite3* database);

/// A function of one text that gives the double nearest to the number in it.
inline constexpr std::string_view kNumberFunction = "nearest_double";

/// The double nearest to what `text` writes in decimals, as .5 or 1e-3; none for other texts.
std::optional<double> decimal_number(std::string_view text);

/// A function that questions may use, ours or SQLite's.
struct SqlFunction {
  std::string_view name;
  std::string_view form;     ///< for listings; empty: it is not listed
  std::string_view meaning;  ///< one line
  bool aggregates = false;   ///< it makes one value of many rows; min and max with one argument
  bool keeps_unit = false;   ///< its value has the unit of its first argument
};
std::span<const SqlFunction> sql_functions();

/// The function of that name, in any case; nullptr: none.
const SqlFunction* find_sql_function(std::string_view name);

}  // namespace oblique::server
