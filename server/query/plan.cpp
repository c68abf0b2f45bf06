#include "server/query/plan.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/checks.h"
#include "proto/suggestion.h"
#include "server/database/sqlite.h"
#include "server/query/columns.h"
#include "server/query/elements.h"
#include "server/query/point_ranges.h"
#include "server/query/query_rules.h"
#include "server/query/question.h"
#include "server/query/sql_functions.h"
#include "server/query/sql_text.h"
#include "server/store/schema.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

using Tokens = std::span<const SqlToken>;
using Names = std::vector<std::string>;

bool contains(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

struct QueriedStudy {
  std::int64_t study_id;
  protocol::Recipe recipe;  ///< without blocks if it cannot be read or has too few points
};

QueriedStudy find_study(sqlite3* database, const std::string& name) {
  Statement study(database, "SELECT study_id, points, recipe FROM studies WHERE name = ?1");
  study.bind(1, name);
  if (!study.step()) {
    throw solver::InputError(fmt::format("there is no study called \"{}\"", name));
  }
  QueriedStudy found{study.integer(0), {}};
  try {
    if (!protocol::parse_recipe(study.bytes(2), found.recipe) ||
        points_of(found.recipe) < static_cast<std::uint64_t>(study.integer(1))) {
      found.recipe.Clear();
    }
  } catch (const solver::InputError&) {
    found.recipe.Clear();  // it has more points than a study may have
  }
  return found;
}

/// The columns that a statement returns. Throws solver::InputError with SQLite's message.
Names columns_of(sqlite3* database, const std::string& sql) {
  sqlite3_stmt* raw = nullptr;
  const int code =
      sqlite3_prepare_v2(database, sql.data(), static_cast<int>(sql.size()), &raw, nullptr);
  const std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> statement(raw, &sqlite3_finalize);
  if (code != SQLITE_OK) {
    const std::string reason = sqlite3_errmsg(database);
    if (const auto missing = missing_views(database); !missing.empty()) {
      throw solver::InputError(fmt::format(
          "the question cannot be answered: the database lacks its view {0} ({1}). A server, or "
          "`oblique run`, makes it again when it starts on this file; `oblique check` names all",
          fmt::join(missing, ", "), reason));
    }
    throw solver::InputError(fmt::format("the question is wrong: {}", reason));
  }
  Names names;
  for (int i = 0; i < sqlite3_column_count(raw); ++i) {
    const char* name = sqlite3_column_name(raw, i);
    names.emplace_back(name == nullptr ? "" : name);
  }
  return names;
}

/// The columns from which a query may select.
Names columns_of_rows(sqlite3* database) {
  Names columns = columns_of(database, "SELECT * FROM runs LIMIT 0");
  for (const ListColumn& list : lists_of_queries()) {
    columns.push_back(list.name);
  }
  return columns;
}

/// The ranges as a table to join with; empty for a single one.
std::string join_of(const std::vector<PointRange>& ranges) {
  if (ranges.size() < 2) {
    return {};
  }
  // SQLite reads a JSON list faster than it compiles VALUES.
  std::string list;
  for (const PointRange& range : ranges) {
    list += fmt::format("{}\"{}\":{}", list.empty() ? "" : ",", range.first, range.last);
  }
  return fmt::format("json_each('{{{}}}') AS span CROSS JOIN ", list);
}

/// The condition in SQL that restricts points to `ranges`. A study without a recipe has no ranges
/// and is not restricted. A range of all points is left out, because it would keep SQLite from
/// looking up the points that the user's condition names, for example with IN.
std::string condition_of(const std::vector<PointRange>& ranges, const protocol::Recipe& recipe) {
  if (ranges.empty()) {
    return recipe.blocks().empty() ? "1" : "0";
  }
  if (ranges.size() == 1 && points_in(ranges) == points_of(recipe)) {
    return "1";
  }
  if (ranges.size() == 1) {
    return fmt::format("runs.point BETWEEN {} AND {}", ranges[0].first, ranges[0].last);
  }
  return "runs.point BETWEEN CAST(span.key AS INTEGER) AND span.value";
}

/// All names in a text, whether of columns or not.
Names names_in(std::string_view text) {
  Names names;
  for (const SqlToken& token : sql_tokens(text)) {
    if (token.is_name()) {
      names.push_back(name_of(token));
    }
  }
  return names;
}

/// The table that is read as `runs`, and an addition to its condition. SQLite does not use the
/// index of failed points unless the statement names it, because SQLite cannot estimate that they
/// are few.
std::pair<std::string, std::string> table_of(const std::string& where, const QueriedStudy& study,
                                             bool is_in_results) {
  if (!wants_only_failed(where)) {
    return {is_in_results ? "results AS runs" : "runs AS runs", ""};
  }
  if (is_in_results) {
    return {"results AS runs INDEXED BY failed_points", " AND runs.error IS NOT NULL"};
  }
  return {"runs AS runs", fmt::format(" AND runs.point IN (SELECT point FROM results INDEXED BY "
                                      "failed_points WHERE study_id = {} AND error IS NOT NULL)",
                                      study.study_id)};
}

/// The rows of a study in `ranges`, with the columns that `text` names. They come from the table
/// `results` if it has all of these, because looking up the model and worker of each row is slow.
std::string rows_of(sqlite3* database, const protocol::StudyQuery& question,
                    const QueriedStudy& study, const std::vector<PointRange>& ranges,
                    std::string_view text, const Names& columns) {
  const Names named = names_in(text);
  const Names stored = columns_of(database, "SELECT * FROM results LIMIT 0");
  // The view shows these lists in another form than the table.
  const Names shown{"phases", "ft_peaks", "ft_peaks_N"};
  const auto& lists = lists_of_queries();
  const auto is_in_results = [&](const std::string& name) {
    const bool is_list = std::any_of(lists.begin(), lists.end(),
                                     [&](const ListColumn& list) { return list.name == name; });
    return (name == "study" || is_list || contains(stored, name)) && !contains(shown, name);
  };
  const bool has_all = std::all_of(named.begin(), named.end(), [&](const std::string& name) {
    return !contains(columns, name) || is_in_results(name);
  });
  std::string selected = "runs.point";
  const auto add = [&](std::string_view name, std::string_view sql) {
    selected += contains(named, name) ? fmt::format(", {} AS {}", sql, name) : "";
  };
  for (const std::string& column : columns) {
    const auto list = std::find_if(lists.begin(), lists.end(),
                                   [&](const ListColumn& each) { return each.name == column; });
    if (column == "study") {
      add(column, sql_text(question.study()));
    } else if (list != lists.end()) {
      add(column, list->sql);
    } else if (column != "point") {
      add(column, "runs." + column);
    }
  }
  const char* const list_of =
      has_all ? "runs.{}"
              : "(SELECT {} FROM results AS stored WHERE stored.study_id = runs.study_id AND "
                "stored.point = runs.point)";
  add(kStoredPhases, fmt::format(fmt::runtime(list_of), "phases"));
  add(kStoredFtPeaks, fmt::format(fmt::runtime(list_of), "ft_peaks"));
  const auto [table, condition] = table_of(question.where(), study, has_all);
  return fmt::format("(SELECT {} FROM {}{} WHERE runs.study_id = {} AND {}{})", selected,
                     join_of(ranges), table, study.study_id, condition_of(ranges, study.recipe),
                     condition);
}

/// Whether the requested order is that of rising points.
bool is_in_point_order(const protocol::StudyQuery& question) {
  const std::string selected = selected_by(question);
  const auto selected_tokens = sql_tokens(selected);
  // A window function sorts the rows, and ORDER BY prefers an alias `point` to the column.
  if (std::ranges::any_of(selected_tokens,
                          [](const auto& each) { return is_word(each, "over"); }) ||
      std::ranges::any_of(aliases_in(selected),
                          [](const auto& alias) { return same_but_case(alias, "point"); })) {
    return false;
  }
  const auto tokens = sql_tokens(question.order());
  return question.group().empty() &&
         (tokens.empty() ||
          (tokens[0].text == "point" &&
           (tokens.size() == 1 || (tokens.size() == 2 && is_word(tokens[1], "asc")))));
}

std::string statement_of(sqlite3* database, const protocol::StudyQuery& question,
                         const QueriedStudy& study, const Names& columns,
                         const std::vector<PointRange>& ranges) {
  const std::string selected = columns_in_sqlite(selected_by(question), columns);
  const std::string where =
      question.where().empty() ? "" : fmt::format(" WHERE ({})", in_sqlite(question.where()));
  const std::string group = in_sqlite(question.group());
  const std::string order = !question.order().empty() ? in_sqlite(question.order())
                            : group.empty()           ? "point"
                                                      : group;
  // The study is chosen in the subquery, where no condition can reach another one.
  std::string statement =
      fmt::format("SELECT {} FROM {}{}", selected,
                  rows_of(database, question, study, ranges,
                          fmt::format("{} {} {} {}", selected, where, group, order), columns),
                  where);
  statement += group.empty() ? "" : fmt::format(" GROUP BY {}", group);
  // SQLite reads the ranges of a cross join one after another, and the rows of each by their key.
  const bool is_sorted = ranges.size() > 1 && is_in_point_order(question);
  statement += is_sorted ? "" : fmt::format(" ORDER BY {}", order);
  if (question.has_limit()) {
    statement += fmt::format(" LIMIT {}", std::min<std::uint64_t>(question.limit(), INT64_MAX));
  }
  return statement;
}

/// The unit of a column, of an element, or of a function of one of these that keeps the unit. Empty
/// for a pure number, a text, and other expressions.
std::string unit_of(Tokens tokens) {
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
  return function != nullptr && function->keeps_unit
             ? unit_of(sql_items(tokens.subspan(2, tokens.size() - 3)).front().tokens)
             : "";
}

std::vector<PlannedColumn> with_units(Names names, const std::string& selected) {
  const auto tokens = sql_tokens(selected);
  const auto items = sql_items(tokens);
  std::vector<PlannedColumn> columns;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string unit =
        items.size() == names.size() ? unit_of(items[i].tokens) : unit_of_column(names[i]);
    columns.push_back({std::move(names[i]), unit});
  }
  return columns;
}

