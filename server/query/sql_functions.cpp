#include "server/query/sql_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/database/sqlite.h"

namespace oblique::server {
namespace {

/// Means, sums of squared differences from them and the sum of their products, without cancellation
/// (Welford 1962).
struct Moments {
  std::uint64_t count;
  double mean_x;
  double mean_y;
  double squares_x;
  double squares_y;
  double products;
};

/// The object that SQLite keeps for the group, at first with zeros; nullptr ends the statement,
/// because there is no memory. With `bytes` 0 it is not created, and nullptr: the group has no row.
template <class T>
T* state_of(sqlite3_context* context, int bytes = sizeof(T)) {
  auto* const state = static_cast<T*>(sqlite3_aggregate_context(context, bytes));
  if (state == nullptr && bytes > 0) {
    sqlite3_result_error_nomem(context);
  }
  return state;
}

/// Whether the value is a number. NULL is not; other values end the statement.
bool is_number(sqlite3_context* context, sqlite3_value* value) {
  const int type = sqlite3_value_type(value);
  if (type == SQLITE_TEXT || type == SQLITE_BLOB) {
    sqlite3_result_error(context, "median, stddev and corr take numbers", -1);
  }
  return type == SQLITE_INTEGER || type == SQLITE_FLOAT;
}

/// The numbers of a group; SQLite keeps a pointer to them.
using Numbers = std::vector<double>;

void median_step(sqlite3_context* context, int, sqlite3_value** arguments) {
  auto** const numbers = state_of<Numbers*>(context);
  if (numbers == nullptr || !is_number(context, arguments[0])) {
    return;
  }
  try {
    *numbers = *numbers == nullptr ? new Numbers : *numbers;
    (*numbers)->push_back(sqlite3_value_double(arguments[0]));
  } catch (const std::bad_alloc&) {
    sqlite3_result_error_nomem(context);
  }
}

/// Returns the median. SQLite also calls this when the statement fails.
void median_final(sqlite3_context* context) {
  auto** const state = state_of<Numbers*>(context, 0);
  const std::unique_ptr<Numbers> numbers(state == nullptr ? nullptr : *state);
  if (numbers == nullptr || numbers->empty()) {
    return;
  }
  const auto middle = numbers->begin() + static_cast<std::ptrdiff_t>(numbers->size() / 2);
  std::nth_element(numbers->begin(), middle, numbers->end());
  const bool has_one_middle = numbers->size() % 2 == 1;
  const double below = has_one_middle ? *middle : *std::max_element(numbers->begin(), middle);
  sqlite3_result_double(context, 0.5 * below + 0.5 * *middle);
}

/// Adds the pair of the first and the last argument.
void moments_step(sqlite3_context* context, int count_of_arguments, sqlite3_value** arguments) {
  sqlite3_value* const x = arguments[0];
  sqlite3_value* const y = arguments[count_of_arguments - 1];
  auto* const moments = state_of<Moments>(context);
  if (moments == nullptr || !is_number(context, x) || !is_number(context, y)) {
    return;
  }
  ++moments->count;
  const auto count = static_cast<double>(moments->count);
  const double step_x = sqlite3_value_double(x) - moments->mean_x;
  const double step_y = sqlite3_value_double(y) - moments->mean_y;
  moments->mean_x += step_x / count;
  moments->mean_y += step_y / count;
  const double part = 1.0 - 1.0 / count;
  moments->squares_x += step_x * step_x * part;
  moments->squares_y += step_y * step_y * part;
  moments->products += step_x * step_y * part;
}

/// Returns the standard deviation of a sample (divisor n - 1); NULL for fewer than two numbers.
void stddev_final(sqlite3_context* context) {
  const auto* const moments = state_of<Moments>(context, 0);
  if (moments != nullptr && moments->count > 1) {
    sqlite3_result_double(context,
                          std::sqrt(moments->squares_x / static_cast<double>(moments->count - 1)));
  }
}

/// Returns the correlation; NULL for fewer than two rows, or if x or y is constant.
void corr_final(sqlite3_context* context) {
  const auto* const moments = state_of<Moments>(context, 0);
  if (moments != nullptr && moments->squares_x > 0.0 && moments->squares_y > 0.0) {
    const double corr =
        moments->products / (std::sqrt(moments->squares_x) * std::sqrt(moments->squares_y));
    sqlite3_result_double(context, std::clamp(corr, -1.0, 1.0));
  }
}

void nearest_double(sqlite3_context* context, int, sqlite3_value** arguments) {
  const auto* const text = reinterpret_cast<const char*>(sqlite3_value_text(arguments[0]));
  if (const auto number = decimal_number(text == nullptr ? "" : text)) {
    sqlite3_result_double(context, *number);
  } else {
    sqlite3_result_error(context, "nearest_double takes a number as text", -1);
  }
}

constexpr std::array<SqlFunction, 15> kFunctions{{
    {"median", "median(x)",
     "the middle value; half way between the two middle ones of an even number", true, true},
    {"stddev", "stddev(x)", "standard deviation of a sample (n - 1)", true, true},
    {"corr", "corr(x, y)",
     "Pearson's correlation of two columns, from -1 to 1; rows with a NULL are left out", true},
    {"count_mode", "count_mode('SC SR')",
     "points whose major_mode is that; of others count(*) FILTER (WHERE e = 1)", true},
    {"avg", "avg(x)", "mean of the points, or of each group of --group", true, true},
    {"min", "min(x)", "least of them", true, true},
    {"max", "max(x)", "largest of them", true, true},
    {"sum", "sum(x)", "their sum", true, true},
    {"count", "count(*)", "number of points", true},
    {"round", "round(x, n)", "one value to n decimals", false, true},
    {"abs", "abs(x)", "of one value", false, true},
    {"total", "", "", true, true},
    {"group_concat", "", "", true},
    {"json_group_array", "", "", true},
    {"json_group_object", "", "", true},
}};

}  // namespace

void add_functions(sqlite3* database) {
  const auto add = [&](std::string_view name, int arguments, auto function, auto step, auto last) {
    constexpr int kFlags = SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS;
    if (sqlite3_create_function_v2(database, name.data(), arguments, kFlags, nullptr, function,
                                   step, last, nullptr) != SQLITE_OK) {
      throw StorageError(fmt::format("no function {}: {}", name, sqlite3_errmsg(database)));
    }
  };
  add("median", 1, nullptr, &median_step, &median_final);
  add("stddev", 1, nullptr, &moments_step, &stddev_final);
  add("corr", 2, nullptr, &moments_step, &corr_final);
  add(kNumberFunction, 1, &nearest_double, nullptr, nullptr);
}

std::optional<double> decimal_number(std::string_view text) {
  double number = 0.0;
  const char* const end = text.data() + text.size();
  const auto [read, error] = std::from_chars(text.data(), end, number);
  const bool is_decimal = text.find_first_not_of("0123456789.eE+-") == std::string_view::npos;
  return is_decimal && error == std::errc() && read == end ? std::optional(number) : std::nullopt;
}

std::span<const SqlFunction> sql_functions() {
  return kFunctions;
}

}  // namespace oblique::server
