#include "server/query/sql_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <new>
#include <utility>

#include <strings.h>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/expression.h"
#include "proto/text.h"
#include "server/database/sqlite.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

using solver::InputError;

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
bool begins_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
         static_cast<unsigned char>(c) >= 0x80;
}
bool continues_name(char c) {
  return begins_name(c) || is_digit(c) || c == '$';
}

/// Throws if `rest` begins with a comment, a parameter or anything else that would end or change
/// the statement around the user's text.
void check_beginning(std::string_view rest) {
  constexpr std::string_view kParameters = "?:@$#";
  if (rest.starts_with("--") || rest.starts_with("/*")) {
    throw InputError(fmt::format("it has a comment ({})", rest.substr(0, 2)));
  }
  if (kParameters.find(rest.front()) != std::string_view::npos) {
    throw InputError(fmt::format("it has a parameter ({})", rest.front()));
  }
  if (rest.front() == ';') {
    throw InputError("it has a semicolon");
  }
  if (rest.starts_with("\xEF\xBB\xBF")) {  // SQLite would read the mark as a space
    throw InputError("it has a byte-order mark");
  }
  if (rest.front() == '\0') {
    throw InputError("it has a zero byte");
  }
}

/// Returns the length of a text at the start of `rest` whose opening quote is at `open`. Two quotes
/// in a row inside the text stand for one quote.
std::size_t quoted_length(std::string_view rest, std::size_t open, char close) {
  std::size_t end = open;
  do {
    end = rest.find(close, end + 1);
    if (end == std::string_view::npos) {
      throw InputError(fmt::format("the quote {} is not closed", rest[open]));
    }
    ++end;
  } while (close != ']' && end < rest.size() && rest[end] == close);
  return end;
}

/// Returns the length of a number: 1, 1.5, .5, 1e-5, 0x1F. Includes letters directly after the
/// number, because SQLite refuses a number with such letters.
std::size_t number_length(std::string_view rest) {
  std::size_t end = 0;
  while (end < rest.size() && (continues_name(rest[end]) || rest[end] == '.')) {
    const bool has_sign = (rest[end] == 'e' || rest[end] == 'E') && end + 2 < rest.size() &&
                          (rest[end + 1] == '+' || rest[end + 1] == '-') && is_digit(rest[end + 2]);
    end += has_sign ? 2 : 1;
  }
  return end;
}

SqlToken first_token(std::string_view rest) {
  using Kind = SqlToken::Kind;
  check_beginning(rest);
  const char c = rest.front();
  const char next = rest.size() > 1 ? rest[1] : '\0';
  if (c == '\'') {
    return {Kind::kLiteral, rest.substr(0, quoted_length(rest, 0, c))};
  }
  if ((c == 'x' || c == 'X') && next == '\'') {
    return {Kind::kLiteral, rest.substr(0, quoted_length(rest, 1, next))};
  }
  if (c == '"' || c == '`' || c == '[') {
    return {Kind::kQuotedName, rest.substr(0, quoted_length(rest, 0, c == '[' ? ']' : c))};
  }
  if (is_digit(c) || (c == '.' && is_digit(next))) {
    return {Kind::kLiteral, rest.substr(0, number_length(rest))};
  }
  if (begins_name(c)) {
    const auto* const end = std::find_if_not(rest.begin(), rest.end(), continues_name);
    return {Kind::kName, {rest.begin(), end}};
  }
  const bool is_pair =
      (next == '=' && (c == '<' || c == '>' || c == '=' || c == '!')) || (c == '<' && next == '>');
  return {Kind::kSign, rest.substr(0, is_pair ? 2 : 1)};
}

bool begins_clause(SqlTokens tokens, std::size_t i) {
  constexpr std::array<std::string_view, 14> kWords{
      "select", "values", "with",   "from",  "where",  "group",     "having",
      "order",  "limit",  "offset", "union", "except", "intersect", "window"};
  const bool is_distinct_from =
      is_word(tokens[i], "from") && i >= 2 && is_word(tokens[i - 1], "distinct");
  return !is_distinct_from &&
         std::ranges::any_of(kWords, [&](auto word) { return is_word(tokens[i], word); });
}

