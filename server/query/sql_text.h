#pragma once

#include <cstddef>
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
  std::string_view text;  ///< as written, including quotes

  bool is_sign(std::string_view sign) const { return kind == Kind::kSign && text == sign; }
  bool is_name() const { return kind == Kind::kName || kind == Kind::kQuotedName; }
};
using SqlTokens = std::span<const SqlToken>;

/// Splits `text` into tokens as SQLite does. A comparison such as <= is one token; each other sign
/// is a token of its own. The tokens refer to `text`. Throws solver::InputError for a comment, a
/// parameter, a semicolon, a zero byte, a byte-order mark, or an unclosed quote. The message
/// contains only the reason (`why` of not_allowed).
std::vector<SqlToken> sql_tokens(std::string_view text);

/// Returns whether a token is the keyword or function `word`, ignoring case.
bool is_word(const SqlToken& token, std::string_view word);

/// Returns the index of the bracket that closes the one at `open`; the number of tokens if none
/// does.
std::size_t closing_bracket(SqlTokens tokens, std::size_t open);

/// Returns the name in a token, without its quotes.
std::string name_of(const SqlToken& token);

/// Returns the items of a list that is separated by commas outside brackets.
std::vector<SqlTokens> sql_items(SqlTokens tokens);

/// Returns the text from the first to the last of `tokens`.
std::string_view text_over(SqlTokens tokens);

/// Formats a text as an SQL literal in single quotes.
std::string sql_text(std::string_view text);

/// Returns `FLAG "TEXT" is not allowed: WHY`; a long text is shortened.
std::string not_allowed(std::string_view flag, std::string_view text, std::string_view why);

/// Throws solver::InputError with `flag` and the text if `text` could change the statement around
/// it. Brackets and quotes must be closed. Comments, parameters, semicolons, and clauses outside
/// brackets are not allowed. SQLite checks the rest.
void check_sql_part(std::string_view flag, std::string_view text);

/// Prefix of the SQL names of the functions of expressions. Queries call them instead of SQLite's
/// functions, which have other values: SQLite's log(10) is 1.
inline constexpr std::string_view kExpressionPrefix = "expression_";

/// SQL function that returns the double nearest to the decimal in a text.
inline constexpr std::string_view kNumberFunction = "nearest_double";

/// A function that queries may use: one of ours, or SQLite's.
struct SqlFunction {
  std::string_view name;
  std::string_view form;     ///< the call as shown in listings; empty if listings omit it
  std::string_view meaning;  ///< one line
  /// true for an aggregate function; min and max aggregate only with one argument
  bool aggregates = false;
  bool keeps_unit = false;  ///< true if the result has the unit of the first argument
};
std::span<const SqlFunction> sql_functions();

/// Adds kNumberFunction, the functions with kExpressionPrefix, and the aggregate functions
/// median(x), stddev(x) and corr(x, y) to `database`. They ignore NULL and refuse values that are
/// not numbers. Throws StorageError.
void add_functions(sqlite3* database);

}  // namespace oblique::server
