#include "server/query/question.h"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/keys.h"
#include "server/query/columns.h"
#include "server/query/elements.h"
#include "server/query/sql_functions.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"

namespace oblique::server {
namespace {

using Tokens = std::span<const SqlToken>;

constexpr const char* kWhere = "--where";
constexpr const char* kSelect = "--select";
constexpr const char* kGroup = "--group";
constexpr const char* kOrder = "--order";

/// Keys with more than one value over the points of a recipe. A key that only some of the blocks
/// have counts as varying, and so does a key with an expression or a distribution.
std::set<std::string_view> varying_keys(const protocol::Recipe& recipe) {
  struct Seen {
    int blocks = 0;
    double value = 0.0;
    bool varies = false;
  };
  std::map<std::string_view, Seen> seen;
  for (const auto& block : recipe.blocks()) {
    for (const auto& axis : block.axes()) {
      Seen& key = seen[axis.key()];
      const bool has_one_value = protocol::has_own_values(axis) && protocol::axis_size(axis) == 1;
      const double value = has_one_value ? protocol::axis_value(axis, 0) : 0.0;
      key.varies = key.varies || !has_one_value || (key.blocks > 0 && value != key.value);
      key.value = value;
      ++key.blocks;
    }
  }
  std::set<std::string_view> varying;
  for (const auto& [key, found] : seen) {
    if (found.varies || found.blocks < recipe.blocks_size()) {
      varying.insert(key);
    }
  }
  if (recipe.blocks().empty()) {
    varying = {"H", "mu", "e"};
  }
  return varying;
}

/// Whether a function that aggregates rows is called at token `i`. min and max with several
/// arguments do not aggregate.
bool calls_aggregate(Tokens tokens, std::size_t i) {
  const bool is_call = i + 1 < tokens.size() && tokens[i].kind == SqlToken::Kind::kName &&
                       tokens[i + 1].is_sign('(');
  const SqlFunction* const function = is_call ? find_sql_function(tokens[i].text) : nullptr;
  if (function == nullptr || !function->aggregates) {
    return false;
  }
  const std::size_t close = closing_bracket(tokens, i + 1);
  const bool compares = function->name == "min" || function->name == "max";
  return !compares || sql_items(tokens.subspan(i + 2, close - i - 2)).size() == 1;
}

/// If an aggregate (with its FILTER) or a subquery begins at token `i`, the index of the token
/// after it; else `i`.
std::size_t skipped(Tokens tokens, std::size_t i) {
  if (tokens[i].is_sign('(') && i + 1 < tokens.size() && is_word(tokens[i + 1], "select")) {
    return closing_bracket(tokens, i) + 1;
  }
  if (!calls_aggregate(tokens, i)) {
    return i;
  }
  const std::size_t end = closing_bracket(tokens, i + 1) + 1;
  const bool is_filtered = end + 1 < tokens.size() && is_word(tokens[end], "filter");
  return std::min(is_filtered ? closing_bracket(tokens, end + 1) + 1 : end, tokens.size());
}

/// Whether the tokens have an aggregate that is not a window function.
bool has_aggregate(Tokens tokens) {
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const std::size_t end = skipped(tokens, i);
    if (end > i && calls_aggregate(tokens, i) &&
        (end == tokens.size() || !is_word(tokens[end], "over"))) {
      return true;
    }
    i = end > i ? end - 1 : i;
  }
  return false;
}

/// The first of `columns`, or of the elements of lists, in `item` that is neither a key nor inside
/// an aggregate; empty: none.
std::string ungrouped_column(const SqlItem& item, std::span<const SqlItem> keys,
                             std::span<const std::string> columns) {
  const auto is_key = [&](Tokens part) {
    return std::any_of(keys.begin(), keys.end(), [&](const SqlItem& key) {
      return std::equal(part.begin(), part.end(), key.tokens.begin(), key.tokens.end(),
                        [](const auto& a, const auto& b) { return a.text == b.text; });
    });
  };
  const bool is_key_by_alias =
      !item.alias.empty() && std::any_of(keys.begin(), keys.end(), [&](const SqlItem& key) {
        return key.text == item.alias;
      });
  if (item.text.starts_with("*")) {
    return "*";
  }
  if (is_key_by_alias || is_key(item.tokens)) {
    return {};
  }
  for (std::size_t i = 0; i < item.tokens.size();) {
    const Tokens rest = item.tokens.subspan(i);
    if (const std::size_t end = skipped(item.tokens, i); end > i) {
      i = end;
      continue;
    }
    const std::size_t length = element_at(rest).tokens;
    const bool is_call = rest.size() > 1 && rest[1].is_sign('(');
    const bool is_column =
        length > 0 || (rest[0].is_name() && !is_call &&
                       std::ranges::find(columns, name_of(rest[0])) != columns.end());
    const Tokens part = rest.first(std::max<std::size_t>(length, 1));
    if (is_column && !is_key(part)) {
      return {part.front().text.begin(), part.back().text.end()};
    }
    i += part.size();
  }
  return {};
}

void check_grouped(std::string_view flag, std::string_view text,
                   const protocol::StudyQuery& question, std::span<const std::string> columns) {
  const auto tokens = sql_tokens(text);
  const auto selected = selected_by(question);
  const auto key_tokens = sql_tokens(question.group());
  if (tokens.empty() || (key_tokens.empty() && !has_aggregate(sql_tokens(selected)))) {
    return;
  }
  const auto keys = key_tokens.empty() ? std::vector<SqlItem>() : sql_items(key_tokens);
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

}  // namespace

std::vector<std::string> usual_columns(const protocol::Recipe& recipe) {
  std::vector<std::string> columns{"point"};
  const auto varying = varying_keys(recipe);
  const auto add_if_varying = [&](std::string_view key) {
    if (varying.contains(key)) {
      columns.push_back(column_of_key(key));
    }
  };
  for (const auto& key : solver::point_keys()) {
    add_if_varying(key.name);
  }
  for (const auto& key : solver::model_keys()) {
    add_if_varying(key.name);
  }
  const auto is_single_length = [](std::string_view key) {
    return protocol::link_of_key(protocol::key_number(key)).has_value();
  };
  if (std::any_of(varying.begin(), varying.end(), is_single_length)) {
    columns.emplace_back("lengths_m");
  }
  for (const char* output : {"status", "fn_peak_N", "ft_peak_N", "duration_s", "slide_m",
                             "stick_total_s", "major_mode"}) {
    columns.emplace_back(output);
  }
  return columns;
}

std::string selected_by(const protocol::StudyQuery& question) {
  return fmt::format("{}", fmt::join(question.select(), ", "));
}

void check_parts(const protocol::StudyQuery& question) {
  for (const std::string& columns : question.select()) {
    check_sql_part(kSelect, columns, SqlPart::kColumns);
  }
  if (!question.where().empty()) {
    check_sql_part(kWhere, question.where(), SqlPart::kCondition);
  }
  if (!question.group().empty()) {
    check_sql_part(kGroup, question.group(), SqlPart::kGroup);
  }
  if (!question.order().empty()) {
    check_sql_part(kOrder, question.order(), SqlPart::kOrder);
  }
}

void check_columns(const protocol::StudyQuery& question, std::span<const std::string> columns) {
  const std::string selected = selected_by(question);
  const auto aliases = aliases_in(selected);
  check_case_of_columns(kSelect, selected, columns, aliases);
  check_case_of_columns(kWhere, question.where(), columns, aliases);
  check_case_of_columns(kGroup, question.group(), columns, aliases);
  check_case_of_columns(kOrder, question.order(), columns, aliases);
  check_grouped(kSelect, selected, question, columns);
  // ORDER BY prefers an alias to a column of the same name.
  std::vector<std::string> others(columns.begin(), columns.end());
  std::erase_if(others, [&](const std::string& column) {
    return std::ranges::find(aliases, column) != aliases.end();
  });
  check_grouped(kOrder, question.order(), question, others);
}

}  // namespace oblique::server
