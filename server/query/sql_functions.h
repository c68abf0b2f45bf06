#pragma once

#include <optional>
#include <span>
#include <string_view>

#include <sqlite3.h>

namespace oblique::server {

/// Adds to `database` kNumberFunction and the aggregate functions median(x), percentile(x, p),
/// stddev(x) and corr(x, y). They ignore NULL; other values than numbers are an error. The first
/// two need 8 bytes per row. Throws StorageError.
void add_functions(sqlite3* database);

/// A function of one text that returns the double nearest to the decimal in it.
inline constexpr std::string_view kNumberFunction = "nearest_double";

/// The double nearest to a decimal such as .5 or 1e-3; none for other texts.
std::optional<double> decimal_number(std::string_view text);

/// A function that queries may use, ours or SQLite's.
struct SqlFunction {
  std::string_view name;
  std::string_view form;     ///< for listings; empty: it is not listed
  std::string_view meaning;  ///< one line
  bool aggregates = false;   ///< one value from many rows; for min and max with one argument
  bool keeps_unit = false;   ///< its value has the unit of its first argument
};
std::span<const SqlFunction> sql_functions();

}  // namespace oblique::server
