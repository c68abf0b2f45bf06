#include "client/service/source.h"

#include <chrono>
#include <future>
#include <stdexcept>
#include <thread>
#include <utility>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "server/database/database_file.h"
#include "server/query/reader.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

/// Returns the result of `work`, which must own its data and runs on a thread of its own: SQLite
/// checks a time limit between the steps of a statement, but one function may take hours. A second
/// after the limit the thread is left behind. Turns a StatementError into InputError, because the
/// user wrote the statement.
template <class Work>
auto within(std::int64_t limit_ms, Work work) {
  std::packaged_task<decltype(work())()> task(std::move(work));
  auto result = task.get_future();
  std::thread thread(std::move(task));
  if (const std::chrono::milliseconds longest(limit_ms + 1000);
      limit_ms > 0 && result.wait_for(longest) != std::future_status::ready) {
    thread.detach();
    throw server::QueryError(server::took_too_long(limit_ms));
  }
  thread.join();
  try {
    return result.get();
  } catch (const server::StatementError& error) {
    throw solver::InputError(error.what());
  }
}

class DatabaseRows : public RowStream {
 public:
  DatabaseRows(std::shared_ptr<server::Reader> reader, std::shared_ptr<server::Answer> answer,
               std::int64_t limit_ms)
      : reader_(std::move(reader)), answer_(std::move(answer)), limit_ms_(limit_ms) {}
  protocol::QueryReply next() override {
    return within(limit_ms_, [reader = reader_, answer = answer_] { return answer->next(); });
  }

 private:
  std::shared_ptr<server::Reader> reader_;  // declared first, because the answer uses it
  std::shared_ptr<server::Answer> answer_;
  std::int64_t limit_ms_;
};

class Database : public Source {
 public:
  Database(std::string file, std::int64_t timeout_ms)
      : file_(std::move(file)), reader_(std::make_shared<server::Reader>(file_)) {
    constexpr std::int64_t kHeapBytes = std::int64_t{1} << 30U;
    limits_.time_limit_ms = timeout_ms;
    // The memory limit holds for the whole process. Nothing else in the process uses SQLite.
    sqlite3_hard_heap_limit64(kHeapBytes);
  }

  std::unique_ptr<RowStream> rows(protocol::QueryRequest request) override {
    auto answer = within(limits_.time_limit_ms, [reader = reader_, request, limits = limits_] {
      return std::make_shared<server::Answer>(reader->answer(request, limits));
    });
    return std::make_unique<DatabaseRows>(reader_, std::move(answer), limits_.time_limit_ms);
  }
  std::vector<protocol::StudyStatus> status(const std::string& study, const Tell&) override {
    try {
      auto found = reader_->study_status(study);
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
  std::shared_ptr<server::Reader> reader_;
  server::QueryLimits limits_ = server::kNoLimits;
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
