#pragma once

#include <stdexcept>
#include <string_view>
#include <vector>

namespace oblique::server {

/// A piece of SQL.
struct SqlToken {
  enum class Kind { kName, kQuotedName, kLiteral, kSign };
  Kind kind;
  std::string_view text;  ///< as written, quotes included; a sign is one character

  bool is_sign(char sign) const { return kind == Kind::kSign && text.front() == sign; }
  bool is_name() const { return kind == Kind::kName || kind == Kind::kQuotedName; }
};

/// Why a text is no part of a statement, as a clause for people.
class NotSqlPart : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Cuts `text` into tokens as SQLite does. Throws NotSqlPart for a comment, a parameter, a
/// semicolon, a zero byte, or a quote that is not closed. The tokens look into `text`.
std::vector<SqlToken> sql_tokens(std::string_view text);

/// Whether two names are one to SQLite, which takes no notice of case in ASCII.
bool same_but_case(std::string_view a, std::string_view b);

}  // namespace oblique::server
