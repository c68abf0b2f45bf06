#include "client/service/result_query.h"

#include <spdlog/fmt/fmt.h>

#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

using server::check_sql_part;
using server::SqlPart;

constexpr const char* kWhere = "--where";
constexpr const char* kSelect = "--select";
constexpr const char* kGroup = "--group";
constexpr const char* kOrder = "--order";

}  // namespace

void check(const ResultQuery& query) {
  if (query.limit && *query.limit < 0) {
    throw solver::InputError(
        fmt::format("--limit {} is not allowed: it must be >= 0", *query.limit));
  }
  if (!query.select.empty()) {
    check_sql_part(kSelect, query.select, SqlPart::kColumns);
  }
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
  if (!query.select.empty()) {
    question.add_select(query.select);
  }
  question.set_where(query.where);
  question.set_group(query.group);
  question.set_order(query.order);
  if (query.limit) {
    question.set_limit(static_cast<std::uint64_t>(*query.limit));
  }
  return request;
}

protocol::QueryRequest first_results(const std::string& study, std::int64_t rows) {
  ResultQuery query;
  query.study = study;
  query.limit = rows;
  return request_for(query);
}

}  // namespace oblique::client
