#include "client/service/result_query.h"

#include <algorithm>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/asking/sql/sql_expression.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/parameters.h"

namespace oblique::client {
namespace {

using server::check_sql_part;
using server::sql_text;
using server::SqlPart;

constexpr const char* kWhere = "--where";
constexpr const char* kSelect = "--select";
constexpr const char* kGroup = "--group";
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
  if (!query.group.empty()) {
    check_sql_part(kGroup, query.group, SqlPart::kGroup);
  }
  if (!query.order.empty()) {
    check_sql_part(kOrder, query.order, SqlPart::kOrder);
  }
}

protocol::QueryRequest request_for(const ResultQuery& query) {
  protocol::QueryRequest request;
  auto& question = *request.mutable_question();
  question.set_study(query.study);
  // With a group, what was left as it is means its columns and how many points each has.
  const ResultQuery untold;
  if (query.group.empty() || query.select != untold.select) {
    question.add_select(query.select);
  }
  question.set_where(query.where);
  question.set_group(query.group);
  if (query.group.empty() || query.order != untold.order) {
    question.set_order(query.order);
  }
  question.set_explain(query.explain);
  if (query.limit) {
    question.set_limit(static_cast<std::uint64_t>(*query.limit));
  }
  return request;
}

}  // namespace oblique::client
