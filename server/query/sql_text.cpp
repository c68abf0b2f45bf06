#include "server/query/sql_text.h"

#include <algorithm>
#include <array>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using Tokens = std::span<const SqlToken>;

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
char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool is_one_of(const SqlToken& token, std::span<const std::string_view> words) {
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return is_word(token, word); });
}

bool contains(std::span<const std::string> names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

void refuse_character(char c, char next) {
  if ((c == '-' && next == '-') || (c == '/' && next == '*')) {
    throw NotSqlPart(fmt::format("it has a comment ({}{})", c, next));
  }
  if (c == '?' || c == ':' || c == '@' || c == '$' || c == '#') {
    throw NotSqlPart(fmt::format("it has a parameter ({}), which has no value", c));
  }
  if (c == ';') {
    throw NotSqlPart("it has a semicolon");
  }
  if (c == '\0') {
    throw NotSqlPart("it has a zero byte");
  }
}

/// Length of a quoted text at the beginning of `rest`, whose quote opens at `open`. A doubled quote
/// inside is one quote.
std::size_t quoted_length(std::string_view rest, std::size_t open, char close) {
  std::size_t end = open;
  do {
    end = rest.find(close, end + 1);
    if (end == std::string_view::npos) {
      throw NotSqlPart(fmt::format("the quote {} is not closed", rest[open]));
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
    const bool has_sign = lower(rest[end]) == 'e' && end + 2 < rest.size() &&
                          (rest[end + 1] == '+' || rest[end + 1] == '-') && is_digit(rest[end + 2]);
    end += has_sign ? 2 : 1;
  }
  return end;
}

/// The token at the beginning of `rest`, which is not empty.
SqlToken first_token(std::string_view rest) {
  using Kind = SqlToken::Kind;
  const char c = rest.front();
  const char next = rest.size() > 1 ? rest[1] : '\0';
  refuse_character(c, next);
  if (rest.starts_with("\xEF\xBB\xBF")) {
    throw NotSqlPart("it has a byte-order mark");  // SQLite would read it as a space
  }
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
  return {Kind::kSign, rest.substr(0, 1)};
}

std::string_view text_over(Tokens tokens) {
  return tokens.empty() ? std::string_view()
                        : std::string_view(tokens.front().text.begin(), tokens.back().text.end());
}

/// Whether an operand may end with this token, so that a name after it is an alias.
bool ends_operand(const SqlToken& token) {
  constexpr std::array<std::string_view, 13> kJoins{"and",  "or",   "not",     "is",   "in",
                                                    "like", "glob", "between", "case", "when",
                                                    "then", "else", "collate"};
  return !is_one_of(token, kJoins) &&
         (token.kind == SqlToken::Kind::kLiteral || token.is_name() || token.is_sign(')'));
}

SqlItem item_of(Tokens tokens) {
  constexpr std::array<std::string_view, 3> kLastWords{"end", "isnull", "notnull"};
  const std::size_t count = tokens.size();
  SqlItem item{tokens, {}, text_over(tokens), {}};
  const bool has_as = count >= 3 && is_word(tokens[count - 2], "as");
  const bool has_alias = count >= 2 && tokens.back().is_name() &&
                         !is_one_of(tokens.back(), kLastWords) && ends_operand(tokens[count - 2]) &&
                         !(count == 2 && is_word(tokens[0], "distinct")) &&
                         tokens.back().text.front() != '[';
  if (has_as || has_alias) {
    item.alias = name_of(tokens.back());
    item.tokens = tokens.first(count - (has_as ? 2 : 1));
  }
  item.text = text_over(item.tokens);
  return item;
}

/// Whether another clause or statement begins with token `i`.
bool begins_clause(Tokens tokens, std::size_t i) {
  constexpr std::array<std::string_view, 14> kWords{
      "select", "values", "with",   "from",  "where",  "group",     "having",
      "order",  "limit",  "offset", "union", "except", "intersect", "window"};
  const bool is_distinct_from =
      is_word(tokens[i], "from") && i >= 2 && is_word(tokens[i - 1], "distinct");
  return is_one_of(tokens[i], kWords) && !is_distinct_from;
}

void check_tokens(Tokens tokens, SqlPart part) {
  std::size_t depth = 0;
  bool item_is_empty = true;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const SqlToken& token = tokens[i];
    if (token.is_sign('(')) {
      ++depth;
    } else if (token.is_sign(')')) {
      if (depth-- == 0) {
        throw NotSqlPart("a bracket is closed that was not opened");
      }
    } else if (depth == 0 && token.is_sign(',')) {
      if (part == SqlPart::kCondition) {
        throw NotSqlPart("it has a comma outside brackets");
      }
      if (item_is_empty) {
        throw NotSqlPart("nothing stands before a comma");
      }
      item_is_empty = true;
      continue;
    } else if (depth == 0 && begins_clause(tokens, i)) {
      throw NotSqlPart(fmt::format("it has {} outside brackets", token.text));
    }
    item_is_empty = false;
  }
  if (depth > 0) {
    throw NotSqlPart("a bracket is not closed");
  }
  if (item_is_empty) {
    throw NotSqlPart(tokens.empty() ? "it is empty" : "nothing follows the last comma");
  }
}

const char* what_is_allowed(SqlPart part) {
  switch (part) {
    case SqlPart::kCondition:
      return "one condition, as in \"mu > 0.5 AND e = 1\"";
    case SqlPart::kColumns:
      return "columns or expressions of them, as in \"mu, fn_peak_N / 1000 AS fn_kN\"";
    case SqlPart::kGroup:
      return "columns to group by, as in \"major_mode, e\"";
    case SqlPart::kOrder:
      break;
  }
  return "columns to sort by, as in \"mu, fn_peak_N DESC\"";
}

std::string not_allowed(std::string_view flag, std::string_view text, std::string_view why) {
  constexpr std::size_t kLongest = 200;
  // The message of an exception ends at a zero byte.
  const std::string printable(text.substr(0, text.find('\0')));
  const std::string shown = protocol::shortened(printable, kLongest);
  return fmt::format("{} \"{}{}\" is not allowed: {}", flag, shown,
                     shown.size() < printable.size() ? "..." : "", why);
}

/// `text` between two quotes; a quote in it is doubled.
std::string quoted(std::string_view text, char quote) {
  std::string result(1, quote);
  for (const char letter : text) {
    result.append(letter == quote ? 2 : 1, letter);
  }
  return result += quote;
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

bool same_but_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
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
  const std::string_view inside = token.text.substr(1, token.text.size() - 2);
  std::string name;
  for (std::size_t i = 0; i < inside.size(); ++i) {
    name += inside[i];
    i += inside[i] == quote && quote != ']' ? 1U : 0U;
  }
  return name;
}

std::vector<SqlItem> sql_items(std::span<const SqlToken> tokens) {
  std::vector<SqlItem> items;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (tokens[i].is_sign('(')) {
      i = closing_bracket(tokens, i);
    } else if (tokens[i].is_sign(',')) {
      items.push_back(item_of(tokens.subspan(begin, i - begin)));
      begin = i + 1;
    }
  }
  items.push_back(item_of(tokens.subspan(std::min(begin, tokens.size()))));
  return items;
}