void check_tokens(SqlTokens tokens) {
  if (tokens.empty()) {
    throw InputError("it is empty");
  }
  std::size_t depth = 0;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (tokens[i].is_sign("(")) {
      ++depth;
    } else if (tokens[i].is_sign(")")) {
      if (depth-- == 0) {
        throw InputError("a closing bracket has no opening one");
      }
    } else if (depth == 0 && begins_clause(tokens, i)) {
      throw InputError(fmt::format("it has {} outside brackets", tokens[i].text));
    }
  }
  if (depth > 0) {
    throw InputError("a bracket is not closed");
  }
}

// ---- Functions ----------------------------------------------------------------------------------

/// Means of x and y, sums of squared differences from the means, and sum of their products,
/// computed without cancellation (Welford 1962).
struct Moments {
  std::uint64_t count;
  double mean_x;
  double mean_y;
  double squares_x;
  double squares_y;
  double products;
};

/// Returns the object that SQLite keeps for the group, initially zeros. Returns nullptr if memory
/// runs out, which ends the statement. With `bytes` 0 no object is created, and nullptr means a
/// group without rows.
template <class T>
T* state_of(sqlite3_context* context,
            int bytes = sizeof(T)) {  // NOLINT(bugprone-sizeof-expression): T may be a pointer
  auto* const state = static_cast<T*>(sqlite3_aggregate_context(context, bytes));
  if (state == nullptr && bytes > 0) {
    sqlite3_result_error_nomem(context);
  }
  return state;
}

/// Returns whether the value is a number. Returns false for NULL; other values end the statement.
bool is_number(sqlite3_context* context, sqlite3_value* value) {
  const int type = sqlite3_value_type(value);
  if (type == SQLITE_TEXT || type == SQLITE_BLOB) {
    sqlite3_result_error(context, "median, stddev and corr need numbers", -1);
  }
  return type == SQLITE_INTEGER || type == SQLITE_FLOAT;
}

/// The numbers of a group. SQLite keeps a pointer to them.
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

/// Returns the median. SQLite also calls this function when the statement has failed.
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
  if (const auto number = solver::number_of(text == nullptr ? "" : text)) {
    sqlite3_result_double(context, *number);
  } else {
    sqlite3_result_error(context, "nearest_double needs a number as text", -1);
  }
}

/// Computes the expressions::Function that is the SQL function's user data. NULL is its NaN.
void compute(sqlite3_context* context, int count, sqlite3_value** arguments) {
  const auto& function = *static_cast<const expressions::Function*>(sqlite3_user_data(context));
  std::vector<double> x;
  for (sqlite3_value* const argument : std::span(arguments, static_cast<std::size_t>(count))) {
    const int type = sqlite3_value_type(argument);
    if (type == SQLITE_TEXT || type == SQLITE_BLOB) {
      const std::string error = fmt::format("{} needs numbers", function.name);
      return sqlite3_result_error(context, error.c_str(), -1);
    }
    x.push_back(type == SQLITE_NULL ? std::nan("") : sqlite3_value_double(argument));
  }
  sqlite3_result_double(context, function.compute(x.data()));
}

constexpr std::array<SqlFunction, 15> kFunctions{{
    {"median", "median(x)", "the middle value, or the mean of the two middle ones", true, true},
    {"stddev", "stddev(x)", "standard deviation of a sample (n - 1)", true, true},
    {"corr", "corr(x, y)",
     "Pearson's correlation of two columns, from -1 to 1; rows with a NULL are left out", true},
    {"count_mode", "count_mode('SC SR')",
     "number of points with this major_mode; for other conditions: count(*) FILTER (WHERE e = 1)",
     true},
    {"avg", "avg(x)", "mean of all points, or of each group of --group", true, true},
    {"min", "min(x)", "smallest value", true, true},
    {"max", "max(x)", "largest value", true, true},
    {"sum", "sum(x)", "sum", true, true},
    {"count", "count(*)", "number of points", true},
    {"round", "round(x, n)", "value rounded to n decimals", false, true},
    {"abs", "abs(x)", "absolute value", false, true},
    {"total", "", "", true, true},
    {"group_concat", "", "", true},
    {"json_group_array", "", "", true},
    {"json_group_object", "", "", true},
}};

}  // namespace

