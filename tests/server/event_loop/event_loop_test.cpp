// The whole server in this process, over real sockets of the loopback device, with a pretended
// worker and client.
#include "server/event_loop/event_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/query/reader.h"
#include "tests/server/event_loop/running_server.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

using testing::HasSubstr;

class EventLoopTest : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
};

TEST_F(EventLoopTest, AStudyIsSolvedStoredAndQueried) {
  RunningServer server(path_);
  PretendedClient client(server.client_endpoint());
  EXPECT_EQ(client.submit("a", 30).submit().points(), 30U);
  PretendedWorker worker(server.worker_endpoint());
  ASSERT_TRUE(worker.hello().has_welcome());
  worker.work(30);
  EXPECT_EQ(client.status("a").state(), "done");
  EXPECT_EQ(client.rows("SELECT count(*), count(DISTINCT point) FROM results").rows.at(0),
            (protocol::Row{std::int64_t{30}, std::int64_t{30}}));
  ClientRequest workers;
  workers.mutable_workers();
  const auto known = client.ask(workers).workers();
  ASSERT_EQ(known.workers_size(), 1);
  EXPECT_EQ(known.workers(0).solved_points(), 30U);
}

TEST_F(EventLoopTest, ARestartedServerGoesOnWhereItWas) {
  {
    RunningServer server(path_);
    PretendedClient client(server.client_endpoint());
    client.submit("a", 30);
    PretendedWorker worker(server.worker_endpoint());
    worker.hello();
    worker.work(5);
  }
  RunningServer server(path_);
  PretendedClient client(server.client_endpoint());
  const auto status = client.status("a");
  EXPECT_GE(status.solved(), 5U);
  EXPECT_EQ(status.state(), "running");
  PretendedWorker worker(server.worker_endpoint());
  EXPECT_EQ(worker.hello().welcome().worker_id(), 2U);
  worker.work(30 - status.solved());
  EXPECT_EQ(client.status("a").state(), "done");
}

TEST_F(EventLoopTest, AStoppingServerTellsItsWorkersAndCommitsWhatItReceived) {
  auto server = std::make_unique<RunningServer>(path_);
  PretendedClient client(server->client_endpoint());
  client.submit("a", 1000);
  PretendedWorker worker(server->worker_endpoint());
  worker.hello();
  worker.credit(1);
  worker.receive();  // the definition
  const auto batch = worker.receive().batch();
  worker.solve(batch);
  WorkerMessage heartbeat;
  heartbeat.mutable_heartbeat();
  worker.send(heartbeat);
  bool received = false;
  bool stored = false;
  while (!received) {  // its answer tells that the results before it have arrived
    const auto message = worker.receive();
    received = message.has_heartbeat_reply();
    stored = stored || message.has_results_stored();
  }
  EXPECT_EQ(server->stop().lost_writes, 0U);
  bool stopping = false;
  while (!stopping || !stored) {
    const auto message = worker.receive();
    stopping = stopping || message.has_stopping();
    stored = stored || message.has_results_stored();
  }
  server.reset();
  EXPECT_EQ(Reader(path_).study_status("a").at(0).solved(), points_of(batch).size());
}

TEST_F(EventLoopTest, HostileFramesHarmNobody) {
  RunningServer server(path_);
  PretendedClient client(server.client_endpoint());
  PretendedWorker worker(server.worker_endpoint());
  worker.hello();
  PretendedWorker hostile_worker(server.worker_endpoint());
  PretendedClient hostile_client(server.client_endpoint());
  for (const std::string& frame :
       {std::string(), std::string(1000, '\xff'), std::string("GET /")}) {
    hostile_worker.send_frame(frame);
    hostile_client.send_frame(frame);
    EXPECT_TRUE(hostile_client.receive().has_error());
  }
  hostile_worker.send_frames({"", "a", "b", "c"});
  hostile_client.send_frames({"", "a", "b", "c"});
  EXPECT_TRUE(hostile_client.is_cut_off());
  EXPECT_TRUE(client.submit("a", 10).has_submit());
  worker.work(10);
  EXPECT_EQ(client.status("a").state(), "done");
}

TEST_F(EventLoopTest, AFrameOverTheLimitCostsItsSenderTheConnectionAndNobodyElse) {
  RunningServer server(path_);
  PretendedClient hostile(server.client_endpoint());
  PretendedClient client(server.client_endpoint());
  EXPECT_TRUE(client.submit("a", 10).has_submit());
  hostile.send_frame(std::string(protocol::kMaxFrameBytes + 1, 'x'));
  EXPECT_TRUE(hostile.is_cut_off());
  EXPECT_EQ(client.status("a").points(), 10U) << "on the connection that it had";
}

