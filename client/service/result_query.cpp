#include "client/service/result_query.h"

#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
void check(const ResultQuery& query) {
  if (query.limit && *query.limit < 0) {
    throw solver::InputError(
        fmt::format("--limit {} is not allowed: it must be >= 0", *query.limit));
  }
  for (const auto& [flag, text] :
       {std::pair("--select", query.select), std::pair("--where", query.where),
        std::pair("--group", query.group), std::pair("--order", query.order)}) {
    if (!text.empty()) {
      server::check_sql_part(flag, text);
    }
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
