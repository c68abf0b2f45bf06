#include "client/service/result_query.h"

#include <algorithm>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/asking/columns.h"
#include "server/asking/sql/sql_expression.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

using server::check_case_of_columns;
using server::check_sql_part;
using server::rows_of_queries;
using server::sql_text;
using server::SqlPart;

constexpr const char* kWhere = "--where";
constexpr const char* kSelect = "--select";
constexpr const char* kOrder = "--order";

}  // namespace

std::string statement_of_first_results(const Study& study, std::int64_t rows) {
  std::string columns = "point";
  for (const auto& key : solver::model_keys()) {
    const auto varies = [&key](const protocol::Block& block) {
      return std::any_of(block.axes().begin(), block.axes().end(),
                         [&key](const protocol::Axis& axis) { return axis.key() == key.name; });
    };
    const auto& blocks = study.recipe.blocks();
    if (std::any_of(blocks.begin(), blocks.end(), varies)) {
      // SQL does not tell E from e, so the view calls Young's modulus otherwise.
      columns += fmt::format(", {}", key.name == "E" ? "E_Pa" : key.name);
    }
  }
  return fmt::format(
      "SELECT {}, H, mu, e, status, fn_peak_N, ft_peak_N, duration_s, slide_m, stick_total_s, "
      "major_mode FROM runs WHERE study = {} ORDER BY point LIMIT {}",
      columns, sql_text(study.name), rows);
}

void check(const ResultQuery& query) {
  if (query.limit && *query.limit < 0) {
    throw solver::InputError(
        fmt::format("--limit {} is not allowed: it must be >= 0", *query.limit));
  }
  check_sql_part(kSelect, query.select, SqlPart::kColumns);
  if (!query.where.empty()) {
    check_sql_part(kWhere, query.where, SqlPart::kCondition);
  }
  if (!query.order.empty()) {
    check_sql_part(kOrder, query.order, SqlPart::kOrder);
  }
}

void check_columns(const ResultQuery& query, Source& source) {
  const auto runs = source.query(fmt::format("SELECT * FROM {} LIMIT 0", rows_of_queries()));
  const std::vector<std::string> columns(runs.columns().begin(), runs.columns().end());
  const auto names_given = server::names_given_in(query.select);
  check_case_of_columns(kSelect, query.select, columns, names_given);
  check_case_of_columns(kWhere, query.where, columns, names_given);
  check_case_of_columns(kOrder, query.order, columns, names_given);
}

std::string statement_of(const ResultQuery& query, std::int64_t skipped) {
  // The study is chosen inside, where no --where can widen it.
  const std::string where = query.where.empty() ? "" : fmt::format(" WHERE ({})", query.where);
  const std::string order = query.order.empty() ? "" : fmt::format(" ORDER BY {}", query.order);
  // SQL wants a limit before an offset; -1 is none.
  const std::int64_t limit = query.limit ? *query.limit - skipped : -1;
  return fmt::format("SELECT {} FROM (SELECT * FROM {} WHERE study = {}){}{} LIMIT {} OFFSET {}",
                     query.select, rows_of_queries(), sql_text(query.study), where, order, limit,
                     skipped);
}

protocol::QueryReply all_rows(Source& source, const ResultQuery& query, bool at_rest) {
  auto rows = source.query(statement_of(query, 0));
  while (rows.truncated() && at_rest) {
    const auto more = source.query(statement_of(query, rows.rows_size()));
    if (more.rows().empty()) {
      break;
    }
    rows.mutable_rows()->MergeFrom(more.rows());
    rows.set_truncated(more.truncated());
  }
  return rows;
}

}  // namespace oblique::client
