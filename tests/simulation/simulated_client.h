#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "proto/oblique.pb.h"
#include "server/store/changes.h"
#include "tests/simulation/network.h"
#include "tests/simulation/world.h"
#include "tests/support/recipes.h"

namespace oblique::simulation {

/// Submits one study, again and again until it is acknowledged, cancels it now and then and goes on
/// with it. While faults happen it sometimes appends points to it, gives it another name, or
/// deletes it and begins anew under its name.
class SimulatedClient {
 public:
  /// `peer` is its number in the network. `mark` tells the answers of its study from others
  /// (answer_to), and goes up by `kClients` with each study that follows a deleted one. Most
  /// studies have several models, of a point or a few.
  SimulatedClient(World& world, Network& network, std::uint64_t peer, std::string name,
                  std::uint64_t points, std::uint64_t mark);
  static constexpr std::uint64_t kClients = 8;  ///< at most

  void start();

  const std::string& name() const { return name_; }
  std::uint64_t points() const { return points_; }
  /// Of these, how many filters leave in.
  std::uint64_t left_in() const { return left_in_; }
  std::uint64_t mark() const { return mark_; }
  /// A submission was acknowledged at some time.
  bool was_acknowledged() const { return acknowledged_; }
  /// Throws Violation when a server found that state of the study and the client was told another
  /// one and has not asked for this one since.
  void check_found(server::StudyState state) const;
  /// The last thing that was acknowledged is a submission.
  bool wants_results() const {
    return acknowledged_ && intent_ == Intent::kSubmit && settled_request_;
  }
  /// How often it did so.
  std::uint64_t growths = 0;
  std::uint64_t renamings = 0;
  std::uint64_t deletions = 0;

 private:
  enum class Intent { kSubmit, kChange, kRename, kDelete };

  void connect();
  void set_recipe(std::uint64_t points);
  void grow();
  void begin_anew();
  void ask();
  void answered(const std::string& frame);
  void change_mind();
  void expect(protocol::StudyChange asked);

  World& world_;
  Network& network_;
  std::uint64_t peer_;
  std::string name_;
  std::uint64_t points_ = 0;
  std::uint64_t left_in_ = 0;  // of these, by filters
  std::uint64_t mark_;
  std::uint64_t study_id_ = 0;  // as it was acknowledged
  std::string new_name_;
  std::uint64_t appended_ = 0;  // by the request
  protocol::Recipe recipe_ = protocol::recipe_of({});
  Network::LinkId link_ = 0;
  std::uint64_t request_ = 0;
  bool acknowledged_ = false;
  Intent intent_ = Intent::kSubmit;        // of the request
  bool settled_request_ = false;           // it was answered
  std::set<protocol::StudyChange> asked_;  // by this request, which changes when it is repeated
  /// States in which the study can be, besides done: the one last acknowledged, and those asked for
  /// since. Nothing when all are possible.
  std::optional<std::set<server::StudyState>> possible_;
};

}  // namespace oblique::simulation
