#include "client/service/source.h"

#include <utility>

#include <spdlog/fmt/fmt.h>

#include "client/service/database_rows.h"
#include "proto/wire/chunk.h"
#include "server/database/database_file.h"
#include "server/query/reader.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

class DatabaseSource : public Source {
 public:
  DatabaseSource(std::string file, std::int64_t timeout_ms)
      : file_(std::move(file)), reader_(file_) {
    limits_.time_limit_ms = timeout_ms;
    // One for the whole process, which has nothing else in SQLite.
    sqlite3_hard_heap_limit64(kHeapBytes);
  }

  std::unique_ptr<RowStream> rows(protocol::QueryRequest request) override {
    return std::make_unique<DatabaseRows>(reader_, request, limits_);
  }
  std::vector<protocol::StudyStatus> status(const std::string& study, const Tell&) override {
    try {
      auto found = reader_.study_status(study);
      if (!server::is_in_use(file_)) {
        say_that_nobody_works(found);
      }
      return found;
    } catch (const server::QueryError& error) {
      throw server::QueryError(fmt::format("{} in {}", error.what(), file_));
    }
  }
  std::vector<protocol::StudyStatus> status_of(const std::string& study, std::uint64_t study_id,
                                               const Tell& tell) override {
    const auto name = reader_.query(
        fmt::format("SELECT name FROM studies WHERE study_id = {}", study_id), limits_);
    return status(name.rows.size() == 1 ? std::get<std::string>(name.rows[0][0]) : study, tell);
  }
  std::string place() const override { return file_; }

 private:
  void say_that_nobody_works(std::vector<protocol::StudyStatus>& studies) const {
    for (auto& study : studies) {
      if (study.state() == "running") {
        study.set_waits_for(fmt::format("a server: nobody is at work on {}", file_));
      }
    }
  }

  static constexpr std::int64_t kHeapBytes = std::int64_t{1} << 30U;

  std::string file_;
  server::Reader reader_;
  // Nobody else is kept waiting.
  server::QueryLimits limits_{UINT64_MAX, 0, std::int64_t{64} << 20U};
};

class ServerRows : public RowStream {
 public:
  ServerRows(Connection& connection, protocol::QueryRequest request) : connection_(connection) {
    connection_.ask_for_rows(std::move(request));
  }
  ~ServerRows() override { connection_.end_rows(); }
  ServerRows(const ServerRows&) = delete;
  ServerRows& operator=(const ServerRows&) = delete;

  protocol::QueryReply next() override { return connection_.next_rows(); }

 private:
  Connection& connection_;
};

class ServerSource : public Source {
 public:
  ServerSource(ConnectionSettings settings, Connection::KeepWaiting keep_waiting)
      : connection_(std::move(settings), std::move(keep_waiting)) {}

  std::unique_ptr<RowStream> rows(protocol::QueryRequest request) override {
    return std::make_unique<ServerRows>(connection_, std::move(request));
  }
  std::vector<protocol::StudyStatus> status(const std::string& study, const Tell& tell) override {
    const auto reply = connection_.status(study, tell);
    access_ = reply.access();
    return {reply.studies().begin(), reply.studies().end()};
  }
  std::vector<protocol::StudyStatus> status_of(const std::string& study, std::uint64_t study_id,
                                               const Tell& tell) override {
    const auto reply = connection_.status_of(study, study_id, tell);
    return {reply.studies().begin(), reply.studies().end()};
  }
  std::string access() const override { return access_; }
  std::string place() const override { return connection_.url(); }

 private:
  Connection connection_;
  std::string access_;
};

}  // namespace

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

std::unique_ptr<Source> open_server(ConnectionSettings settings,
                                    Connection::KeepWaiting keep_waiting) {
  return std::make_unique<ServerSource>(std::move(settings), std::move(keep_waiting));
}

std::unique_ptr<Source> open_database(const std::string& file, std::int64_t timeout_ms) {
  return std::make_unique<DatabaseSource>(file, timeout_ms);
}

}  // namespace oblique::client