/// The part of `message` after `begin`; empty if `message` does not contain it.
std::string behind(const std::string& message, std::string_view begin) {
  const auto at = message.find(begin);
  return at == std::string::npos ? "" : message.substr(at + begin.size());
}

/// The column that SQLite did not find; empty for other messages.
std::string missing_column(const std::string& message) {
  const std::string wrong = behind(message, "no such column: ");
  // SQLite 3.42 and later may quote the name and add a remark.
  const auto remark = wrong.find("\" - should this");
  return remark == std::string::npos ? wrong : wrong.substr(1, remark - 1);
}

/// A hint about a name that SQLite did not find; empty for other messages.
std::string name_hint(const std::string& message) {
  const std::string function = behind(message, "no such function: ");
  const std::string wrong = function.empty() ? missing_column(message) : function;
  if (wrong.empty()) {
    return {};
  }
  if (same_but_case(function, "regexp") || same_but_case(function, "match")) {
    return "; patterns are those of GLOB, as mode GLOB 'SC*', and of LIKE, as mode LIKE '%sR%'";
  }
  const auto columns = columns_and_functions();
  std::vector<std::string_view> names;  // without brackets
  for (const Column& column : columns) {
    const std::string_view name = column.name;
    names.push_back(function.empty() || column.kind == "function" ? name.substr(0, name.find('('))
                                                                  : std::string_view());
  }
  std::string meant;
  if (const auto nearest = protocol::nearest(wrong, names); !nearest.empty()) {
    const auto index = std::find(names.begin(), names.end(), nearest) - names.begin();
    meant = fmt::format(" (did you mean `{}`?)", columns[static_cast<std::size_t>(index)].name);
  }
  return meant + "; `oblique columns` lists all";
}

