#pragma once

#include <span>
#include <string_view>

#include <sqlite3.h>

namespace oblique::server {

/// What a statement fails with that gives one of these functions what it does not take.
inline constexpr int kWrongArgument = SQLITE_MISMATCH;

/// Gives statements on `database` the functions median(x), percentile(x, p), variance(x), stddev(x)
/// and corr(x, y), which gather the numbers of rows; what is NULL does not count, and what is no
/// number is an error. The first two keep 8 bytes a row in memory that SQLite counts. Throws
/// StorageError.
void add_functions(sqlite3* database);

/// What listings say of a function.
struct DescribedFunction {
  std::string_view form;
  std::string_view meaning;
};

/// These, and those of SQLite that people ask for most.
std::span<const DescribedFunction> described_functions();

}  // namespace oblique::server
