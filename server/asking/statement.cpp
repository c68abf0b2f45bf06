#include "server/asking/statement.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/checks.h"
#include "server/asking/columns.h"
#include "server/asking/conditions.h"
#include "server/asking/elements.h"
#include "server/asking/grouping.h"
#include "server/asking/lists/quick_views.h"
#include "server/asking/question.h"
#include "server/asking/sql/sql_expression.h"
#include "server/asking/sql/sql_items.h"
#include "server/database/sqlite.h"
#include "server/store/schema/schema_setup.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

/// Finding the first row of a span costs about so many rows that follow each other.
constexpr std::uint64_t kRowsASpan = 3;

/// The columns that rows are to be sorted by; none where it is by something else.
std::optional<std::vector<SortKey>> sort_keys(const protocol::StudyQuery& question) {
  std::vector<SortKey> keys;
  const auto tokens = sql_tokens(question.order());
  if (tokens.empty()) {
    return keys;
  }
  for (const SqlItem& item : sql_items(tokens)) {
    const bool falls = same_but_case(item.name, "desc");
    const bool is_column = item.tokens.size() == 1 &&
                           item.tokens[0].kind == SqlToken::Kind::kName &&
                           (item.name.empty() || falls || same_but_case(item.name, "asc"));
    if (!is_column) {
      return std::nullopt;
    }
    keys.push_back({std::string(item.tokens[0].text), falls});
  }
  return keys;
}

bool is_by_point(const std::vector<SortKey>& keys, bool falls) {
  return keys.size() == 1 && keys[0].column == "point" && keys[0].falls == falls;
}

/// Spans in the order of axes, where rows are to be sorted so and spans can be; else none.
std::vector<PointSpan> sorted_spans(const protocol::StudyQuery& question, const AskedStudy& study,
                                    const Boxes& boxes) {
  auto keys = sort_keys(question);
  if (!keys || keys->empty() || !question.group().empty() || !gives_points(selected_by(question))) {
    return {};
  }
  // Rows of one value of each axis come by their number anyway.
  if (keys->back().column == "point" && !keys->back().falls) {
    keys->pop_back();
  }
  const auto names = names_given_in(selected_by(question));
  const auto is_no_axis = [&](const SortKey& key) {
    return key.column == "point" ||
           std::find(names.begin(), names.end(), key.column) != names.end();
  };
  if (keys->empty() || std::any_of(keys->begin(), keys->end(), is_no_axis)) {
    return {};
  }
  return sorted_spans_of(study.recipe, boxes, *keys).value_or(std::vector<PointSpan>());
}

std::string join_of(const std::vector<PointSpan>& spans) {
  // A list of JSON is read faster than VALUES is compiled.
  std::string list;
  for (const PointSpan& span : spans) {
    list += fmt::format("{}\"{}\":{}", list.empty() ? "" : ",", span.first, span.last);
  }
  return fmt::format("json_each('{{{}}}') AS span CROSS JOIN ", list);
}

/// Which points of the study, as conditions behind the study's own.
std::string points_in_sql(const protocol::StudyQuery& question, const RowsAsked& rows) {
  if (!rows.by_spans) {
    return question.has_after_point()
               ? fmt::format(" AND runs.point > {}",
                             std::min<std::uint64_t>(question.after_point(), INT64_MAX))
               : "";
  }
  if (rows.spans.empty()) {
    return " AND 0";
  }
  if (rows.spans.size() == 1) {
    return fmt::format(" AND runs.point BETWEEN {} AND {}", rows.spans[0].first,
                       rows.spans[0].last);
  }
  return " AND runs.point BETWEEN CAST(span.key AS INTEGER) AND span.value";
}

/// What a question names, of whatever kind.
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

/// Whether the results alone have every column that is named, and none that the view `runs` has
/// not: then models and workers need not be looked up for each row.
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

/// Whether a recipe is that of so many points.
bool tells_points(const protocol::Recipe& recipe, std::uint64_t points) {
  try {
    return points > 0 && points_left_in(recipe) == points;
  } catch (const solver::InputError&) {
    return false;  // more than any study may have
  }
}

}  // namespace