/// Throws solver::InputError, which names the flag, for a text that is not valid SQL by itself.
/// SQLite's message about the whole statement would quote text that the user did not write.
void check_syntax(sqlite3* database, const protocol::StudyQuery& question) {
  const struct {
    const char* flag;
    const char* before;
    std::string text;
  } parts[] = {{"--select", "SELECT ", selected_by(question)},
               {"--where", "SELECT 1 WHERE ", question.where()},
               {"--group", "SELECT 1 GROUP BY ", question.group()},
               {"--order", "SELECT 1 ORDER BY ", question.order()}};
  for (const auto& [flag, before, text] : parts) {
    try {
      if (!text.empty()) {
        (void)columns_of(database, before + with_elements(text));
      }
    } catch (const solver::InputError& error) {
      const std::string_view message = error.what();
      const bool is_cut = message.find("incomplete input") != std::string_view::npos;
      if (is_cut || message.find("syntax error") != std::string_view::npos) {
        throw solver::InputError(fmt::format(
            "{} \"{}\" is not allowed: {}", flag, text,
            is_cut ? "something must follow its end" : message.substr(message.find(": ") + 2)));
      }
    }
  }
}

/// Sets the default columns of a query that selects none.
void select_usual(protocol::StudyQuery& question, const protocol::Recipe& recipe) {
  if (question.select().empty() && !question.group().empty()) {
    question.add_select(question.group());
    question.add_select("count(*)");
  } else if (question.select().empty()) {
    for (const std::string& column : usual_columns(recipe)) {
      question.add_select(column);
    }
  }
}

}  // namespace

std::string quotes_hint(const std::string& message, std::string_view sql) {
  const std::string wrong = missing_column(message);
  return wrong.empty() || sql.find(sql_name(wrong)) == std::string_view::npos
             ? ""
             : "; in double quotes stands the name of a column, in single quotes a text";
}

Plan plan(sqlite3* database, protocol::StudyQuery question) {
  check_parts(question);
  const QueriedStudy study = find_study(database, question.study());
  select_usual(question, study.recipe);
  const Names columns = columns_of_rows(database);
  check_columns(question, columns);
  auto ranges = point_ranges(study.recipe, question.where());
  if (ranges.size() > 1 && wants_only_failed(question.where())) {
    ranges = hull(ranges);  // the index of failed points selects fewer rows
  }
  Plan plan{statement_of(database, question, study, columns, ranges), {}};
  if (plan.statement.size() > kLongestSql && ranges.size() > 1) {
    plan.statement = statement_of(database, question, study, columns, hull(ranges));
  }
  try {
    plan.columns = with_units(columns_of(database, plan.statement), selected_by(question));
  } catch (const solver::InputError& error) {
    check_syntax(database, question);
    throw solver::InputError(error.what() + name_hint(error.what()) +
                             quotes_hint(error.what(), plan.statement));
  }
  return plan;
}

}  // namespace oblique::server
