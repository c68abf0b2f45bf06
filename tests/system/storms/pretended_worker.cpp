#include "tests/system/storms/pretended_worker.h"

#include <sstream>

#include "proto/frames.h"
#include "proto/result_message.h"
#include "tests/support/programs.h"

namespace oblique::test {

PretendedWorker::PretendedWorker(const std::string& server_url)
    : socket_(context_, zmq::socket_type::dealer) {
  socket_.set(zmq::sockopt::linger, 0);
  socket_.connect(server_url);
}

void PretendedWorker::send(const protocol::WorkerMessage& message) {
  (void)socket_.send(zmq::buffer(protocol::encode(message)), zmq::send_flags::dontwait);
}

void PretendedWorker::hello(const std::string& solver_version, const std::string& process_id) {
  protocol::WorkerMessage message;
  auto& hello = *message.mutable_hello();
  protocol::say_protocol(hello);
  hello.set_solver_version(solver_version);
  hello.set_name("pretended");
  hello.set_threads(1);
  hello.set_process_id(process_id);
  send(message);
}

void PretendedWorker::credit(std::uint32_t batches) {
  protocol::WorkerMessage message;
  message.mutable_credit()->set_batches(batches);
  send(message);
}

void PretendedWorker::heartbeat(const std::vector<std::uint64_t>& leases) {
  protocol::WorkerMessage message;
  message.mutable_heartbeat()->mutable_lease_ids()->Assign(leases.begin(), leases.end());
  send(message);
}

void PretendedWorker::goodbye() {
  protocol::WorkerMessage message;
  message.mutable_goodbye();
  send(message);
}

std::optional<protocol::ServerToWorker> PretendedWorker::receive(std::chrono::milliseconds within) {
  socket_.set(zmq::sockopt::rcvtimeo, static_cast<int>(within.count()));
  zmq::message_t frame;
  protocol::ServerToWorker message;
  if (!socket_.recv(frame) || !protocol::decode(frame.to_string_view(), message)) {
    return std::nullopt;
  }
  return message;
}

std::string worker_solver_version() {
  const TemporaryFolder folder;
  Process process(folder, worker_program(), {"--version"});
  process.wait();
  std::istringstream words(process.out());  // "oblique-worker 0.2.0 (commit ...)"
  std::string program;
  std::string version;
  words >> program >> version;
  return version;
}

}  // namespace oblique::test
