#pragma once

#include <cstdint>
#include <string>

#include "tests/simulation/network.h"
#include "tests/simulation/world.h"

namespace oblique::simulation {

/// Submits one study, again and again until it is acknowledged, cancels it now and then and goes on
/// with it.
class SimulatedClient {
 public:
  SimulatedClient(World& world, Network& network, std::string name, std::uint64_t points);

  void start();

  const std::string& name() const { return name_; }
  std::uint64_t points() const { return points_; }
  /// A submission was acknowledged at some time.
  bool was_acknowledged() const { return acknowledged_; }
  /// The last thing that was acknowledged is a submission.
  bool wants_results() const { return acknowledged_ && !cancelling_ && settled_request_; }

 private:
  void connect();
  void ask();
  void answered(const std::string& frame);
  void change_mind();

  World& world_;
  Network& network_;
  std::string name_;
  std::uint64_t points_;
  Network::LinkId link_ = 0;
  std::uint64_t request_ = 0;
  bool acknowledged_ = false;
  bool cancelling_ = false;       // the request is a cancellation
  bool settled_request_ = false;  // it was answered
};

}  // namespace oblique::simulation
