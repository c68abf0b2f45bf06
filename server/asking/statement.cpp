#include "server/asking/statement.h"

#include <algorithm>
#include <memory>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/checks.h"
#include "server/asking/columns.h"
#include "server/asking/elements.h"
#include "server/asking/lists/quick_views.h"
#include "server/asking/point_ranges.h"
#include "server/asking/sql/sql_expression.h"
#include "server/asking/sql/sql_items.h"
#include "server/database/sqlite.h"
#include "server/store/schema/schema_setup.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

/// The points whose rows can answer a question, in rising order.
std::vector<PointRange> points_asked(const protocol::StudyQuery& question,
                                     const AskedStudy& study) {
  std::vector<PointRange> ranges = study.recipe.blocks().empty()
                                       ? std::vector<PointRange>{{0, INT64_MAX}}
                                       : point_ranges(study.recipe, question.where());
  if (question.has_after_point()) {
    std::erase_if(ranges, [&](PointRange& range) {
      const bool is_behind = range.last > question.after_point();
      range.first = std::max(range.first, is_behind ? question.after_point() + 1 : 0);
      return !is_behind;
    });
  }
  return ranges;
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

std::string condition_of(const std::vector<PointRange>& ranges) {
  if (ranges.empty()) {
    return "0";
  }
  if (ranges.size() == 1) {
    return fmt::format("runs.point BETWEEN {} AND {}", ranges[0].first, ranges[0].last);
  }
  return "runs.point BETWEEN CAST(span.key AS INTEGER) AND span.value";
}

/// The names in a question: of columns, functions and others.
struct Named {
  std::vector<std::string> names;
  bool all_columns = false;

  bool has(std::string_view name) const {
    return std::any_of(names.begin(), names.end(),
                       [&](const std::string& known) { return same_but_case(known, name); });
  }
};

Named named_in(const std::vector<std::string>& texts) {
  Named named;
  for (const std::string& text : texts) {
    const auto tokens = sql_tokens(text);
    for (const SqlItem& item : sql_items(tokens)) {
      named.all_columns = named.all_columns || item.text.starts_with("*");
    }
    for (const SqlToken& token : tokens) {
      if (token.is_name()) {
        named.names.push_back(name_of(token));
      }
    }
  }
  return named;
}

/// Whether `results` has every named column. Then models and workers need not be looked up for each
/// row. A name that `results` has and `runs` lacks is left to `runs`, where it is an error.
bool needs_results_alone(sqlite3* database, const Named& named) {
  const auto runs = columns_of_statement(database, "SELECT * FROM runs LIMIT 0");
  const auto results = columns_of_statement(database, "SELECT * FROM results LIMIT 0");
  const auto names_one_of = [&](const std::vector<std::string>& here,
                                const std::vector<std::string>& there) {
    return std::any_of(here.begin(), here.end(), [&](const std::string& name) {
      return name != "study" && named.has(name) &&
             std::find(there.begin(), there.end(), name) == there.end();
    });
  };
  return !named.all_columns && !named.has("runs") && !names_one_of(runs, results) &&
         !names_one_of(results, runs);
}

/// The view whose rows a question selects from.
const char* view_of(sqlite3* database, const Named& named, bool is_alone) {
  if (!is_alone) {
    return "runs";
  }
  return named.has("mode") || named.has("major_mode") || !has_unjoined_results(database)
             ? "results"
             : kUnjoinedResults;
}

/// The columns of the rows that a question selects from.
std::string columns_of_rows(const protocol::StudyQuery& question, const Named& named,
                            bool is_alone) {
  std::string columns =
      is_alone ? fmt::format("{} AS study, runs.*", sql_text(question.study())) : "runs.*";
  for (const ListColumn& list : lists_of_queries()) {
    if (named.all_columns || named.has(list.name)) {
      columns += fmt::format(", {} AS {}", list.sql, list.name);
    }
  }
  return columns;
}

bool has_points(const protocol::Recipe& recipe, std::int64_t points) {
  try {
    return points > 0 && points_of(recipe) == static_cast<std::uint64_t>(points);
  } catch (const solver::InputError&) {
    return false;  // more than a study may have
  }
}

}  // namespace

AskedStudy asked_study(sqlite3* database, const std::string& name) {
  Statement study(database, "SELECT study_id, points, recipe FROM studies WHERE name = ?1");
  study.bind(1, name);
  if (!study.step()) {
    throw solver::InputError(fmt::format("there is no study called \"{}\"", name));
  }
  AskedStudy found{study.integer(0), {}};
  if (!protocol::parse_recipe(study.bytes(2), found.recipe) ||
      !has_points(found.recipe, study.integer(1))) {
    found.recipe.Clear();
  }
  return found;
}

bool is_in_point_order(const protocol::StudyQuery& question) {
  const auto tokens = sql_tokens(question.order());
  return question.group().empty() &&
         (tokens.empty() ||
          (tokens[0].text == "point" &&
           (tokens.size() == 1 || (tokens.size() == 2 && is_word(tokens[1], "asc")))));
}

std::vector<std::string> columns_of_statement(sqlite3* database, const std::string& sql) {
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
  std::vector<std::string> names;
  for (int i = 0; i < sqlite3_column_count(raw); ++i) {
    const char* name = sqlite3_column_name(raw, i);
    names.emplace_back(name == nullptr ? "" : name);
  }
  return names;
}

std::string statement_of(sqlite3* database, const protocol::StudyQuery& question,
                         const std::string& selected, const AskedStudy& study) {
  const std::string where =
      question.where().empty() ? "" : fmt::format(" WHERE ({})", in_sqlite(question.where()));
  const std::string group = in_sqlite(question.group());
  const std::string order = !question.order().empty() ? in_sqlite(question.order())
                            : group.empty()           ? "point"
                                                      : group;
  const Named named = named_in({selected, where, group, order});
  const bool is_alone = needs_results_alone(database, named);
  const auto ranges = points_asked(question, study);
  // SQLite reads the ranges of a cross join one after another, and the rows of each by their key.
  const bool is_sorted = ranges.size() > 1 && is_in_point_order(question);
  // The study is chosen inside, where no condition can reach another one.
  return fmt::format(
      "SELECT {} FROM (SELECT {} FROM {}{} AS runs WHERE runs.study_id = {} AND {}){}{}{}{}",
      selected, columns_of_rows(question, named, is_alone), join_of(ranges),
      view_of(database, named, is_alone), study.study_id, condition_of(ranges), where,
      group.empty() ? "" : fmt::format(" GROUP BY {}", group),
      is_sorted ? "" : fmt::format(" ORDER BY {}", order),
      question.has_limit()
          ? fmt::format(" LIMIT {}", std::min<std::uint64_t>(question.limit(), INT64_MAX))
          : "");
}

}  // namespace oblique::server