std::vector<std::string> aliases_in(std::string_view text) {
  const auto tokens = sql_tokens(text);
  std::vector<std::string> aliases;
  for (SqlItem& item : sql_items(tokens)) {
    if (!item.alias.empty()) {
      aliases.push_back(std::move(item.alias));
    }
  }
  return aliases;
}

std::string sql_text(std::string_view text) {
  return quoted(text, '\'');
}

std::string sql_name(std::string_view name) {
  return quoted(name, '"');
}

void check_sql_part(std::string_view flag, std::string_view text, SqlPart part) {
  try {
    check_tokens(sql_tokens(text), part);
  } catch (const NotSqlPart& error) {
    throw solver::InputError(not_allowed(
        flag, text,
        fmt::format(
            "{}; it must be {}, without comments, parameters (?, :x, @x, $x) and semicolons",
            error.what(), what_is_allowed(part))));
  }
}

void check_case_of_columns(std::string_view flag, std::string_view text,
                           std::span<const std::string> columns,
                           std::span<const std::string> aliases) {
  const auto all_tokens = sql_tokens(text);
  for (const SqlItem& item : sql_items(all_tokens)) {
    const Tokens tokens = item.tokens;
    for (std::size_t i = 0; i < tokens.size(); ++i) {
      const bool is_call_or_table =
          i + 1 < tokens.size() && (tokens[i + 1].is_sign('(') || tokens[i + 1].is_sign('.'));
      const bool is_type_or_alias = i > 0 && is_word(tokens[i - 1], "as");
      if (!tokens[i].is_name() || is_call_or_table || is_type_or_alias) {
        continue;
      }
      const std::string name = name_of(tokens[i]);
      const auto column = std::find_if(columns.begin(), columns.end(),
                                       [&](const auto& each) { return same_but_case(each, name); });
      if (column == columns.end() || contains(columns, name) || contains(aliases, name)) {
        continue;
      }
      std::string right = *column;
      for (const std::string& longer : columns) {
        right += longer.starts_with(name + "_") ? ", or " + longer : "";
      }
      throw solver::InputError(
          not_allowed(flag, text,
                      fmt::format("{} is no column, and SQL would take it for {}: write {}", name,
                                  *column, right)));
    }
  }
}

}  // namespace oblique::server