TEST_F(EventLoopTest, ALongRecipeIsStoredAndHandedOutWhileOthersAreAnswered) {
  RunningServer server(path_);
  PretendedClient client(server.client_endpoint());
  client.submit("small", 10);
  ClientRequest large;
  large.set_protocol_version(protocol::kProtocolVersion);
  large.mutable_submit()->set_name("large");
  large.mutable_submit()->set_priority(1);
  *large.mutable_submit()->mutable_recipe() = protocol::recipe_of({});
  constexpr int kBlocks = 10'000;
  for (int i = 0; i < kBlocks; ++i) {
    auto& block = *large.mutable_submit()->mutable_recipe()->add_blocks();
    *block.add_axes() = protocol::range("H", 0.1 + 1e-6 * i, 1.0, 1024);
    *block.add_axes() = protocol::range("mu", 0.1, 1.0, 1024);
    *block.add_axes() = protocol::listed("e", {1.0});
  }
  PretendedClient other(server.client_endpoint());
  other.send(large);
  EXPECT_EQ(client.status("small").points(), 10U);
  EXPECT_EQ(other.receive().submit().points(), 1024ULL * 1024 * kBlocks);
  PretendedWorker worker(server.worker_endpoint());
  worker.hello();
  worker.credit(1);
  EXPECT_EQ(worker.receive().study().recipe().blocks_size(), kBlocks);
  EXPECT_TRUE(worker.receive().has_batch());
}

/// Compares for hours without a look at the clock.
constexpr const char* kDeaf = "SELECT instr(zeroblob(16000000), zeroblob(7999999) || x'01')";

TEST_F(EventLoopTest, ALongQueryHoldsUpNothingElse) {
  RunningServer server(path_);
  PretendedClient client(server.client_endpoint());
  PretendedClient other(server.client_endpoint());
  other.start_query(kDeaf);
  EXPECT_TRUE(client.submit("a", 10).has_submit());
  EXPECT_EQ(client.status("a").points(), 10U);
  EXPECT_EQ(client.rows("SELECT 3").rows.at(0), protocol::Row{std::int64_t{3}});
}

TEST_F(EventLoopTest, TheQueriesOfAClientEndWithItsConnection) {
  QueueSettings queue;
  queue.readers = 2;
  ClientHandlerSettings clients;
  clients.still_working_every_ms = 1'000'000;  // no failed reply shows that the client is gone
  RunningServer server(path_, queue, {}, clients);
  for (int i = 0; i < 2; ++i) {
    PretendedClient client(server.client_endpoint());
    ClientRequest request;
    request.set_protocol_version(protocol::kProtocolVersion);
    request.mutable_query()->set_sql(kDeaf);
    request.mutable_query()->set_time_limit_ms(kLongestTimeLimit_ms);
    client.send(request);
    EXPECT_TRUE(client.submit("a", 10).has_submit());  // so that the query has arrived
  }
  PretendedClient client(server.client_endpoint());
  EXPECT_EQ(client.rows("SELECT 3").rows.at(0), protocol::Row{std::int64_t{3}});
}

TEST_F(EventLoopTest, TheServerStopsWhateverQueriesDo) {
  RunningServer server(path_);
  PretendedClient client(server.client_endpoint());
  client.start_query(kDeaf);
  EXPECT_EQ(server.stop().lost_writes, 0U);
  while (!client.receive().has_error()) {
  }
}

TEST_F(EventLoopTest, TheSecondServerOfADatabaseIsRefused) {
  RunningServer server(path_);
  EXPECT_THROW(RunningServer{path_}, StorageError);
}

TEST_F(EventLoopTest, ClientsAndWorkersGetToKnowWhoIsLetIn) {
  for (const bool is_insecure : {false, true}) {
    RunningServer server(path_, {}, {}, {}, {.insecure = is_insecure});
    PretendedClient client(server.client_endpoint());
    ClientRequest status;
    status.mutable_status();
    const std::string access = is_insecure ? "insecure" : "loopback";
    EXPECT_EQ(client.ask(status).status().access(), access);
    ClientRequest workers;
    workers.mutable_workers();
    EXPECT_EQ(client.ask(workers).workers().access(), access);
    PretendedWorker worker(server.worker_endpoint());
    worker.hello();
    if (is_insecure) {
      EXPECT_THAT(worker.receive().notice().text(), HasSubstr("--insecure"));
    }
  }
}

TEST_F(EventLoopTest, AllAddressesAreListenedOnAtOnce) {
  RunningServer open(path_, {}, {}, {}, {.listen = "*", .insecure = true});
  const std::string endpoint = open.client_endpoint();
  const std::string port = endpoint.substr(endpoint.rfind(':'));
  EXPECT_TRUE(PretendedClient("tcp://127.0.0.1" + port).submit("a", 10).has_submit());
}

}  // namespace
}  // namespace oblique::server
