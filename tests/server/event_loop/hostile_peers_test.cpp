// The whole server in this process against peers that mean harm, by raw TCP.
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

TEST_F(HostilePeersTest, PeersKilledWithMuchUnheardAndUnreadHarmNobody) {
  RunningServer server(path_);
  PretendedClient(server.client_endpoint()).submit("a", 10);
  constexpr int kLong = 1'000'000;
  for (const std::string& between : {std::string(), zmtp_ping("context")}) {
    RawPeer worker(server.worker_endpoint());
    worker.shake_hands();
    worker.send(hello_frame() + repeated(heartbeat_frame(kLong), 2));
    worker.send(repeated(heartbeat_frame(1) + between, 3000));
    worker.reset();
    RawPeer client(server.client_endpoint());
    client.shake_hands();
    client.send(repeated(status_frame() + between, 4000));
    client.reset();
  }
  EXPECT_EQ(PretendedClient(server.client_endpoint()).status("a").points(), 10U);
}

TEST_F(HostilePeersTest, AMessageThatNeverEndsFillsNoMemory) {
  RunningServer server(path_);
  PretendedClient(server.client_endpoint()).submit("a", 10);
  RawPeer worker(server.worker_endpoint());
  RawPeer client(server.client_endpoint());
  worker.shake_hands();
  client.shake_hands();
  const std::size_t before = resident_bytes();
  const std::string part = zmtp_frame(std::string(kMiB, 'x'), true);
  const std::string small_parts = repeated(zmtp_frame("", true), 100'000);
  for (int i = 0; i < 300; ++i) {
    worker.send(part + small_parts);
    client.send(part);
  }
  EXPECT_LT(resident_bytes(), before + with_shadows(150 * kMiB));
  PretendedClient sound(server.client_endpoint());
  EXPECT_EQ(sound.status("a").points(), 10U);
}

TEST_F(HostilePeersTest, PeersThatUseOneIdentityFillNoMemory) {
  RunningServer server(path_);
  const std::string ready = zmtp_command("READY", std::string("\x0bSocket-Type\0\0\0\x06"
                                                              "DEALER\x08Identity\0\0\0\x04same",
                                                              39));
  std::vector<std::unique_ptr<RawPeer>> peers;
  const std::size_t before = resident_bytes();
  const std::string flood = repeated(zmtp_frame(std::string(kMiB, 'x')), 32);
  for (int i = 0; i < 10; ++i) {
    peers.push_back(std::make_unique<RawPeer>(server.worker_endpoint()));
    peers.back()->send(zmtp_greeting() + ready);
    peers.back()->send(flood);
  }
  EXPECT_LT(resident_bytes(), before + with_shadows(150 * kMiB));
  PretendedClient sound(server.client_endpoint());
  EXPECT_TRUE(sound.submit("a", 10).has_submit());
}

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
