#include "server/asking/grouping.h"

#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "server/asking/elements.h"
#include "server/asking/question.h"
#include "server/asking/sql/sql_items.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using GroupTokens = std::span<const SqlToken>;

bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The token behind the call at `i`, with its FILTER (WHERE ...).
std::size_t end_of_call(GroupTokens tokens, std::size_t i) {
  const std::size_t close = closing_bracket(tokens, i + 1);
  const bool is_filtered = close + 2 < tokens.size() && is_word(tokens[close + 1], "filter");
  return std::min(tokens.size(), (is_filtered ? closing_bracket(tokens, close + 2) : close) + 1);
}

bool begins_subquery(GroupTokens tokens, std::size_t i) {
  return tokens[i].is_sign('(') && i + 1 < tokens.size() && is_word(tokens[i + 1], "select");
}

/// Whether a function makes one row of many; window functions do not.
bool has_aggregate(GroupTokens tokens) {
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (begins_subquery(tokens, i)) {
      i = closing_bracket(tokens, i);
    } else if (calls_aggregate(tokens, i)) {
      const std::size_t end = end_of_call(tokens, i);
      if (end == tokens.size() || !is_word(tokens[end], "over")) {
        return true;
      }
    }
  }
  return false;
}

/// The first of `columns`, or of their elements, in `item` that is neither a key nor inside an
/// aggregate; empty: none.
std::string ungrouped_column(const SqlItem& item, const std::vector<SqlItem>& keys,
                             const std::vector<std::string>& columns) {
  const GroupTokens tokens = item.tokens;
  const auto is_key = [&](GroupTokens part) {
    return std::any_of(keys.begin(), keys.end(), [&](const SqlItem& key) {
      return std::equal(part.begin(), part.end(), key.tokens.begin(), key.tokens.end(),
                        [](const auto& a, const auto& b) { return a.text == b.text; }) ||
             (part.size() == tokens.size() && !item.name.empty() && key.text == item.name);
    });
  };
  if (item.text.starts_with("*")) {
    return "*";
  }
  for (std::size_t i = 0; i < tokens.size() && !is_key(tokens); ++i) {
    if (begins_subquery(tokens, i)) {
      i = closing_bracket(tokens, i);
      continue;
    }
    if (calls_aggregate(tokens, i)) {
      i = end_of_call(tokens, i) - 1;
      continue;
    }
    const std::size_t length = element_at(tokens.subspan(i)).tokens;
    const bool is_call = i + 1 < tokens.size() && tokens[i + 1].is_sign('(');
    const bool is_column =
        length > 0 || (tokens[i].is_name() && !is_call && contains(columns, name_of(tokens[i])));
    const GroupTokens part = tokens.subspan(i, std::max<std::size_t>(length, 1));
    if (is_column && !is_key(part)) {
      return {part.front().text.data(), part.back().text.data() + part.back().text.size()};
    }
    i += part.size() - 1;
  }
  return {};
}

}  // namespace

void check_grouped(std::string_view flag, std::string_view text,
                   const protocol::StudyQuery& question, std::vector<std::string> columns,
                   const std::vector<std::string>& names_given) {
  const std::string selected = selected_by(question);
  const auto tokens = sql_tokens(text);
  const auto key_tokens = sql_tokens(question.group());
  if (tokens.empty() || (key_tokens.empty() && !has_aggregate(sql_tokens(selected)))) {
    return;
  }
  const auto keys = key_tokens.empty() ? std::vector<SqlItem>() : sql_items(key_tokens);
  std::erase_if(columns, [&](const std::string& column) { return contains(names_given, column); });
  for (const SqlItem& item : sql_items(tokens)) {
    const std::string column = ungrouped_column(item, keys, columns);
    if (!column.empty()) {
      throw solver::InputError(fmt::format(
          "{} \"{}\" is not allowed{}: {} has many values in {}; use an aggregate, as avg({}), or "
          "add it to --group",
          flag, text, keys.empty() ? "" : fmt::format(" with --group {}", question.group()), column,
          keys.empty() ? "the one row that an aggregate makes of all points" : "a group", column));
    }
  }
}

bool gives_points(std::string_view selected) {
  const auto tokens = sql_tokens(selected);
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (is_word(tokens[i], "distinct") || is_word(tokens[i], "over") ||
        is_word(tokens[i], "select") || calls_aggregate(tokens, i)) {
      return false;
    }
  }
  return true;
}

}  // namespace oblique::server