std::vector<SqlToken> sql_tokens(std::string_view text) {
  constexpr std::string_view kSpace = " \t\n\f\r";
  std::vector<SqlToken> tokens;
  std::size_t at = text.find_first_not_of(kSpace);
  while (at < text.size()) {
    tokens.push_back(first_token(text.substr(at)));
    at = text.find_first_not_of(kSpace, at + tokens.back().text.size());
  }
  return tokens;
}

bool is_word(const SqlToken& token, std::string_view word) {
  return token.kind == SqlToken::Kind::kName && token.text.size() == word.size() &&
         strncasecmp(token.text.data(), word.data(), word.size()) == 0;
}

std::size_t closing_bracket(SqlTokens tokens, std::size_t open) {
  std::size_t depth = 0;
  for (std::size_t i = open; i < tokens.size(); ++i) {
    depth += tokens[i].is_sign("(") ? 1U : 0U;
    if (tokens[i].is_sign(")") && --depth == 0) {
      return i;
    }
  }
  return tokens.size();
}

std::string name_of(const SqlToken& token) {
  const bool is_quoted = token.kind == SqlToken::Kind::kQuotedName;
  return std::string(is_quoted ? token.text.substr(1, token.text.size() - 2) : token.text);
}

std::vector<SqlTokens> sql_items(SqlTokens tokens) {
  std::vector<SqlTokens> items;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (tokens[i].is_sign("(")) {
      i = closing_bracket(tokens, i);
    } else if (tokens[i].is_sign(",")) {
      items.push_back(tokens.subspan(begin, i - begin));
      begin = i + 1;
    }
  }
  items.push_back(tokens.subspan(std::min(begin, tokens.size())));
  return items;
}

std::string_view text_over(SqlTokens tokens) {
  return tokens.empty() ? std::string_view()
                        : std::string_view(tokens.front().text.begin(), tokens.back().text.end());
}

std::string sql_text(std::string_view text) {
  std::string result = "'";
  for (const char letter : text) {
    result.append(letter == '\'' ? 2 : 1, letter);
  }
  return result += '\'';
}

std::string not_allowed(std::string_view flag, std::string_view text, std::string_view why) {
  constexpr std::size_t kLongest = 200;
  // The message of an exception ends at its first zero byte.
  const std::string printable(text.substr(0, text.find('\0')));
  const std::string shown = protocol::shortened(printable, kLongest);
  return fmt::format("{} \"{}{}\" is not allowed: {}", flag, shown,
                     shown.size() < printable.size() ? "..." : "", why);
}

void check_sql_part(std::string_view flag, std::string_view text) {
  try {
    check_tokens(sql_tokens(text));
  } catch (const InputError& error) {
    throw InputError(not_allowed(
        flag, text,
        fmt::format("{}; SQL expressions are allowed, without comments, parameters (?, :x, @x, $x) "
                    "and semicolons",
                    error.what())));
  }
}

void add_functions(sqlite3* database) {
  const auto add = [&](std::string_view name, int arguments, auto function, auto step, auto last,
                       const expressions::Function* data = nullptr) {
    constexpr int kFlags = SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS;
    if (sqlite3_create_function_v2(database, std::string(name).c_str(), arguments, kFlags,
                                   const_cast<expressions::Function*>(data), function, step, last,
                                   nullptr) != SQLITE_OK) {
      throw StorageError(fmt::format("no function {}: {}", name, sqlite3_errmsg(database)));
    }
  };
  add("median", 1, nullptr, &median_step, &median_final);
  add("stddev", 1, nullptr, &moments_step, &stddev_final);
  add("corr", 2, nullptr, &moments_step, &corr_final);
  add(kNumberFunction, 1, &nearest_double, nullptr, nullptr);
  for (const auto& function : expressions::functions()) {
    add(fmt::format("{}{}", kExpressionPrefix, function.name), static_cast<int>(function.arguments),
        &compute, nullptr, nullptr, &function);
  }
}

std::span<const SqlFunction> sql_functions() {
  return kFunctions;
}

}  // namespace oblique::server
