#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

struct sqlite3;

namespace oblique::server {

/// A token of SQL.
struct SqlToken {
  enum class Kind { kName, kQuotedName, kLiteral, kSign };
  Kind kind;
  std::string_view text;  ///< as written, quotes included

  bool is_sign(std::string_view sign) const { return kind == Kind::kSign && text == sign; }
  bool is_name() const { return kind == Kind::kName || kind == Kind::kQuotedName; }
};
using SqlTokens = std::span<const SqlToken>;

/// Splits `text` into tokens as SQLite does; comparisons such as <= are one token, other signs one
/// character. Throws solver::InputError, whose message is a clause, for a comment, a parameter, a
/// semicolon, a zero byte, a byte-order mark, or a quote that is not closed. The tokens point into
/// `text`.
std::vector<SqlToken> sql_tokens(std::string_view text);

/// Whether a token is the keyword or the function `word`, in any case.
bool is_word(const SqlToken& token, std::string_view word);

/// Index of the bracket that closes the one at index `open`; the number of tokens if none does.
std::size_t closing_bracket(SqlTokens tokens, std::size_t open);

/// The name in a token, without its quotes.
std::string name_of(const SqlToken& token);

/// The items of a list, which commas outside brackets separate.
std::vector<SqlTokens> sql_items(SqlTokens tokens);

/// The text from the first of `tokens` to the last.
std::string_view text_over(SqlTokens tokens);

/// A text as SQL writes it, in single quotes.
std::string sql_text(std::string_view text);

/// "FLAG "TEXT" is not allowed: WHY", with the beginning of a long text.
std::string not_allowed(std::string_view flag, std::string_view text, std::string_view why);

/// Throws solver::InputError, naming `flag` and the text, unless `text` can stand in a statement
/// without changing the statement around it: every bracket and quote is closed, there is no
/// comment, parameter or semicolon, and no clause begins outside brackets. SQLite checks the rest.
void check_sql_part(std::string_view flag, std::string_view text);

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

/// Adds to `database` kNumberFunction and the aggregate functions median(x), stddev(x) and
/// corr(x, y). They ignore NULL; other values than numbers are an error. Throws StorageError.
void add_functions(sqlite3* database);

}  // namespace oblique::server
