#include "server/asking/plan.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/suggestion.h"
#include "server/asking/columns.h"
#include "server/asking/question.h"
#include "server/asking/sql_expression.h"
#include "server/asking/sql_tokens.h"
#include "server/database/sqlite.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

constexpr std::string_view kPoint = "point";

std::vector<std::string> column_names(sqlite3_stmt* statement) {
  std::vector<std::string> names;
  for (int i = 0; i < sqlite3_column_count(statement); ++i) {
    const char* name = sqlite3_column_name(statement, i);
    names.emplace_back(name == nullptr ? "" : name);
  }
  return names;
}

using PreparedQuestion = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

/// Throws solver::InputError with what SQLite says against it.
PreparedQuestion prepared(sqlite3* database, const std::string& sql) {
  sqlite3_stmt* raw = nullptr;
  const int code =
      sqlite3_prepare_v2(database, sql.data(), static_cast<int>(sql.size()), &raw, nullptr);
  PreparedQuestion statement(raw, &sqlite3_finalize);
  if (code != SQLITE_OK) {
    throw solver::InputError(fmt::format("the question is wrong: {}", sqlite3_errmsg(database)));
  }
  return statement;
}

/// The columns that questions may name.
std::vector<std::string> columns_of(sqlite3* database) {
  const auto statement =
      prepared(database, fmt::format("SELECT * FROM {} LIMIT 0", rows_of_queries()));
  return column_names(statement.get());
}

/// The error of a wrong column, with the columns there are.
std::string with_columns(const std::string& message, const std::vector<std::string>& columns) {
  constexpr std::string_view kNoColumn = "no such column: ";
  const auto at = message.find(kNoColumn);
  if (at == std::string::npos) {
    return message;
  }
  const auto wrong = message.substr(at + kNoColumn.size());
  const std::vector<std::string_view> known(columns.begin(), columns.end());
  return fmt::format("{}{}; the columns are {}", message, protocol::did_you_mean(wrong, known),
                     protocol::joined(known));
}

std::int64_t number_of_study(sqlite3* database, const std::string& name) {
  Statement study(database, "SELECT study_id FROM studies WHERE name = ?1");
  study.bind(1, name);
  if (!study.step()) {
    throw solver::InputError(fmt::format("there is no study called \"{}\"", name));
  }
  return study.integer(0);
}

/// Whether each row that is selected is that of one point: nothing is gathered, and no row is left
/// out for being like another.
bool gives_points(const std::string& selected) {
  constexpr std::array<std::string_view, 9> kGatherers{
      "distinct", "over", "select", "count", "sum", "total", "avg", "group_concat", "filter"};
  const auto tokens = sql_tokens(selected);
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const bool gathers =
        std::any_of(kGatherers.begin(), kGatherers.end(),
                    [&](std::string_view word) { return same_but_case(tokens[i].text, word); });
    const bool calls = i + 1 < tokens.size() && tokens[i + 1].is_sign('(');
    // Functions that nobody here knows may gather.
    if (gathers || (tokens[i].is_name() && calls)) {
      return false;
    }
  }
  return true;
}

bool is_natural(const std::string& order) {
  const auto tokens = sql_tokens(order);
  return tokens.empty() || (tokens.size() == 1 && tokens.front().text == kPoint);
}

/// The clauses behind the rows of the study.
std::string clauses(const protocol::StudyQuery& question) {
  std::string text;
  if (!question.where().empty()) {
    text += fmt::format(" WHERE ({})", question.where());
  }
  if (!question.group().empty()) {
    text += fmt::format(" GROUP BY {}", question.group());
  }
  if (!question.order().empty()) {
    text += fmt::format(" ORDER BY {}", question.order());
  } else {
    text += fmt::format(" ORDER BY {}", question.group().empty() ? kPoint : question.group());
  }
  if (question.has_limit()) {
    text += fmt::format(" LIMIT {}", std::min<std::uint64_t>(question.limit(), INT64_MAX));
  }
  return text;
}

}  // namespace

Plan plan(sqlite3* database, const protocol::StudyQuery& question) {
  check(question);
  const auto known = columns_of(database);
  check_columns(question, known);
  Plan plan;
  const std::string selected = selected_by(question);
  plan.goes_on_by_point =
      question.group().empty() && is_natural(question.order()) && gives_points(selected);
  const std::int64_t study = number_of_study(database, question.study());
  const std::string after =
      question.has_after_point()
          ? fmt::format(" AND point > {}",
                        std::min<std::uint64_t>(question.after_point(), INT64_MAX))
          : "";
  // The study is chosen inside, where no condition can widen it.
  plan.statement = fmt::format("SELECT {}{} FROM (SELECT * FROM {} WHERE study_id = {}{}){}",
                               selected, plan.goes_on_by_point ? ", point" : "", rows_of_queries(),
                               study, after, clauses(question));
  try {
    for (std::string& name : column_names(prepared(database, plan.statement).get())) {
      plan.columns.push_back({std::move(name), {}});
    }
  } catch (const solver::InputError& error) {
    throw solver::InputError(with_columns(error.what(), known));
  }
  if (plan.goes_on_by_point) {
    plan.columns.pop_back();
  }
  return plan;
}

}  // namespace oblique::server
