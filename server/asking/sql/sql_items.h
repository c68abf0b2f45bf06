#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/asking/sql/sql_tokens.h"

namespace oblique::server {

/// One of the expressions that stand between commas.
struct SqlItem {
  std::span<const SqlToken> tokens;  ///< without the name that is given
  std::string_view text;             ///< as written, without the name that is given
  std::string_view whole;            ///< as written
  std::string name;                  ///< that is given to it, as with AS; empty: none
};

/// The items of a list. They look into `tokens`, and these into their text.
std::vector<SqlItem> sql_items(const std::vector<SqlToken>& tokens);

/// Whether a token is the keyword or the function `word`, in whatever case.
bool is_word(const SqlToken& token, std::string_view word);

/// The number of the bracket that closes the one at number `open`; the number of tokens: none does.
std::size_t closing_bracket(std::span<const SqlToken> tokens, std::size_t open);

/// The name that a token writes, without its quotes.
std::string name_of(const SqlToken& token);

/// Whether a function that aggregates rows is called at token `i`.
bool calls_aggregate(std::span<const SqlToken> tokens, std::size_t i);

}  // namespace oblique::server
