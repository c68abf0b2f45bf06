#include "server/asking/plan.h"

#include <algorithm>
#include <span>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/asking/columns.h"
#include "server/asking/elements.h"
#include "server/asking/grouping.h"
#include "server/asking/question.h"
#include "server/asking/sql/sql_expression.h"
#include "server/asking/sql/sql_functions.h"
#include "server/asking/sql/sql_items.h"
#include "server/asking/statement.h"
#include "server/asking/suggestions.h"
#include "server/database/sqlite.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

/// The unit of a column, an element, or a function of one that keeps the unit; empty: a pure
/// number, a text, or another expression.
std::string unit_of(std::span<const SqlToken> tokens) {
  if (tokens.size() == 1 && tokens[0].is_name()) {
    return unit_of_column(name_of(tokens[0]));
  }
  if (const auto element = element_at(tokens); element.tokens > 0) {
    const bool is_all = element.tokens == tokens.size();
    return is_all && element.unit.find(',') == std::string::npos ? element.unit : "";
  }
  const bool is_call = tokens.size() > 3 && tokens[0].kind == SqlToken::Kind::kName &&
                       tokens[1].is_sign('(') && closing_bracket(tokens, 1) == tokens.size() - 1;
  const SqlFunction* const function = is_call ? find_sql_function(tokens[0].text) : nullptr;
  if (function == nullptr || !function->keeps_unit) {
    return {};
  }
  const auto arguments = tokens.subspan(2, tokens.size() - 3);
  const auto comma = std::find_if(arguments.begin(), arguments.end(),
                                  [](const SqlToken& token) { return token.is_sign(','); });
  return unit_of({arguments.begin(), comma});
}

/// Names and units. `text` is what was selected, as it was written.
std::vector<PlannedColumn> planned_columns(std::vector<std::string> names,
                                           const std::string& text) {
  const auto tokens = sql_tokens(text);
  const auto items = sql_items(tokens);
  std::vector<PlannedColumn> columns;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string unit =
        items.size() == names.size() ? unit_of(items[i].tokens) : unit_of_column(names[i]);
    columns.push_back({std::move(names[i]), unit});
  }
  return columns;
}

/// Throws solver::InputError, naming the flag, for a text that alone is no SQL: what SQLite says of
/// the whole statement speaks of what stands around it.
void check_syntax(sqlite3* database, const protocol::StudyQuery& question) {
  const auto check = [&](const char* flag, const std::string& text, const std::string& sql) {
    if (text.empty()) {
      return;
    }
    try {
      (void)columns_of_statement(database, sql);
    } catch (const solver::InputError& error) {
      const std::string_view says = error.what();
      const bool is_cut = says.find("incomplete input") != std::string_view::npos;
      if (is_cut || says.find("syntax error") != std::string_view::npos) {
        throw solver::InputError(fmt::format(
            "{} \"{}\" is not allowed: {}", flag, text,
            is_cut ? "something must follow its end" : says.substr(says.find(": ") + 2)));
      }
    }
  };
  const std::string selected = selected_by(question);
  check("--select", selected, "SELECT " + with_elements(selected));
  check("--where", question.where(), "SELECT 1 WHERE " + with_elements(question.where()));
  check("--group", question.group(), "SELECT 1 GROUP BY " + with_elements(question.group()));
  check("--order", question.order(), "SELECT 1 ORDER BY " + with_elements(question.order()));
}

/// Gives a question that selects nothing its columns.
void select_usual(protocol::StudyQuery& question, const protocol::Recipe& recipe) {
  if (!question.select().empty()) {
    return;
  }
  if (!question.group().empty()) {
    question.add_select(question.group());
    question.add_select("count(*)");
    return;
  }
  for (const std::string& column : usual_columns(recipe)) {
    question.add_select(column);
  }
}

}  // namespace

Plan plan(sqlite3* database, protocol::StudyQuery question) {
  check(question);
  const auto known =
      columns_of_statement(database, fmt::format("SELECT * FROM {} LIMIT 0", rows_of_queries()));
  const AskedStudy study = asked_study(database, question.study());
  select_usual(question, study.recipe);
  check_columns(question, known);
  const std::string written = selected_by(question);
  Plan plan;
  plan.goes_on_by_point = is_in_point_order(question) && gives_points(written);
  std::string selected = columns_in_sqlite(written);
  selected += plan.goes_on_by_point ? ", point" : "";
  plan.statement = statement_of(database, question, selected, study);
  try {
    auto names = columns_of_statement(database, plan.statement);
    if (plan.goes_on_by_point) {
      names.pop_back();
    }
    plan.columns = planned_columns(std::move(names), written);
  } catch (const solver::InputError& error) {
    check_syntax(database, question);
    throw solver::InputError(with_suggestions(error.what(), known) +
                             what_quotes_mean(error.what(), plan.statement));
  }
  return plan;
}

}  // namespace oblique::server
