#pragma once

#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace oblique::server {

/// A token of SQL.
struct SqlToken {
  enum class Kind { kName, kQuotedName, kLiteral, kSign };
  Kind kind;
  std::string_view text;  ///< as written, quotes included; a sign is one character

  bool is_sign(char sign) const { return kind == Kind::kSign && text.front() == sign; }
  bool is_name() const { return kind == Kind::kName || kind == Kind::kQuotedName; }
};

/// A text cannot be a part of a statement. The message is a clause that says why.
class NotSqlPart : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Splits `text` into tokens as SQLite does. Throws NotSqlPart for a comment, a parameter, a
/// semicolon, a zero byte, a byte-order mark, or a quote that is not closed. The tokens point into
/// `text`.
std::vector<SqlToken> sql_tokens(std::string_view text);

/// Whether two names are the same for SQLite, which ignores case in ASCII.
bool same_but_case(std::string_view a, std::string_view b);

/// Whether a token is the keyword or the function `word`, in any case.
bool is_word(const SqlToken& token, std::string_view word);

/// Index of the bracket that closes the one at index `open`; the number of tokens if none does.
std::size_t closing_bracket(std::span<const SqlToken> tokens, std::size_t open);

/// The name in a token, without its quotes.
std::string name_of(const SqlToken& token);

/// One expression of a comma-separated list.
struct SqlItem {
  std::span<const SqlToken> tokens;  ///< without its alias
  std::string_view text;             ///< as written, without its alias
  std::string_view whole;            ///< as written
  std::string alias;                 ///< name after the expression, with or without AS; empty: none
};

/// The items of a list. They point into `tokens`, and these into their text.
std::vector<SqlItem> sql_items(std::span<const SqlToken> tokens);

/// The aliases in a list of columns.
std::vector<std::string> aliases_in(std::string_view text);

/// A text as SQL writes it, in single quotes; a name in double quotes.
std::string sql_text(std::string_view text);
std::string sql_name(std::string_view name);

/// The part of a statement for which an option's text is used.
enum class SqlPart {
  kCondition,  ///< one expression, as after WHERE
  kColumns,    ///< expressions separated by commas, each with an optional alias
  kGroup,      ///< expressions separated by commas
  kOrder,      ///< expressions separated by commas, each with an optional ASC or DESC
};

/// Throws solver::InputError, naming `flag`, the text and what is allowed, unless `text` is a whole
/// `part` in SQLite's dialect, so that it cannot change the statement around it: every bracket and
/// quote is closed, there is no comment, parameter or semicolon, and no other clause begins outside
/// brackets. SQLite checks whether the names in it exist.
void check_sql_part(std::string_view flag, std::string_view text, SqlPart part);

/// SQL does not distinguish E from e. Throws solver::InputError, with the right name, for a column
/// in `text` that differs from one of `columns` only in case and is not one of `aliases`. `text`
/// must have passed check_sql_part.
void check_case_of_columns(std::string_view flag, std::string_view text,
                           std::span<const std::string> columns,
                           std::span<const std::string> aliases = {});

}  // namespace oblique::server
