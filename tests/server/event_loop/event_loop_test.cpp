// Runs the whole server in this process, on loopback sockets, with simulated workers and clients.
#include "server/event_loop/event_loop.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/result_message.h"
#include "server/maintenance/backup.h"
#include "server/query/reader.h"
#include "tests/server/event_loop/running_server.h"
#include "tests/server/network/raw_peer.h"
#include "tests/support/recipes.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

class EventLoopTest : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
};

TEST_F(EventLoopTest, AStudyIsSolvedStoredAndQueried) {
  RunningServer server(path_);
  SimulatedClient client(server.client_endpoint());
  EXPECT_EQ(client.submit("a", 30).submit().points(), 30U);
  SimulatedWorker worker(server.worker_endpoint());
  ASSERT_TRUE(worker.hello().has_welcome());
  worker.work(30);
  EXPECT_EQ(client.status("a").state(), "done");
  EXPECT_EQ(client.rows("SELECT count(*), count(DISTINCT point) FROM results").rows.at(0),
            (protocol::Row{std::int64_t{30}, std::int64_t{30}}));
  ClientRequest workers;
  workers.mutable_workers();
  const auto known = client.reply_to(workers).workers();
  ASSERT_EQ(known.workers_size(), 1);
  EXPECT_EQ(known.workers(0).solved_points(), 30U);
}

TEST_F(EventLoopTest, EveryRequestForAnUnknownStudyGetsTheSameErrorCode) {
  RunningServer server(path_);
  SimulatedClient client(server.client_endpoint());
  client.submit("a", 1);
  std::vector<ClientRequest> requests(5);
  requests[0].mutable_query()->mutable_question()->set_study("b");
  requests[1].mutable_status()->set_study("b");
  requests[2].mutable_describe()->set_study("b");
  requests[3].mutable_trace()->set_study("b");
  requests[4].mutable_change()->set_study("b");
  for (const ClientRequest& request : requests) {
    EXPECT_EQ(client.reply_to(request).error().code(), protocol::ERROR_CODE_NO_SUCH_STUDY)
        << request.DebugString();
  }
  ClientRequest wrong;
  wrong.mutable_query()->mutable_question()->set_study("a");
  wrong.mutable_query()->mutable_question()->set_where("nothing > 1");
  EXPECT_EQ(client.reply_to(wrong).error().code(), protocol::ERROR_CODE_WRONG_REQUEST);
  EXPECT_EQ(client.query("SELEC 1").error().code(), protocol::ERROR_CODE_WRONG_REQUEST);
}

TEST_F(EventLoopTest, ResultsOfAnotherStudyAreReused) {
  RunningServer server(path_);
  SimulatedClient client(server.client_endpoint());
  client.submit("a", 20);
  SimulatedWorker worker(server.worker_endpoint());
  worker.hello();
  worker.work(20);
  ClientRequest request;
  request.mutable_submit()->set_name("b");
  *request.mutable_submit()->mutable_recipe() = table_of(20)->recipe();
  const auto reply = client.reply_to(request).submit();
  EXPECT_EQ(reply.completed(), 20U);
  EXPECT_EQ(reply.reused().points(), 20U);
  EXPECT_EQ(client.status("b").state(), "done");
  EXPECT_EQ(client.rows("SELECT count(*) FROM runs WHERE reused_from = 'a/' || point").rows.at(0),
            protocol::Row{std::int64_t{20}});
}

TEST_F(EventLoopTest, ARestartedServerContinuesItsStudies) {
  {
    RunningServer server(path_);
    SimulatedClient client(server.client_endpoint());
    client.submit("a", 30);
    SimulatedWorker worker(server.worker_endpoint());
    worker.hello();
    worker.work(5);
  }
  RunningServer server(path_);
  SimulatedClient client(server.client_endpoint());
  const auto status = client.status("a");
  EXPECT_GE(status.solved(), 5U);
  EXPECT_EQ(status.state(), "running");
  SimulatedWorker worker(server.worker_endpoint());
  EXPECT_EQ(worker.hello().welcome().worker_id(), 2U);
  worker.work(30 - status.solved());
  EXPECT_EQ(client.status("a").state(), "done");
}

