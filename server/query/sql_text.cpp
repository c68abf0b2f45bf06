#include "server/asking/sql/sql_expression.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/asking/sql/sql_items.h"
#include "server/asking/sql/sql_tokens.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

/// A word with which another clause or statement begins.
bool begins_clause(const std::vector<SqlToken>& tokens, std::size_t i) {
  constexpr std::array<std::string_view, 14> kWords{
      "select", "values", "with",   "from",  "where",  "group",     "having",
      "order",  "limit",  "offset", "union", "except", "intersect", "window"};
  const bool is_one = std::any_of(kWords.begin(), kWords.end(),
                                  [&](std::string_view word) { return is_word(tokens[i], word); });
  const bool is_distinct_from =
      is_word(tokens[i], "from") && i >= 2 && is_word(tokens[i - 1], "distinct");
  return is_one && !is_distinct_from;
}

void check_tokens(const std::vector<SqlToken>& tokens, SqlPart part) {
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

std::string what_is_allowed(SqlPart part) {
  constexpr std::string_view kWithout =
      ", without comments, parameters (?, :x, @x, $x) and semicolons";
  switch (part) {
    case SqlPart::kCondition:
      return fmt::format("it must be one condition, as in \"mu > 0.5 AND e = 1\"{}", kWithout);
    case SqlPart::kColumns:
      return fmt::format(
          "it must be columns or expressions of them, as in \"mu, fn_peak_N / 1000 AS fn_kN\"{}",
          kWithout);
    case SqlPart::kGroup:
      return fmt::format("it must be columns to group by, as in \"major_mode, e\"{}", kWithout);
    case SqlPart::kOrder:
      break;
  }
  return fmt::format("it must be columns to sort by, as in \"mu, fn_peak_N DESC\"{}", kWithout);
}

std::string not_allowed(std::string_view flag, std::string_view text, const std::string& why) {
  constexpr std::size_t kLongest = 200;
  // An error ends at a zero byte, so what it quotes must end before.
  const std::string quoted(text.substr(0, text.find('\0')));
  const std::string shown = protocol::shortened(quoted, kLongest);
  return fmt::format("{} \"{}{}\" is not allowed: {}", flag, shown,
                     shown.size() < quoted.size() ? "..." : "", why);
}

bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Whether token `i`, a name, is meant to be a column.
bool names_a_column(const std::vector<SqlToken>& tokens, std::size_t i,
                    const std::vector<std::string>& columns) {
  const bool calls_or_qualifies =
      i + 1 < tokens.size() && (tokens[i + 1].is_sign('(') || tokens[i + 1].is_sign('.'));
  if (calls_or_qualifies || i == 0) {
    return !calls_or_qualifies;
  }
  // A name behind a whole operand is one that is given to it, with AS or without.
  const SqlToken& before = tokens[i - 1];
  const bool follows_operand = before.kind == SqlToken::Kind::kLiteral ||
                               before.kind == SqlToken::Kind::kQuotedName || before.is_sign(')') ||
                               (before.is_name() && contains(columns, name_of(before)));
  return !is_word(before, "as") && !follows_operand;
}

/// "e, or E_Pa" for E: the one that SQL takes it for, and those that it may be short for.
std::string right_names(std::string_view wrong, const std::string& taken_for,
                        const std::vector<std::string>& columns) {
  std::string right = taken_for;
  for (const std::string& column : columns) {
    if (column.starts_with(std::string(wrong) + "_")) {
      right += ", or " + column;
    }
  }
  return right;
}

}  // namespace

void check_sql_part(std::string_view flag, std::string_view text, SqlPart part) {
  try {
    check_tokens(sql_tokens(text), part);
  } catch (const NotSqlPart& error) {
    throw solver::InputError(
        not_allowed(flag, text, fmt::format("{}; {}", error.what(), what_is_allowed(part))));
  }
}

void check_case_of_columns(std::string_view flag, std::string_view text,
                           const std::vector<std::string>& columns,
                           const std::vector<std::string>& names_given) {
  const auto tokens = sql_tokens(text);
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (!tokens[i].is_name() || !names_a_column(tokens, i, columns)) {
      continue;
    }
    const std::string name = name_of(tokens[i]);
    const auto taken_for =
        std::find_if(columns.begin(), columns.end(),
                     [&](const std::string& column) { return same_but_case(column, name); });
    if (taken_for != columns.end() && !contains(columns, name) && !contains(names_given, name)) {
      throw solver::InputError(
          not_allowed(flag, text,
                      fmt::format("{} is no column, and SQL would take it for {}: write {}", name,
                                  *taken_for, right_names(name, *taken_for, columns))));
    }
  }
}

std::vector<std::string> names_given_in(std::string_view text) {
  const auto tokens = sql_tokens(text);
  std::vector<std::string> names;
  for (std::size_t i = 1; i < tokens.size(); ++i) {
    if (tokens[i].is_name() && is_word(tokens[i - 1], "as")) {
      names.push_back(name_of(tokens[i]));
    }
  }
  return names;
}

std::string sql_text(const std::string& text) {
  std::string quoted = "'";
  for (const char letter : text) {
    quoted.append(letter == '\'' ? 2 : 1, letter);
  }
  quoted += '\'';
  return quoted;
}

}  // namespace oblique::server
