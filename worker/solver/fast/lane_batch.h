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

  /// A contact on its way, and what its result needs besides.
  struct Progress {
    Contact contact;
    TipState touch;
    Energies in;
    ReactionPeaks reactions;
  };
  struct Lane {
    std::optional<Progress> progress;  ///< empty: the lane idles
    ContactCase contact_case{};
    std::optional<ExplicitMotion> motion;
    std::vector<ContactCase> followers;  ///< the rest of the group, before the first turn
    std::optional<ContactTracer> tracer;
    Clock::time_point started{};
  };
  /// A case that goes on from the first turn of its group.
  struct Branch {
    std::shared_ptr<const Progress> progress;
    std::shared_ptr<const ChainState> state;
    ContactCase contact_case;
  };

  void fill(std::size_t lane, const Source& source, const Tracing& tracing);
  void start(std::size_t lane, const ContactCase& next, const ChainState& state, Progress progress);
  void take_followers(Lane& slot, const Source& source);
  void branch_off(std::size_t lane);
  bool advance(std::size_t lane, const Sink& sink);
  void finish(std::size_t lane, std::size_t busy, const Sink& sink);
  std::vector<ReactionPeak> reaction_peaks(std::size_t lane);
  const ChainState& stored(std::size_t lane);

  std::size_t tip_row_;
  LaneStepper stepper_;
  std::vector<Lane> lanes_;
  std::deque<Branch> branches_;          ///< taken before further cases
  std::optional<ContactCase> upcoming_;  ///< taken from the source, the first of its group
  bool is_exhausted_ = false;            ///< the source gives nothing more
  std::vector<unsigned char> accept_;
  ChainState column_;
};

}  // namespace oblique::solver
