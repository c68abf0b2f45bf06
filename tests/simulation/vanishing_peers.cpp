#include "tests/simulation/vanishing_peers.h"

#include <memory>
#include <string>

#include "proto/frames.h"
#include "proto/oblique.pb.h"
#include "proto/result_message.h"

namespace oblique::simulation {

void VanishingPeers::come() {
  constexpr std::uint64_t kFirstPeer = 1000;  // in the network, above all workers
  constexpr std::uint32_t kGreed = 1000;
  ++came_;
  const auto has_points = std::make_shared<bool>(false);
  const auto link = network_.open(kFirstPeer + came_, [has_points](const std::string& frame) {
    protocol::ServerToWorker message;
    *has_points = *has_points || (protocol::decode(frame, message) && message.has_batch() &&
                                  message.batch().study_id() != 0);
  });
  protocol::WorkerMessage hello;
  protocol::say_protocol(*hello.mutable_hello());
  hello.mutable_hello()->set_solver_version("1");
  hello.mutable_hello()->set_threads(1);
  hello.mutable_hello()->set_process_id("vanishing " + std::to_string(came_));
  protocol::WorkerMessage credit;
  credit.mutable_credit()->set_batches(kGreed);
  network_.send(link, protocol::encode(hello), false);
  network_.send(link, protocol::encode(credit), false);
  world_.after(world_.between(10, 500), [this, link, has_points] {
    network_.close(link, false);
    vanished_ += *has_points ? 1U : 0U;
  });
}

}  // namespace oblique::simulation
