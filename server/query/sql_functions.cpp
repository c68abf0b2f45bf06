#include "server/query/sql_functions.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>
#include <system_error>

#include <spdlog/fmt/fmt.h>

#include "server/database/sqlite.h"
#include "server/query/sql_text.h"

namespace oblique::server {
namespace {

constexpr double kHalf = 50.0;
constexpr double kWhole = 100.0;

/// The numbers of a group. SQLite allocates this object with zeros and frees it at the end of the
/// group.
struct Numbers {
  double* values;
  std::uint64_t count;
  std::uint64_t capacity;
  double percent;
  bool failed;
};

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

/// Ends the statement with the error kWrongArgument.
void refuse(sqlite3_context* context, const char* why) {
  sqlite3_result_error(context, why, -1);
  sqlite3_result_error_code(context, kWrongArgument);
}

/// Whether the value is a number. NULL is not; other values end the statement.
bool is_number(sqlite3_context* context, sqlite3_value* value) {
  switch (sqlite3_value_type(value)) {
    case SQLITE_INTEGER:
    case SQLITE_FLOAT:
      return true;
    case SQLITE_NULL:
      return false;
    default:
      refuse(context, "median, percentile, variance, stddev and corr take numbers");
      return false;
  }
}

void add_number(sqlite3_context* context, sqlite3_value* value, double percent) {
  auto* const numbers = static_cast<Numbers*>(sqlite3_aggregate_context(context, sizeof(Numbers)));
  if (numbers == nullptr) {
    sqlite3_result_error_nomem(context);
    return;
  }
  if (numbers->failed || !is_number(context, value)) {
    return;
  }
  if (numbers->count > 0 && numbers->percent != percent) {
    numbers->failed = true;
    refuse(context, "percentile takes one percentage for all rows of a group");
    return;
  }
  numbers->percent = percent;
  if (numbers->count == numbers->capacity) {
    constexpr std::uint64_t kFirst = 64;
    const std::uint64_t more = std::max(kFirst, 2 * numbers->capacity);
    auto* const grown =
        static_cast<double*>(sqlite3_realloc64(numbers->values, more * sizeof(double)));
    if (grown == nullptr) {
      numbers->failed = true;
      sqlite3_result_error_nomem(context);
      return;
    }
    numbers->values = grown;
    numbers->capacity = more;
  }
  numbers->values[numbers->count++] = sqlite3_value_double(value);
}

void median_step(sqlite3_context* context, int, sqlite3_value** arguments) {
  add_number(context, arguments[0], kHalf);
}

void percentile_step(sqlite3_context* context, int, sqlite3_value** arguments) {
  const int type = sqlite3_value_type(arguments[1]);
  const double percent = sqlite3_value_double(arguments[1]);
  if ((type != SQLITE_INTEGER && type != SQLITE_FLOAT) || !(percent >= 0.0 && percent <= kWhole)) {
    refuse(context, "percentile(x, p) takes a percentage p from 0 to 100");
    return;
  }
  add_number(context, arguments[0], percent);
}

/// Returns the percentile, interpolated linearly between the two nearest numbers.
void numbers_final(sqlite3_context* context) {
  auto* const numbers = static_cast<Numbers*>(sqlite3_aggregate_context(context, 0));
  if (numbers == nullptr) {
    return;
  }
  if (numbers->count > 0 && !numbers->failed) {
    double* const begin = numbers->values;
    double* const end = begin + numbers->count;
    const double place = numbers->percent / kWhole * static_cast<double>(numbers->count - 1);
    double* const lower = begin + static_cast<std::ptrdiff_t>(place);
    std::nth_element(begin, lower, end);
    const double part = place - std::floor(place);
    const double upper = part > 0.0 ? *std::min_element(lower + 1, end) : *lower;
    sqlite3_result_double(context, part > 0.0 ? *lower * (1.0 - part) + upper * part : *lower);
  }
  sqlite3_free(numbers->values);
  numbers->values = nullptr;
}

/// Adds the pair of the first and the last argument.
void moments_step(sqlite3_context* context, int count_of_arguments, sqlite3_value** arguments) {
  sqlite3_value* const x = arguments[0];
  sqlite3_value* const y = arguments[count_of_arguments - 1];
  auto* const moments = static_cast<Moments*>(sqlite3_aggregate_context(context, sizeof(Moments)));
  if (moments == nullptr) {
    sqlite3_result_error_nomem(context);
    return;
  }
  if (!is_number(context, x) || !is_number(context, y)) {
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

/// Returns the sample variance (divisor n - 1) or its root; NULL for fewer than two numbers.
template <bool is_root>
void moments_final(sqlite3_context* context) {
  const auto* const moments = static_cast<const Moments*>(sqlite3_aggregate_context(context, 0));
  if (moments != nullptr && moments->count > 1) {
    const double variance = moments->squares_x / static_cast<double>(moments->count - 1);
    sqlite3_result_double(context, is_root ? std::sqrt(variance) : variance);
  }
}

/// Returns the correlation; NULL for fewer than two rows, or if x or y is constant.
void corr_final(sqlite3_context* context) {
  const auto* const moments = static_cast<const Moments*>(sqlite3_aggregate_context(context, 0));
  if (moments != nullptr && moments->squares_x > 0.0 && moments->squares_y > 0.0) {
    const double corr =
        moments->products / (std::sqrt(moments->squares_x) * std::sqrt(moments->squares_y));
    sqlite3_result_double(context, std::clamp(corr, -1.0, 1.0));
  }
}

constexpr std::array<SqlFunction, 18> kFunctions{{
    {"median", "median(x)",
     "the middle value; half way between the two middle ones of an even number", true, true},
    {"percentile", "percentile(x, p)",
     "the value that p percent lie below, between neighbours in proportion", true, true},
    {"stddev", "stddev(x)", "standard deviation of a sample (n - 1)", true, true},
    {"variance", "variance(x)", "its square", true},
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
    {"string_agg", "", "", true},
    {"json_group_array", "", "", true},
    {"json_group_object", "", "", true},
}};

void nearest_double(sqlite3_context* context, int, sqlite3_value** arguments) {
  const auto* const text = reinterpret_cast<const char*>(sqlite3_value_text(arguments[0]));
  if (const auto number = decimal_number(text == nullptr ? "" : text)) {
    sqlite3_result_double(context, *number);
  } else {
    refuse(context, "nearest_double takes a number as text");
  }
}

}  // namespace

void add_functions(sqlite3* database) {
  constexpr int kFlags = SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS;
  const auto add = [&](const char* name, int arguments, auto step, auto last) {
    if (sqlite3_create_function_v2(database, name, arguments, kFlags, nullptr, nullptr, step, last,
                                   nullptr) != SQLITE_OK) {
      throw StorageError(fmt::format("no function {}: {}", name, sqlite3_errmsg(database)));
    }
  };
  add("median", 1, &median_step, &numbers_final);
  add("percentile", 2, &percentile_step, &numbers_final);
  add("variance", 1, &moments_step, &moments_final<false>);
  add("stddev", 1, &moments_step, &moments_final<true>);
  add("corr", 2, &moments_step, &corr_final);
  if (sqlite3_create_function_v2(database, kNumberFunction.data(), 1, kFlags, nullptr,
                                 &nearest_double, nullptr, nullptr, nullptr) != SQLITE_OK) {
    throw StorageError(
        fmt::format("no function {}: {}", kNumberFunction, sqlite3_errmsg(database)));
  }
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

const SqlFunction* find_sql_function(std::string_view name) {
  const auto* found = std::find_if(kFunctions.begin(), kFunctions.end(), [&](const auto& known) {
    return same_but_case(known.name, name);
  });
  return found == kFunctions.end() ? nullptr : found;
}

}  // namespace oblique::server