TEST_F(EventLoopTest, LateResultsAreNotStoredForAStudyThatGotTheirNumberAfterACopyWasRestored) {
  const std::string copy = folder_.file("copy.db");
  protocol::Recipe soft = table_of(30)->recipe();
  protocol::Recipe stiff = soft;
  stiff.mutable_model()->set_k_n_m(2 * soft.model().k_n_m());
  protocol::Recipe deeper = soft;
  for (double& H_m : *deeper.mutable_blocks(0)->mutable_axes(0)->mutable_values()) {
    H_m *= 1.01;
  }
  for (const protocol::Recipe& later : {stiff, deeper}) {
    for (const bool is_copied_by_hand : {false, true}) {
      SCOPED_TRACE(is_copied_by_hand);
      for (const auto& file : {path_, copy}) {
        std::filesystem::remove(file);
      }
      {
        RunningServer server(path_);
        SimulatedClient(server.client_endpoint()).submit("before", 5);
      }
      if (is_copied_by_hand) {
        std::filesystem::copy_file(path_, copy);
      } else {
        back_up(path_, copy);
      }
      WorkerMessage late;
      std::string database_id;
      {
        RunningServer server(path_);
        SimulatedClient client(server.client_endpoint());
        SimulatedWorker worker(server.worker_endpoint());
        database_id = worker.hello().welcome().database_id();
        worker.work(5);
        ASSERT_EQ(client.submit("soft", soft).submit().study_id(), 2U);
        ServerToWorker message;
        while (message.batch().study_id() != 2) {
          message = worker.receive();
        }
        late = worker.results_of(message.batch());
        late.mutable_results()->set_lease_id(0);
      }
      std::filesystem::rename(copy, path_);

      RunningServer server(path_);
      SimulatedClient client(server.client_endpoint());
      ASSERT_EQ(client.submit("later", later).submit().study_id(), 2U);
      SimulatedWorker worker(server.worker_endpoint());
      EXPECT_EQ(worker.hello().welcome().database_id() == database_id, is_copied_by_hand);
      worker.send(late);
      EXPECT_EQ(worker.receive().results_stored().sequence(), late.results().sequence());
      const protocol::StudyStatus status = client.status("later");
      EXPECT_EQ(status.solved(), 0U);
      EXPECT_EQ(status.failed(), 0U);
    }
  }
}

