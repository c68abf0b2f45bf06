// The whole server in this process against malicious peers, by raw TCP. What they meet in the
// network alone is tested in tests/server/network.
#include <atomic>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/result_message.h"
#include "tests/server/event_loop/running_server.h"
#include "tests/server/network/raw_peer.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20U;

/// Memory of this process, the server in it.
std::size_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::size_t total_pages = 0;
  std::size_t resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return resident_pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

/// What a server may need besides what it holds for peers, where every byte has its shadow too.
constexpr std::size_t with_shadows(std::size_t bytes) {
#if defined(__SANITIZE_THREAD__)
  return 5 * bytes;  // the thread sanitizer keeps four for each
#else
  return bytes;
#endif
}

std::string hello_frame() {
  WorkerMessage message;
  protocol::say_protocol(*message.mutable_hello());
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

class HostilePeersTest : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("studies.db");
};

TEST_F(HostilePeersTest, AClientThatReadsNothingFillsNoMemory) {
  RunningServer server(path_);
  PretendedClient client(server.client_endpoint());
  constexpr int kStudies = 200;
  for (int i = 0; i < kStudies; ++i) {
    const auto reply = client.submit(std::to_string(i) + std::string(90, 'n'), 10);
    ASSERT_TRUE(reply.has_submit()) << reply.error().message();
  }
  RawPeer silent(server.client_endpoint());
  silent.shake_hands();
  const std::size_t before = resident_bytes();
  // Their answers would have more than a gigabyte.
  const std::string requests = repeated(status_frame(), 1000);
  for (int i = 0; i < 50; ++i) {
    silent.flood(requests);
    client.status("0" + std::string(90, 'n'));
  }
  EXPECT_LT(resident_bytes(), before + with_shadows(100 * kMiB));
}

TEST_F(HostilePeersTest, FloodsOfManyWorkersAndClientsKeepNobodyFromBeingServed) {
  RunningServer server(path_);
  PretendedClient client(server.client_endpoint());
  client.submit("a", 2000);
  std::atomic<bool> stop = false;
  std::vector<std::thread> floods;
  for (int i = 0; i < 4; ++i) {
    floods.emplace_back([&, i] {
      RawPeer peer(i % 2 == 0 ? server.worker_endpoint() : server.client_endpoint());
      peer.shake_hands();
      const std::string bytes = i % 2 == 0 ? hello_frame() + repeated(heartbeat_frame(1000), 100)
                                           : repeated(status_frame(), 1000);
      while (!stop) {
        peer.flood(bytes);
      }
    });
  }
  PretendedWorker worker(server.worker_endpoint());
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
