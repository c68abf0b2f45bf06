#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "proto/oblique.pb.h"
#include "server/store/changes.h"
#include "tests/simulation/network.h"
#include "tests/simulation/world.h"

namespace oblique::simulation {

/// Submits one study, again and again until it is acknowledged, cancels it now and then and goes on
/// with it.
class SimulatedClient {
 public:
  /// `peer` is its number in the network. Most studies have several models, of a point or a few.
  SimulatedClient(World& world, Network& network, std::uint64_t peer, std::string name,
                  std::uint64_t points);

  void start();

  const std::string& name() const { return name_; }
  std::uint64_t points() const { return points_; }
  /// A submission was acknowledged at some time.
  bool was_acknowledged() const { return acknowledged_; }
  /// Throws Violation when a server found that state of the study and the client was told another
  /// one and has not asked for this one since.
  void check_found(server::StudyState state) const;
  /// The last thing that was acknowledged is a submission.
  bool wants_results() const { return acknowledged_ && !cancelling_ && settled_request_; }

 private:
  void connect();
  void ask();
  void answered(const std::string& frame);
  void change_mind();
  void expect(protocol::StudyChange asked);

  World& world_;
  Network& network_;
  std::uint64_t peer_;
  std::string name_;
  std::uint64_t points_;
  protocol::Recipe recipe_;
  Network::LinkId link_ = 0;
  std::uint64_t request_ = 0;
  bool acknowledged_ = false;
  bool cancelling_ = false;                // the request is a cancellation
  bool settled_request_ = false;           // it was answered
  std::set<protocol::StudyChange> asked_;  // by this request, which changes when it is repeated
  /// States in which the study can be, besides done: the one last acknowledged, and those asked for
  /// since. Nothing when all are possible.
  std::optional<std::set<server::StudyState>> possible_;
};

}  // namespace oblique::simulation
