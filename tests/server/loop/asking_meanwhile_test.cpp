// Questions about a study that is being written: each answer is of one moment.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "proto/wire/chunk.h"
#include "server/loop/loop.h"
#include "tests/server/loop/running_server.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

constexpr std::uint64_t kPoints = 4000;

/// Solves a study batch by batch on a thread of its own, and goes on with the next when another
/// answer was read, so that answers lie between them and overlap their writing.
class PacedWorker {
 public:
  explicit PacedWorker(const std::string& endpoint)
      : worker_(endpoint), thread_([this] {
          try {
            work();
          } catch (const std::exception& error) {
            ADD_FAILURE() << error.what();
          }
          done_ = true;
        }) {}
  ~PacedWorker() {
    answers_ = kPoints;
    thread_.join();
  }
  PacedWorker(const PacedWorker&) = delete;
  PacedWorker& operator=(const PacedWorker&) = delete;

  void answer_was_read() { ++answers_; }
  bool is_done() const { return done_; }
  /// The points of each batch that was sent, stored or not; they follow each other.
  std::vector<std::vector<std::uint64_t>> batches() const {
    const std::lock_guard lock(mutex_);
    return batches_;
  }

 private:
  void work() {
    worker_.hello();
    std::uint64_t stored = 0;
    for (std::uint64_t number = 1; stored < kPoints; ++number) {
      worker_.credit(1);
      protocol::Batch batch;
      for (bool is_stored = false; !is_stored;) {
        const auto message = worker_.receive();
        if (message.has_batch()) {
          batch = message.batch();
          const std::lock_guard lock(mutex_);
          batches_.push_back(points_of(batch));
          worker_.solve(batch);
        }
        is_stored = message.has_results_stored();
      }
      stored += points_of(batch).size();
      while (answers_ < number) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
  }

  PretendedWorker worker_;
  mutable std::mutex mutex_;
  std::vector<std::vector<std::uint64_t>> batches_;
  std::atomic<std::uint64_t> answers_{0};
  std::atomic<bool> done_{false};
  std::thread thread_;
};

class AskingMeanwhile : public testing::Test {
 protected:
  /// Rows of whole numbers that a question gives, all its chunks.
  std::vector<std::vector<std::int64_t>> rows(const std::string& select, const std::string& order,
                                              const std::string& group = {},
                                              const std::string& where = {}) {
    ClientRequest request;
    request.set_protocol_version(protocol::kProtocolVersion);
    request.set_request_id(++id_);
    auto& query = *request.mutable_query();
    query.set_time_limit_ms(kLongestTimeLimit_ms);
    auto& question = *query.mutable_question();
    question.set_study("a");
    question.add_select(select);
    question.set_order(order);
    question.set_group(group);
    question.set_where(where);
    client_->send(request);
    std::vector<std::vector<std::int64_t>> rows;
    while (true) {
      const auto reply = client_->receive();
      // A wish for more of an answer whose last chunk was already on its way finds nothing.
      if (reply.request_id() != id_ || reply.has_still_working()) {
        continue;
      }
      EXPECT_TRUE(reply.has_query()) << reply.error().message();
      if (!reply.has_query() || take(reply.query(), rows)) {
        return rows;
      }
      ClientRequest more;
      more.set_protocol_version(protocol::kProtocolVersion);
      more.set_request_id(id_);
      more.mutable_more_rows()->set_request_id(id_);
      more.mutable_more_rows()->set_taken(reply.query().chunk());
      client_->send(more);
    }
  }
  /// Whether the chunk was the last.
  static bool take(const protocol::QueryReply& chunk,
                   std::vector<std::vector<std::int64_t>>& rows) {
    protocol::ChunkRows unpacked(chunk);
    while (unpacked.next()) {
      rows.emplace_back();
      for (std::size_t i = 0; i < unpacked.columns(); ++i) {
        rows.back().push_back(unpacked.cell(i).integer);
      }
    }
    return chunk.ends();
  }
  /// Points of an answer, rising.
  static std::vector<std::uint64_t> points_of(const std::vector<std::vector<std::int64_t>>& rows) {
    std::vector<std::uint64_t> points;
    for (const auto& row : rows) {
      points.push_back(static_cast<std::uint64_t>(row.at(0)));
    }
    std::sort(points.begin(), points.end());
    return points;
  }

  test::TemporaryFolder folder_;
  std::optional<RunningServer> server_{std::in_place, folder_.file("studies.db")};
  std::optional<PretendedClient> client_{std::in_place, server_->client_endpoint()};
  std::uint64_t id_ = 1000;
};

TEST_F(AskingMeanwhile, EachAnswerIsOfOneMomentAndNoneIsBehindTheLast) {
  client_->submit("a", kPoints);
  PacedWorker worker(server_->worker_endpoint());
  std::size_t seen = 0;
  std::size_t answers_in_between = 0;
  const auto goes_on = [&](std::size_t points, const char* what) {
    EXPECT_GE(points, seen) << what << ": points that were there are gone";
    seen = points;
    answers_in_between += points > 0 && points < kPoints ? 1 : 0;
    worker.answer_was_read();
  };
  while (!worker.is_done() && !HasFailure()) {
    // Sorted before the first row is given, so of one transaction.
    const auto points = points_of(rows("point", "point DESC"));
    ASSERT_TRUE(std::adjacent_find(points.begin(), points.end()) == points.end());
    for (const auto& batch : worker.batches()) {
      const auto from = std::lower_bound(points.begin(), points.end(), batch.front());
      const auto to = std::upper_bound(points.begin(), points.end(), batch.back());
      const auto here = static_cast<std::size_t>(to - from);
      ASSERT_TRUE(here == 0 || here == batch.size())
          << here << " of the " << batch.size() << " from " << batch.front();
    }
    goes_on(points.size(), "a list");
    const auto sums = rows("count(*), count(DISTINCT point), count(status), max(point)", "");
    ASSERT_EQ(sums.size(), 1U);
    EXPECT_EQ(sums[0][0], sums[0][1]);
    EXPECT_EQ(sums[0][0], sums[0][2]);
    goes_on(static_cast<std::size_t>(sums[0][0]), "an aggregate");
    std::int64_t gathered = 0;
    for (const auto& group : rows("point % 7, count(*)", "", "point % 7")) {
      gathered += group[1];
    }
    goes_on(static_cast<std::size_t>(gathered), "groups");
    // All columns, in the order of points: what a whole CSV is made of.
    const auto all = rows("point, *", "point");
    ASSERT_TRUE(std::is_sorted(all.begin(), all.end(),
                               [](const auto& a, const auto& b) { return a[0] < b[0]; }));
    goes_on(all.size(), "all columns");
    const auto slice = rows("point", "point", "", "point BETWEEN 10 AND 19");
    EXPECT_LE(slice.size(), 10U);
  }
  EXPECT_GT(answers_in_between, 3U) << "nothing was asked while the study was written";
  const auto points = points_of(rows("point", "point"));
  EXPECT_EQ(points.size(), kPoints);
  EXPECT_EQ(std::set<std::uint64_t>(points.begin(), points.end()).size(), kPoints);
  EXPECT_EQ(PretendedClient(server_->client_endpoint()).status("a").state(), "done");
}

}  // namespace
}  // namespace oblique::server
