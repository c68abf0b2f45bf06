// The whole server with keys, in this process, against peers that mean harm and have some, or none.
#include <atomic>
#include <deque>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/keys/key_file.h"
#include "tests/server/event_loop/running_server.h"
#include "tests/server/network/keyed_peer.h"
#include "tests/support/temporary_folder.h"

namespace oblique::server {
namespace {

class KeyedPeersTest : public testing::Test {
 protected:
  KeyedPeersTest() {
    protocol::write_key_file(key_file_, {protocol::Role::kServer, "server", server_keys_});
    protocol::change_authorized_keys(
        protocol::authorized_keys_beside(key_file_), [this](protocol::AuthorizedKeys& keys) {
          keys.add({"anna", protocol::Role::kClient, client_keys_.public_key, protocol::utc_now()});
          keys.add(
              {"berta", protocol::Role::kWorker, worker_keys_.public_key, protocol::utc_now()});
        });
    server_ = std::make_unique<RunningServer>(folder_.file("studies.db"), QueueSettings{},
                                              NetworkLimits{}, ClientHandlerSettings{},
                                              DoorSettings{"127.0.0.1", key_file_, false});
  }

  KeyedPeer client() const {
    return {server_->client_endpoint(), {client_keys_, server_keys_.public_key}};
  }
  static void expect_answer(KeyedPeer& client, std::uint64_t number) {
    ClientRequest request;
    request.set_protocol_version(protocol::kProtocolVersion);
    request.set_request_id(number);
    request.mutable_workers();
    client.send(client.sealed(protocol::encode(request)));
    ClientReply reply;
    ASSERT_TRUE(protocol::decode(client.receive(), reply));
    EXPECT_EQ(reply.request_id(), number);
    EXPECT_TRUE(reply.has_workers());
  }

  test::TemporaryFolder folder_;
  std::string key_file_ = folder_.file("server.key");
  protocol::KeyPair server_keys_ = protocol::made_key_pair();
  protocol::KeyPair client_keys_ = protocol::made_key_pair();
  protocol::KeyPair worker_keys_ = protocol::made_key_pair();
  std::unique_ptr<RunningServer> server_;
};

TEST_F(KeyedPeersTest, AKeyIsAdmittedAtThePortOfItsRoleAlone) {
  const CurveClient worker(worker_keys_, server_keys_.public_key);
  const CurveClient client(client_keys_, server_keys_.public_key);
  EXPECT_NO_THROW(KeyedPeer(server_->worker_endpoint(), worker));
  EXPECT_NO_THROW(KeyedPeer(server_->client_endpoint(), client));
  EXPECT_THROW(KeyedPeer(server_->client_endpoint(), worker), std::runtime_error);
  EXPECT_THROW(KeyedPeer(server_->worker_endpoint(), client), std::runtime_error);
}

/// A stranger that says HELLO on ever new connections, until it goes out of scope.
class Flood {
 public:
  Flood(std::vector<std::string> endpoints, CurveClient stranger)
      : endpoints_(std::move(endpoints)),
        hello_(curve_greeting() + zmtp_command("HELLO", stranger.hello())),
        thread_([this] { go_on(); }) {}
  ~Flood() {
    is_over_ = true;
    thread_.join();
  }
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;

 private:
  void go_on() {
    constexpr std::size_t kAtATime = 200;
    std::deque<std::unique_ptr<RawPeer>> peers;
    for (std::size_t i = 0; !is_over_; ++i) {
      try {
        peers.push_back(std::make_unique<RawPeer>(endpoints_[i % endpoints_.size()]));
        peers.back()->send_what_fits(hello_);
      } catch (const std::runtime_error&) {
        // the system has no connection to give at present
      }
      if (peers.size() > kAtATime) {
        peers.pop_front();
      }
    }
  }

  std::vector<std::string> endpoints_;
  std::string hello_;
  std::atomic<bool> is_over_ = false;
  std::thread thread_;
};

TEST_F(KeyedPeersTest, WhoIsInIsAnsweredWhileStrangersBeginHandshakesWithoutEnd) {
  KeyedPeer anna = client();
  const Flood flood({server_->client_endpoint(), server_->worker_endpoint()},
                    {protocol::made_key_pair(), server_keys_.public_key});
  for (std::uint64_t number = 1; number <= 50; ++number) {
    expect_answer(anna, number);
  }
  KeyedPeer again = client();  // and who comes in meanwhile
  expect_answer(again, 51);
}

TEST_F(KeyedPeersTest, PeersKilledWithMuchUnheardUnderSealHarmNobody) {
  KeyedPeer anna = client();
  for (const bool says_hello : {true, false}) {
    KeyedPeer worker(server_->worker_endpoint(), {worker_keys_, server_keys_.public_key});
    WorkerMessage message;
    if (says_hello) {
      protocol::say_protocol(*message.mutable_hello());
      message.mutable_hello()->set_solver_version("1.0");
      worker.send(worker.sealed(protocol::encode(message)));
    }
    message.mutable_heartbeat()->add_lease_ids(1);
    std::string bytes;
    for (int i = 0; i < 3000; ++i) {
      bytes += worker.sealed(protocol::encode(message));
      bytes += worker.sealed(std::string("\x04PING\0\0", 7), 2);
    }
    worker.send(bytes);
    worker.reset();
    expect_answer(anna, says_hello ? 1 : 2);
  }
  KeyedPeer again = client();
  expect_answer(again, 3);
}

}  // namespace
}  // namespace oblique::server