TEST_F(EventLoopTest, AStoppingServerNotifiesWorkersAndCommitsReceivedResults) {
  auto server = std::make_unique<RunningServer>(path_);
  SimulatedClient client(server->client_endpoint());
  client.submit("a", 1000);
  SimulatedWorker worker(server->worker_endpoint());
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
  // The reply to the heartbeat shows that the results sent before it have arrived.
  while (!received) {
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

TEST_F(EventLoopTest, MaliciousFramesHarmNoOtherPeer) {
  RunningServer server(path_);
  SimulatedClient client(server.client_endpoint());
  SimulatedWorker worker(server.worker_endpoint());
  worker.hello();
  SimulatedWorker hostile_worker(server.worker_endpoint());
  SimulatedClient hostile_client(server.client_endpoint());
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

TEST_F(EventLoopTest, ALongRecipeIsStoredAndLeasedWithoutDelayingOthers) {
  RunningServer server(path_);
  SimulatedClient client(server.client_endpoint());
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
  SimulatedClient other(server.client_endpoint());
  other.send(large);
  EXPECT_EQ(client.status("small").points(), 10U);
  EXPECT_EQ(other.receive().submit().points(), 1024ULL * 1024 * kBlocks);
  SimulatedWorker worker(server.worker_endpoint());
  worker.hello();
  worker.credit(1);
  EXPECT_EQ(worker.receive().study().recipe().blocks_size(), kBlocks);
  EXPECT_TRUE(worker.receive().has_batch());
}

/// In this query SQLite compares bytes for hours without checking for an interrupt.
constexpr const char* kUninterruptible =
    "SELECT instr(zeroblob(16000000), zeroblob(7999999) || x'01')";

TEST_F(EventLoopTest, ALongQueryDelaysNothingElse) {
  RunningServer server(path_);
  SimulatedClient client(server.client_endpoint());
  SimulatedClient other(server.client_endpoint());
  other.start_query(kUninterruptible);
  EXPECT_TRUE(client.submit("a", 10).has_submit());
  EXPECT_EQ(client.status("a").points(), 10U);
  EXPECT_EQ(client.rows("SELECT 3").rows.at(0), protocol::Row{std::int64_t{3}});
}

TEST_F(EventLoopTest, TheQueriesOfAClientEndWithItsConnection) {
  QueueSettings queue;
  queue.readers = 2;
  ClientHandlerSettings clients;
  // The server sends no periodic replies here. So only the closed connection shows that the client
  // is gone.
  clients.still_working_every_ms = 1'000'000;
  RunningServer server(path_, queue, {}, clients);
  for (int i = 0; i < 2; ++i) {
    SimulatedClient client(server.client_endpoint());
    client.send(SimulatedClient::query_request(kUninterruptible));
    // The reply to this later request shows that the query has arrived.
    EXPECT_TRUE(client.submit("a", 10).has_submit());
  }
  SimulatedClient client(server.client_endpoint());
  EXPECT_EQ(client.rows("SELECT 3").rows.at(0), protocol::Row{std::int64_t{3}});
}

TEST_F(EventLoopTest, RunningQueriesDoNotDelayAStop) {
  RunningServer server(path_);
  SimulatedClient client(server.client_endpoint());
  client.start_query(kUninterruptible);
  EXPECT_EQ(server.stop().lost_writes, 0U);
  while (!client.receive().has_error()) {
  }
}

TEST_F(EventLoopTest, TheSecondServerOfADatabaseIsRefused) {
  RunningServer server(path_);
  EXPECT_THROW(RunningServer{path_}, StorageError);
}

TEST_F(EventLoopTest, StatusShowsWhichPeersAreAdmitted) {
  for (const bool is_insecure : {false, true}) {
    RunningServer server(path_, {}, {}, {}, {.insecure = is_insecure});
    SimulatedClient client(server.client_endpoint());
    ClientRequest status;
    status.mutable_status();
    const std::string access = is_insecure ? "insecure" : "loopback";
    EXPECT_EQ(client.reply_to(status).status().access(), access);
    ClientRequest workers;
    workers.mutable_workers();
    EXPECT_EQ(client.reply_to(workers).workers().access(), access);
  }
}

// ---- Malicious peers on raw TCP connections -----------------------------------------------------

constexpr std::size_t kMiB = std::size_t{1} << 20U;

/// Returns the resident memory of the test process, which includes the server.
std::size_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::size_t total_pages = 0;
  std::size_t resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return resident_pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

/// Returns the memory that `bytes` bytes of the server take in this build. The eighth that the
/// address sanitizer adds is neglected.
constexpr std::size_t with_shadows(std::size_t bytes) {
#if defined(__SANITIZE_THREAD__)
  return 5 * bytes;  // the thread sanitizer needs four more bytes per byte
#else
  return bytes;
#endif
}

std::string hello_frame() {
  WorkerMessage message;
  protocol::set_protocol(*message.mutable_hello());
  message.mutable_hello()->set_solver_version("1.0");
  message.mutable_hello()->set_threads(1);
  return zmtp_frame(protocol::encode(message));
}

std::string heartbeat_frame(int leases) {
  WorkerMessage message;
  message.mutable_heartbeat();
  for (int i = 0; i < leases; ++i) {
    message.mutable_heartbeat()->add_lease_ids(static_cast<std::uint64_t>(i));
  }
  return zmtp_frame(protocol::encode(message));
}

std::string status_frame() {
  ClientRequest request;
  request.set_protocol_version(protocol::kProtocolVersion);
  request.mutable_status();
  return zmtp_frame(protocol::encode(request));
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) {
    all += text;
  }
  return all;
}

TEST_F(EventLoopTest, AClientThatReadsNothingCannotExhaustMemory) {
  RunningServer server(path_);
  SimulatedClient client(server.client_endpoint());
  constexpr int kStudies = 200;
  for (int i = 0; i < kStudies; ++i) {
    const auto reply = client.submit(std::to_string(i) + std::string(90, 'n'), 10);
    ASSERT_TRUE(reply.has_submit()) << reply.error().message();
  }
  RawPeer silent(server.client_endpoint());
  silent.complete_handshake();
  const std::size_t before = resident_bytes();
  // The replies to all requests would have more than a gigabyte.
  const std::string requests = repeated(status_frame(), 1000);
  for (int i = 0; i < 50; ++i) {
    silent.flood(requests);
    client.status("0" + std::string(90, 'n'));
  }
  EXPECT_LT(resident_bytes(), before + with_shadows(100 * kMiB));
}

TEST_F(EventLoopTest, FloodsOfWorkersAndClientsDoNotStarveOthers) {
  RunningServer server(path_);
  SimulatedClient client(server.client_endpoint());
  client.submit("a", 2000);
  std::atomic<bool> stop = false;
  std::vector<std::thread> floods;
  for (int i = 0; i < 4; ++i) {
    floods.emplace_back([&, i] {
      RawPeer peer(i % 2 == 0 ? server.worker_endpoint() : server.client_endpoint());
      peer.complete_handshake();
      const std::string bytes = i % 2 == 0 ? hello_frame() + repeated(heartbeat_frame(1000), 100)
                                           : repeated(status_frame(), 1000);
      while (!stop) {
        peer.flood(bytes);
      }
    });
  }
  SimulatedWorker worker(server.worker_endpoint());
  worker.hello();
  worker.work(2000);
  EXPECT_EQ(client.status("a").state(), "done");
  stop = true;
  for (std::thread& flood : floods) {
    flood.join();
  }
}

}  // namespace
}  // namespace oblique::server
