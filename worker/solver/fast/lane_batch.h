#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "worker/solver/fast/lane_stepper.h"
#include "worker/solver/model/trace.h"
#include "worker/solver/reference/contact_record.h"
#include "worker/solver/reference/solve_contact.h"

namespace oblique::solver {

/// A contact to solve, from touch on.
struct ContactCase {
  std::uint64_t tag;    ///< the caller's name for it
  std::uint64_t group;  ///< cases of one group that follow each other differ in e* only
  const Chain* chain;   ///< must live until the outcome is given
  ContactParameters parameters;
  ContactSteps steps;
  const ChainState* touch;  ///< of the eliminated chain; read when the case is taken
};

/// What became of a case: a result (without H, fall time and solver name), or why there is none.
struct ContactOutcome {
  std::uint64_t tag;
  std::optional<CaseResult> result;
  std::string error;
};

/// Solves contacts of the explicit integrator side by side in vector lanes. A lane whose contact
/// ends takes the next case at once, and a lane that locates an event steps from its own saved
/// state with a length of its own while the others go on. Cases of a group share the contact up to
/// its first turn, where e* begins to count. A case has the same bits whatever lane, neighbours and
/// group it had, and whether these have its chain or others. Cases of equal chains that follow each
/// other are the fastest. Not for use from two threads at once.
class LaneBatch {
 public:
  using Source = std::function<std::optional<ContactCase>()>;
  using Sink = std::function<void(ContactOutcome&&)>;

  /// For cases of chains of the shape of `shape` (links, elements a link), which need not outlive
  /// this.
  LaneBatch(const Chain& shape, const LaneKernel& kernel);

  /// Solves what `source` gives until it gives nothing more. Outcomes come in the order in which
  /// contacts end. With `tracing`, every case is traced.
  void solve(const Source& source, const Sink& sink, const Tracing& tracing = {});

 private:
  using Clock = std::chrono::steady_clock;
  /// Largest group: the first case and those that branch off.
  static constexpr std::size_t kLargestGroup = 16;

  /// A span shorter than this fraction of a step, as beside an event, gives no mean of a reaction
  /// that rounding leaves alone.
  static constexpr double kShortestSpan = 1e-3;

  struct Lane {
    std::optional<Contact> contact;  ///< empty: the lane idles
    ContactCase contact_case{};
    std::optional<ExplicitMotion> motion;
    TipState touch{};
    Energies in{};
    ReactionPeaks reactions{0};
    std::vector<ContactCase> followers;  ///< the rest of the group, before the first turn
    std::optional<ContactTracer> tracer;
    Clock::time_point started{};
    bool failed = false;
  };
  /// A contact at its first turn.
  struct Trunk {
    Contact contact;
    ChainState state;
    TipState touch;
    Energies in;
    ReactionPeaks reactions;
  };
  struct Branch {
    std::shared_ptr<const Trunk> trunk;
    ContactCase contact_case;
  };
  /// Contact and state of a case into its lane.
  void put_in(std::size_t lane, Contact contact, const ChainState& state);
  void fill(std::size_t lane, const Source& source, const Tracing& tracing);
  void take(std::size_t lane, const ContactCase& next);
  void start(std::size_t lane, const ContactCase& next);
  void start_branch(std::size_t lane);
  void take_followers(Lane& slot, const Source& source);
  void branch_off(std::size_t lane);
  bool advance(std::size_t lane, const Sink& sink);
  void finish(std::size_t lane, std::size_t busy, const Sink& sink);
  std::vector<ReactionPeak> reaction_peaks(std::size_t lane);
  std::size_t busy_lanes() const;
  const ChainState& stored(std::size_t lane);

  std::size_t tip_row_;
  LaneStepper stepper_;
  std::vector<Lane> lanes_;
  std::deque<Branch> branches_;          ///< taken before further cases
  std::optional<ContactCase> upcoming_;  ///< taken from the source, the first of its group
  std::vector<unsigned char> accept_;
  ChainState column_;
};

}  // namespace oblique::solver
