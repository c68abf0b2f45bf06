#include "server/query/sql_text.h"

#include <algorithm>
#include <array>

#include <strings.h>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/errors.h"

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

/// Refuses comments, parameters and what else would end or change the statement around a text.
void check_beginning(std::string_view rest) {
  // SQLite would read the last one, a byte-order mark, as a space.
  for (const char* wrong : {"--", "/*", "?", ":", "@", "$", "#", ";", "\xEF\xBB\xBF"}) {
    if (rest.starts_with(wrong)) {
      throw InputError(fmt::format("it has {}", wrong));
    }
  }
  if (rest.front() == '\0') {
    throw InputError("it has a zero byte");
  }
}

/// Length of a quoted text at the beginning of `rest`, whose quote opens at `open`. A doubled quote
/// inside is one quote.
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

/// Length of a number: 1, 1.5, .5, 1e-5, 0x1F. Letters directly after it are included, so that
/// SQLite refuses them.
std::size_t number_length(std::string_view rest) {
  std::size_t end = 0;
  while (end < rest.size() && (continues_name(rest[end]) || rest[end] == '.')) {
    const bool has_sign = (rest[end] == 'e' || rest[end] == 'E') && end + 2 < rest.size() &&
                          (rest[end + 1] == '+' || rest[end + 1] == '-') && is_digit(rest[end + 2]);
    end += has_sign ? 2 : 1;
  }
  return end;
}

/// The token at the beginning of `rest`, which is not empty.
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

/// Whether another clause or statement begins with token `i`.
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
        throw InputError("a bracket is closed that was not opened");
      }
    } else if (depth == 0 && begins_clause(tokens, i)) {
      throw InputError(fmt::format("it has {} outside brackets", tokens[i].text));
    }
  }
  if (depth > 0) {
    throw InputError("a bracket is not closed");
  }
}

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
  // The message of an exception ends at a zero byte.
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

}  // namespace oblique::server
