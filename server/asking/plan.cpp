#include "server/asking/plan.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/asking/columns.h"
#include "server/asking/elements.h"
#include "server/asking/grouping.h"
#include "server/asking/question.h"
#include "server/asking/sql/sql_expression.h"
#include "server/asking/sql/sql_items.h"
#include "server/asking/statement.h"
#include "server/asking/suggestions.h"
#include "server/asking/units.h"
#include "server/database/sqlite.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

/// Names and units. `text` is what was selected, as it was written.
std::vector<PlannedColumn> planned_columns(std::vector<std::string> names,
                                           const std::string& text) {
  const auto tokens = sql_tokens(text);
  const auto items = sql_items(tokens);
  std::vector<PlannedColumn> columns;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string unit =
        items.size() == names.size() ? unit_of(items[i]) : unit_of_column(names[i]);
    columns.push_back({std::move(names[i]), unit});
  }
  return columns;
}

std::string shown(const std::vector<PointSpan>& spans) {
  constexpr std::size_t kShown = 4;
  std::string text;
  for (std::size_t i = 0; i < std::min(kShown, spans.size()); ++i) {
    text += fmt::format("{}{}", i == 0 ? "" : ", ", spans[i].first);
    text += spans[i].last > spans[i].first ? fmt::format("-{}", spans[i].last) : "";
  }
  return text + (spans.size() > kShown ? fmt::format(", ... {}", spans.back().last) : "");
}

std::string how_rows_are_found(const AskedStudy& study, const RowsAsked& rows) {
  if (!rows.by_spans) {
    return fmt::format("points     all {}: the condition says nothing of the recipe\n",
                       study.points);
  }
  if (rows.spans.empty()) {
    return fmt::format("points     none of {} can meet the condition\n", study.points);
  }
  const std::uint64_t all = points_of(study.recipe);
  return fmt::format("points     {} of {} by the recipe{}, in {} range{}: {}\n",
                     points_in(rows.spans), all, all == study.points ? "" : " before its filter",
                     rows.spans.size(), rows.spans.size() == 1 ? "" : "s", shown(rows.spans));
}

std::string how_rows_are_ordered(const protocol::StudyQuery& question, const RowsAsked& rows) {
  if (!question.group().empty()) {
    return fmt::format("groups     by {}\n", question.group());
  }
  if (is_in_point_order(question)) {
    return fmt::format("order      that of points, as {} are read\n",
                       rows.spans.size() > 1 ? "the ranges" : "rows");
  }
  return fmt::format("order      {}{}\n", question.order(),
                     rows.come_in_order ? ", as the ranges are read" : ", sorted in memory");
}

/// SQLite's own plan, a line a step.
std::string plan_of_sqlite(sqlite3* database, const std::string& statement) {
  Statement steps(database, "EXPLAIN QUERY PLAN " + statement);
  std::string text;
  while (steps.step()) {
    text += fmt::format("SQLite     {}\n", steps.text(3));
  }
  return text;
}

/// A statement as people are shown it: long lists of ranges are cut.
std::string shown_statement(const std::string& statement) {
  constexpr std::size_t kMost = 60;
  constexpr std::string_view kBegin = "json_each('{";
  const auto begin = statement.find(kBegin);
  const auto end = begin == std::string::npos ? begin : statement.find("}')", begin);
  if (end == std::string::npos || end - begin <= kMost) {
    return statement;
  }
  const auto cut = statement.find(',', begin + kMost / 2);
  return statement.substr(0, std::min(cut, end)) + ",..." + statement.substr(end);
}

std::string explanation_of(sqlite3* database, const protocol::StudyQuery& question,
                           const AskedStudy& study, const RowsAsked& rows,
                           const std::string& statement) {
  const std::uint64_t most =
      rows.by_spans ? std::min(points_in(rows.spans), study.points) : study.points;
  return how_rows_are_found(study, rows) +
         fmt::format("reads      at most {} rows, by their key (study_id, point)\n", most) +
         how_rows_are_ordered(question, rows) +
         fmt::format("statement  {}\n", shown_statement(statement)) +
         plan_of_sqlite(database, statement);
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
  check("--select", selected, "SELECT " + columns_in_sqlite(database, selected));
  check("--where", question.where(), "SELECT 1 WHERE " + in_sqlite(database, question.where()));
  check("--group", question.group(), "SELECT 1 GROUP BY " + in_sqlite(database, question.group()));
  check("--order", question.order(), "SELECT 1 ORDER BY " + in_sqlite(database, question.order()));
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

/// A statement that gives the lines of a text.
std::string statement_of_lines(const std::string& text) {
  std::string values;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    values += fmt::format("{}({})", values.empty() ? "" : ", ",
                          sql_text(text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return fmt::format("SELECT column1 AS plan FROM (VALUES {})", values);
}

}  // namespace

Plan plan(sqlite3* database, protocol::StudyQuery question) {
  check(question);
  const auto known =
      columns_of_statement(database, fmt::format("SELECT * FROM {} LIMIT 0", rows_of_queries()));
  const AskedStudy study = asked_study(database, question.study());
  select_usual(question, study.recipe);
  check_columns(question, known);
  const RowsAsked rows = rows_asked(question, study);
  const std::string written = selected_by(question);
  Plan plan;
  plan.goes_on_by_point = is_in_point_order(question) && gives_points(written);
  std::string selected = columns_in_sqlite(database, written);
  selected += plan.goes_on_by_point ? ", point" : "";
  plan.statement = statement_of(database, question, selected, study, rows);
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
  if (question.explain()) {
    plan.explanation = explanation_of(database, question, study, rows, plan.statement);
    plan.statement = statement_of_lines(plan.explanation);
    plan.columns = {{"plan", ""}};
    plan.goes_on_by_point = false;
  }
  return plan;
}

}  // namespace oblique::server
