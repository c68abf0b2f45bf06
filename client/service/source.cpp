#include "client/service/source.h"

#include <stdexcept>
#include <utility>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "server/database/database_file.h"
#include "server/query/reader.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

/// Returns the result of `call`. Turns a StatementError into InputError, because the user wrote the
/// statement.
template <class Call>
auto answered(const Call& call) {
  try {
    return call();
  } catch (const server::StatementError& error) {
    throw solver::InputError(error.what());
  }
}

class DatabaseRows : public RowStream {
 public:
  explicit DatabaseRows(server::Answer answer) : answer_(std::move(answer)) {}
  protocol::QueryReply next() override {
    return answered([this] { return answer_.next(); });
  }

 private:
  server::Answer answer_;
};

class Database : public Source {
 public:
  Database(std::string file, std::int64_t timeout_ms) : file_(std::move(file)), reader_(file_) {
    constexpr std::int64_t kHeapBytes = std::int64_t{1} << 30U;
    limits_.time_limit_ms = timeout_ms;
    // The memory limit holds for the whole process. Nothing else in the process uses SQLite.
    sqlite3_hard_heap_limit64(kHeapBytes);
  }

  std::unique_ptr<RowStream> rows(protocol::QueryRequest request) override {
    return answered(
        [&] { return std::make_unique<DatabaseRows>(reader_.answer(request, limits_)); });
  }
  std::vector<protocol::StudyStatus> status(const std::string& study, const Tell&) override {
    try {
      auto found = reader_.study_status(study);
      const bool has_server = server::is_in_use(file_);
      for (auto& each : found) {
        if (!has_server && each.state() == "running") {
          each.set_waits_for(fmt::format("a server; none uses {} now", file_));
        }
      }
      return found;
    } catch (const server::QueryError& error) {
      throw server::QueryError(fmt::format("{} in {}", error.what(), file_));
    }
  }
  std::string place() const override { return file_; }

 private:
  std::string file_;
  server::Reader reader_;
  server::QueryLimits limits_{UINT64_MAX, 0, std::int64_t{64} << 20U};
};

}  // namespace

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

protocol::StudyStatus Source::status_of(std::uint64_t study_id, const std::string& name,
                                        const Tell& tell) {
  for (auto& study : status({}, tell)) {
    if (study.study_id() == study_id) {
      return std::move(study);
    }
  }
  throw std::runtime_error(fmt::format("the study \"{}\" is no longer in {}", name, place()));
}

protocol::Table Source::query(const std::string& sql) {
  protocol::QueryRequest request;
  request.set_sql(sql);
  const auto stream = rows(std::move(request));
  protocol::Table whole;
  for (bool ends = false; !ends;) {
    const protocol::QueryReply chunk = stream->next();
    protocol::append_rows(chunk, whole);
    ends = chunk.ends();
  }
  return whole;
}

std::unique_ptr<Source> open_database(const std::string& file, std::int64_t timeout_ms) {
  return std::make_unique<Database>(file, timeout_ms);
}

}  // namespace oblique::client