AskedStudy asked_study(sqlite3* database, const std::string& name) {
  Statement study(database, "SELECT study_id, points, recipe FROM studies WHERE name = ?1");
  study.bind(1, name);
  if (!study.step()) {
    throw solver::InputError(fmt::format("there is no study called \"{}\"", name));
  }
  AskedStudy found{study.integer(0), static_cast<std::uint64_t>(study.integer(1)), {}};
  // Points of a recipe that does not tell where they are are all looked at.
  if (!protocol::parse_recipe(study.bytes(2), found.recipe) ||
      !tells_points(found.recipe, found.points)) {
    found.recipe.Clear();
  }
  return found;
}

bool is_in_point_order(const protocol::StudyQuery& question) {
  const auto keys = sort_keys(question);
  return question.group().empty() && keys && (keys->empty() || is_by_point(*keys, false));
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

RowsAsked rows_asked(const protocol::StudyQuery& question, const AskedStudy& study) {
  RowsAsked rows;
  Boxes boxes = boxes_of(question.where());
  if (question.has_after_point()) {
    for (Box& box : boxes) {
      const ValueSet behind({static_cast<double>(question.after_point()) + 1, 1e18});
      box.try_emplace("point", ValueSet::all()).first->second.intersect(behind);
    }
  }
  constexpr std::size_t kMostBlocksAndBoxes = 200'000;
  const auto blocks = static_cast<std::size_t>(study.recipe.blocks_size());
  if (blocks == 0 || blocks * boxes.size() > kMostBlocksAndBoxes) {
    return rows;  // nothing to look through, or too long
  }
  rows.spans = sorted_spans(question, study, boxes);
  if (rows.spans.size() > 1) {
    rows.by_spans = true;
    rows.come_in_order = true;
    return rows;
  }
  rows.spans.clear();
  const auto is_free = [](const Box& box) { return box.empty(); };
  if (std::any_of(boxes.begin(), boxes.end(), is_free)) {
    return rows;
  }
  auto spans = spans_of(study.recipe, boxes);
  const std::uint64_t points = points_in(spans);
  const std::uint64_t all = points_of(study.recipe);
  const bool is_few = points + kRowsASpan * spans.size() <= all - all / 10;
  const auto keys = sort_keys(question);
  const bool is_backwards = question.group().empty() && keys && is_by_point(*keys, true);
  if (spans.size() > 1 && (!is_few || (is_backwards && points > all / 8))) {
    spans = {{spans.front().first, spans.back().last}};
  }
  rows.by_spans = true;
  rows.spans = std::move(spans);
  rows.come_in_order = is_in_point_order(question) && rows.spans.size() > 1;
  return rows;
}

std::string statement_of(sqlite3* database, const protocol::StudyQuery& question,
                         const std::string& selected, const AskedStudy& study,
                         const RowsAsked& rows) {
  const std::string where = question.where().empty()
                                ? ""
                                : fmt::format(" WHERE ({})", in_sqlite(database, question.where()));
  const std::string group = in_sqlite(database, question.group());
  std::string order = in_sqlite(database, question.order());
  if (order.empty()) {
    order = group.empty() ? "point" : group;
  }
  const Named named = named_in({selected, where, group, order});
  const bool is_alone = needs_results_alone(database, named);
  // The study is chosen inside, where no condition can widen it.
  return fmt::format(
      "SELECT {} FROM (SELECT {} FROM {}{} AS runs WHERE runs.study_id = {}{}){}{}{}{}", selected,
      columns_of_rows(question, named, is_alone), rows.spans.size() > 1 ? join_of(rows.spans) : "",
      view_of(database, named, is_alone), study.study_id, points_in_sql(question, rows), where,
      group.empty() ? "" : fmt::format(" GROUP BY {}", group),
      // Spans are read one after another, and rows in them by their key.
      rows.come_in_order ? "" : fmt::format(" ORDER BY {}", order),
      question.has_limit()
          ? fmt::format(" LIMIT {}", std::min<std::uint64_t>(question.limit(), INT64_MAX))
          : "");
}

}  // namespace oblique::server
