#include "server/asking/grouping.h"

#include <algorithm>
#include <array>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "server/asking/columns.h"
#include "server/asking/elements.h"
#include "server/asking/sql/sql_items.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

using GroupTokens = std::span<const SqlToken>;

bool is_same(GroupTokens a, GroupTokens b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const SqlToken& x, const SqlToken& y) { return x.text == y.text; });
}

bool calls(GroupTokens tokens, std::size_t i) {
  return i + 1 < tokens.size() && tokens[i].kind == SqlToken::Kind::kName &&
         tokens[i + 1].is_sign('(');
}

bool gathers(GroupTokens tokens, std::size_t i) {
  const std::size_t close = closing_bracket(tokens, i + 1);
  return is_aggregate(tokens[i].text, arguments_in(tokens, i + 1, close));
}

/// The token behind what is called at `i`, FILTER (WHERE ...) included, which chooses among rows.
std::size_t end_of_call(GroupTokens tokens, std::size_t i) {
  const std::size_t close = closing_bracket(tokens, i + 1);
  const bool is_filtered = close + 2 < tokens.size() && is_word(tokens[close + 1], "filter");
  return std::min(tokens.size(), (is_filtered ? closing_bracket(tokens, close + 2) : close) + 1);
}

bool begins_question(GroupTokens tokens, std::size_t i) {
  return tokens[i].is_sign('(') && i + 1 < tokens.size() && is_word(tokens[i + 1], "select");
}

/// The first function that makes one row of many; empty: none.
std::string first_gathering(GroupTokens tokens) {
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (begins_question(tokens, i)) {
      i = closing_bracket(tokens, i);
    } else if (calls(tokens, i) && gathers(tokens, i)) {
      const std::size_t end = end_of_call(tokens, i);
      if (end == tokens.size() || !is_word(tokens[end], "over")) {
        return std::string(tokens[i].text);
      }
    }
  }
  return {};
}

/// The first column in `tokens` that is neither gathered nor one of `group`; empty: none.
std::string loose_column(GroupTokens tokens, const std::vector<SqlItem>& group,
                         const std::vector<std::string>& columns) {
  const auto is_grouped = [&](GroupTokens part) {
    return std::any_of(group.begin(), group.end(),
                       [&](const SqlItem& item) { return is_same(item.tokens, part); });
  };
  if (is_grouped(tokens)) {
    return {};
  }
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const auto element = element_at(tokens.subspan(i));
    if (calls(tokens, i) && gathers(tokens, i)) {
      i = end_of_call(tokens, i) - 1;
      continue;
    }
    if (begins_question(tokens, i)) {
      i = closing_bracket(tokens, i);
      continue;
    }
    const std::size_t length = std::max<std::size_t>(element.tokens, 1);
    const bool is_column = element.tokens > 0 || (tokens[i].is_name() && !calls(tokens, i) &&
                                                  std::find(columns.begin(), columns.end(),
                                                            name_of(tokens[i])) != columns.end());
    if (is_column && !is_grouped(tokens.subspan(i, length))) {
      const auto& last = tokens[i + length - 1].text;
      return {tokens[i].text.data(), last.data() + last.size()};
    }
    i += length - 1;
  }
  return {};
}

bool is_one_of(const SqlToken& token, std::span<const std::string_view> words) {
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return is_word(token, word); });
}

/// The column that is all that the function called at `i` is given first; empty: it is given more.
std::string column_given(GroupTokens tokens, std::size_t i) {
  const bool is_distinct = i + 2 < tokens.size() && is_word(tokens[i + 2], "distinct");
  i += is_distinct ? 3U : 2U;
  const bool is_alone = i + 1 < tokens.size() && tokens[i].is_name() &&
                        (tokens[i + 1].is_sign(')') || tokens[i + 1].is_sign(','));
  return is_alone ? name_of(tokens[i]) : std::string();
}

bool is_list(std::string_view column) {
  const auto* field = solver::find_result_column(column);
  return column == "lengths_m" || solver::find_result_list(column) != nullptr ||
         (field != nullptr && std::holds_alternative<solver::ListPart>(field->value));
}

}  // namespace

