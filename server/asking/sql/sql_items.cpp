#include "server/asking/sql/sql_items.h"

#include <algorithm>
#include <array>

#include "server/asking/sql/sql_functions.h"

namespace oblique::server {
namespace {

using ItemTokens = std::span<const SqlToken>;

std::string_view text_over(ItemTokens tokens) {
  if (tokens.empty()) {
    return {};
  }
  const char* const begin = tokens.front().text.data();
  const std::string_view last = tokens.back().text;
  return {begin, static_cast<std::size_t>(last.data() + last.size() - begin)};
}

/// Whether an operand may end with this token, so that a name behind it is given to the operand.
bool ends_operand(const SqlToken& token) {
  constexpr std::array<std::string_view, 13> kJoins{"and",  "or",   "not",     "is",   "in",
                                                    "like", "glob", "between", "case", "when",
                                                    "then", "else", "collate"};
  const bool joins = std::any_of(kJoins.begin(), kJoins.end(),
                                 [&](std::string_view word) { return is_word(token, word); });
  return !joins &&
         (token.kind == SqlToken::Kind::kLiteral || token.is_name() || token.is_sign(')'));
}

/// A word that ends an expression and is no name.
bool is_last_word(const SqlToken& token) {
  return is_word(token, "end") || is_word(token, "isnull") || is_word(token, "notnull");
}

SqlItem item_of(ItemTokens tokens) {
  SqlItem item{tokens, {}, text_over(tokens), {}};
  const std::size_t count = tokens.size();
  if (count >= 3 && is_word(tokens[count - 2], "as")) {
    item.name = name_of(tokens.back());
    item.tokens = tokens.first(count - 2);
  } else if (count >= 2 && tokens.back().is_name() && !is_last_word(tokens.back()) &&
             ends_operand(tokens[count - 2]) && !(count == 2 && is_word(tokens[0], "distinct")) &&
             tokens.back().text.front() != '[') {
    item.name = name_of(tokens.back());
    item.tokens = tokens.first(count - 1);
  }
  item.text = text_over(item.tokens);
  return item;
}

}  // namespace

std::vector<SqlItem> sql_items(const std::vector<SqlToken>& tokens) {
  const ItemTokens all(tokens);
  std::vector<SqlItem> items;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].is_sign('(')) {
      i = closing_bracket(all, i);
    } else if (all[i].is_sign(',')) {
      items.push_back(item_of(all.subspan(begin, i - begin)));
      begin = i + 1;
    }
  }
  items.push_back(item_of(all.subspan(std::min(begin, all.size()))));
  return items;
}

bool is_word(const SqlToken& token, std::string_view word) {
  return token.kind == SqlToken::Kind::kName && same_but_case(token.text, word);
}

std::size_t closing_bracket(std::span<const SqlToken> tokens, std::size_t open) {
  std::size_t depth = 0;
  for (std::size_t i = open; i < tokens.size(); ++i) {
    depth += tokens[i].is_sign('(') ? 1U : 0U;
    if (tokens[i].is_sign(')') && --depth == 0) {
      return i;
    }
  }
  return tokens.size();
}

std::string name_of(const SqlToken& token) {
  if (token.kind == SqlToken::Kind::kName) {
    return std::string(token.text);
  }
  const char quote = token.text.back();
  std::string name;
  const std::string_view inside = token.text.substr(1, token.text.size() - 2);
  for (std::size_t i = 0; i < inside.size(); ++i) {
    name += inside[i];
    if (inside[i] == quote && quote != ']') {
      ++i;  // a doubled quote stands for itself
    }
  }
  return name;
}

bool calls_aggregate(std::span<const SqlToken> tokens, std::size_t i) {
  const bool is_call = i + 1 < tokens.size() && tokens[i].kind == SqlToken::Kind::kName &&
                       tokens[i + 1].is_sign('(');
  const SqlFunction* const function = is_call ? find_sql_function(tokens[i].text) : nullptr;
  if (function == nullptr || !function->aggregates) {
    return false;
  }
  if (function->name != "min" && function->name != "max") {
    return true;
  }
  // With several arguments they compare these, not rows.
  const std::size_t close = closing_bracket(tokens, i + 1);
  for (std::size_t j = i + 2; j < close; ++j) {
    if (tokens[j].is_sign('(')) {
      j = closing_bracket(tokens, j);
    } else if (tokens[j].is_sign(',')) {
      return false;
    }
  }
  return true;
}

}  // namespace oblique::server
