#include "server/asking/question.h"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/axes.h"
#include "proto/recipe/keys.h"
#include "server/asking/columns.h"
#include "server/asking/grouping.h"
#include "server/asking/sql/sql_expression.h"
#include "worker/solver/model/parameters.h"

namespace oblique::server {
namespace {

constexpr const char* kWhere = "--where";
constexpr const char* kSelect = "--select";
constexpr const char* kGroup = "--group";
constexpr const char* kOrder = "--order";

/// Keys with more than one value over the points of a recipe. A key that only some of the blocks
/// have counts as one, and so does a value that follows from others.
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

void check(const protocol::StudyQuery& question) {
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

void check_columns(const protocol::StudyQuery& question, const std::vector<std::string>& columns) {
  const std::string selected = selected_by(question);
  const auto names_given = names_given_in(selected);
  check_case_of_columns(kSelect, selected, columns, names_given);
  check_case_of_columns(kWhere, question.where(), columns, names_given);
  check_case_of_columns(kGroup, question.group(), columns, names_given);
  check_case_of_columns(kOrder, question.order(), columns, names_given);
  check_grouped(kSelect, selected, question, columns, {});
  check_grouped(kOrder, question.order(), question, columns, names_given);
}

}  // namespace oblique::server