void check_numbers(std::string_view flag, std::string_view text,
                   const std::vector<std::string>& names_given) {
  constexpr std::array<std::string_view, 8> kOfNumbers{"avg",        "sum",    "total",    "median",
                                                       "percentile", "stddev", "variance", "corr"};
  constexpr std::array<std::string_view, 2> kOfValues{"min", "max"};
  const auto tokens = sql_tokens(text);
  const GroupTokens all(tokens);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string column = calls(all, i) ? column_given(all, i) : std::string();
    if (kind_of_values(column) != protocol::CellKind::kText ||
        std::find(names_given.begin(), names_given.end(), column) != names_given.end()) {
      continue;
    }
    const bool has_list = is_list(column);
    const bool takes_numbers = is_one_of(all[i], kOfNumbers);
    if (takes_numbers || (has_list && is_one_of(all[i], kOfValues) && gathers(all, i))) {
      throw solver::InputError(fmt::format(
          "{} \"{}\" is not allowed: {}() takes {}, and {} is {}; `oblique columns` lists {}", flag,
          text, all[i].text, takes_numbers ? "numbers" : "numbers or texts", column,
          has_list ? "a list" : "a text",
          has_list ? "elements of lists, as peaks[0].fn_N and peaks.count" : "all columns"));
    }
  }
}

void check_gathered(std::string_view flag, std::string_view text, std::string_view group,
                    const std::vector<std::string>& columns,
                    const std::vector<std::string>& names_given) {
  const auto tokens = sql_tokens(text);
  const auto group_tokens = sql_tokens(group);
  const auto groups = sql_items(group_tokens);
  std::vector<std::string> known = columns;
  std::erase_if(known, [&](const std::string& column) {
    return std::find(names_given.begin(), names_given.end(), column) != names_given.end();
  });
  for (const SqlItem& item : sql_items(tokens)) {
    // A name that is given may be what is grouped by.
    const bool is_named_group =
        !item.name.empty() && std::any_of(groups.begin(), groups.end(), [&](const SqlItem& named) {
          return named.text == item.name;
        });
    const bool is_all = item.text.starts_with("*");
    const std::string column = is_named_group ? ""
                               : is_all       ? "*"
                                              : loose_column(item.tokens, groups, known);
    if (!column.empty()) {
      throw solver::InputError(fmt::format(
          "{} \"{}\" is not allowed with --group {}: {} has many values in a group; gather it, as "
          "with avg(), min(), max(), median() or count(), or group by it too",
          flag, text, group, column));
    }
  }
}

void check_gathered_into_one(std::string_view flag, std::string_view text,
                             const std::vector<std::string>& columns) {
  const auto tokens = sql_tokens(text);
  const std::string function = first_gathering(tokens);
  if (function.empty()) {
    return;
  }
  for (const SqlItem& item : sql_items(tokens)) {
    const std::string column =
        item.text.starts_with("*") ? "*" : loose_column(item.tokens, {}, columns);
    if (column.empty()) {
      continue;
    }
    const bool chooses = same_but_case(function, "min") || same_but_case(function, "max");
    throw solver::InputError(fmt::format(
        "{} \"{}\" is not allowed: {}() makes one row of all, in which {} has many values; gather "
        "it too, as with avg(), min(), max(), median() or count(), or{}{}",
        flag, text, function, column,
        column == "*" ? " ask for it alone" : fmt::format(" group by it: --group \"{}\"", column),
        chooses ? "; the row that has the largest value comes by --order \"... DESC\" --limit 1"
                : ""));
  }
}

bool gives_points(std::string_view selected) {
  const auto tokens = sql_tokens(selected);
  const GroupTokens all(tokens);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (is_word(all[i], "distinct") || is_word(all[i], "over") || is_word(all[i], "select") ||
        (calls(all, i) && gathers(all, i))) {
      return false;
    }
  }
  return true;
}

}  // namespace oblique::server
