#include "worker/solver/fast/lane_contacts.h"

#include <chrono>
#include <cstddef>
#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "worker/solver/fast/lane_stepper.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/reference/contact_record.h"

namespace oblique::solver {
namespace {

using Clock = std::chrono::steady_clock;
using Source = std::function<std::optional<ContactCase>()>;
using Sink = std::function<void(Outcome&&)>;

/// Maximum number of cases that share a contact until its first compression ends.
constexpr std::size_t kLargestGroup = 16;
/// The mean of a reaction over less than this fraction of a step, as near an event, is not used,
/// because it is mostly rounding error.
constexpr double kShortestSpan = 1e-3;

/// A contact that is being solved, and other data that its result needs.
struct Progress {
  Contact contact;
  TipState touch;
  Energies in;
  ReactionPeaks reactions;
};

struct Lane {
  std::optional<Progress> progress;  ///< empty if the lane is idle
  ContactCase contact_case{};
  std::optional<ExplicitMotion> motion;
  std::vector<ContactCase> followers;  ///< other cases that share the first compression
  Clock::time_point started{};
};

/// A case that continues where the first compression of its group ended.
struct Branch {
  ContactCase contact_case;
  Progress progress;
  std::shared_ptr<const ChainState> state;
};

class ContactLanes {
 public:
  ContactLanes(const Chain& shape, const Source& source, const Sink& sink, const Tracing& tracing,
               const LaneKernel& kernel)
      : source_(source),
        sink_(sink),
        tracing_(tracing),
        stepper_(shape.tables(), kernel),
        lanes_(kernel.lanes),
        accept_(kernel.lanes, 0),
        column_(shape.at_rest()) {}

  void solve() {
    for (;;) {
      busy_ = 0;
      for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
        if (!lanes_[lane].progress) {
          fill(lane);
        }
        busy_ += lanes_[lane].progress ? 1U : 0U;
      }
      if (busy_ == 0) {
        return;
      }
      stepper_.step();
      for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
        accept_[lane] = lanes_[lane].progress && judge(lane) ? 1 : 0;
      }
      stepper_.settle(accept_);
      for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
        if (lanes_[lane].progress) {
          follow(lane);
        }
      }
    }
  }

 private:
  /// Starts a case in an idle lane: a branch if there is one, else the next case of the source.
  void fill(std::size_t lane) {
    if (!branches_.empty()) {
      Branch branch = std::move(branches_.front());
      branches_.pop_front();
      start(lane, branch.contact_case, *branch.state, std::move(branch.progress));
      return;
    }
    if (!peek()) {
      return;
    }
    const ContactCase next = take();
    const ChainState& touch = *next.touch;
    const ExplicitMotion motion(*next.chain);
    const TipState tip = motion.tip(touch);
    start(lane, next, touch,
          {Contact(next.parameters, tip, next.steps), tip, motion.energies(touch),
           ReactionPeaks(next.chain->links())});
    Lane& slot = lanes_[lane];
    if (tracing_.sink) {
      trace_instant(*slot.motion, tracing_, tip, slot.progress->contact, touch);
      return;
    }
    // The state at touch was copied to the lane, so the source may overwrite it.
    while (slot.followers.size() + 1 < kLargestGroup && peek() && upcoming_->group == next.group) {
      slot.followers.push_back(take());
    }
  }

  /// Sets upcoming_ to the next case. Returns false if the source has no more cases.
  bool peek() {
    if (!upcoming_ && !is_exhausted_) {
      upcoming_ = source_();
      is_exhausted_ = !upcoming_;
    }
    return upcoming_.has_value();
  }
  ContactCase take() { return *std::exchange(upcoming_, std::nullopt); }

  void start(std::size_t lane, const ContactCase& next, const ChainState& state,
             Progress&& progress) {
    Lane& slot = lanes_[lane];
    slot.contact_case = next;
    slot.motion.emplace(*next.chain);
    slot.started = Clock::now();
    stepper_.load(lane, next.chain->tables(), state.q.data(), state.v.data());
    stepper_.set_step(lane, progress.contact.trial_step_s());
    stepper_.set_force(lane, progress.contact.force());
    slot.progress = std::move(progress);
  }

  /// Returns whether the trial step of a lane is accepted. Sets the next step.
  bool judge(std::size_t lane) {
    Lane& slot = lanes_[lane];
    Contact& contact = slot.progress->contact;
    const int events = contact.events();
    const double h_s = contact.trial_step_s();
    bool is_accepted = false;
    try {
      is_accepted = contact.judge(stepper_.trial_tip(lane), stepper_.integrals(lane));
    } catch (const SolveError& error) {
      end(lane, std::nullopt, error.what());
      for (const ContactCase& follower : std::exchange(slot.followers, {})) {
        sink_({follower.number, std::nullopt, error.what()});  // its contact is the same so far
      }
      return false;
    }
    if (is_accepted && h_s >= kShortestSpan * contact.step_lengths().compression_s) {
      slot.progress->reactions.add(contact.time_s(), h_s,
                                   stepper_.mean_reactions_squared_N2() + lane, lanes_.size());
    }
    stepper_.set_step(lane, contact.trial_step_s());
    if (contact.events() != events) {
      stepper_.set_force(lane, contact.force());
    }
    return is_accepted;
  }

  void follow(std::size_t lane) {
    Lane& slot = lanes_[lane];
    const Contact& contact = slot.progress->contact;
    if (accept_[lane] != 0 && tracing_.sink) {
      trace_instant(*slot.motion, tracing_, slot.progress->touch, contact, stored(lane));
    }
    if (!slot.followers.empty() && contact.is_at_first_turn()) {
      branch_off(lane);
    }
    if (contact.finished()) {
      finish(lane);
    }
  }

  void branch_off(std::size_t lane) {
    Lane& slot = lanes_[lane];
    const Progress& trunk = *slot.progress;
    const auto state = std::make_shared<const ChainState>(stored(lane));
    for (const ContactCase& follower : slot.followers) {
      branches_.push_back({follower,
                           {trunk.contact.branched(follower.parameters.e_star, follower.steps),
                            trunk.touch, trunk.in, trunk.reactions},
                           state});
    }
    slot.followers.clear();
  }

  void finish(std::size_t lane) {
    const Lane& slot = lanes_[lane];
    const Contact& contact = slot.progress->contact;
    try {
      CaseResult result = contact_result(contact, slot.progress->touch, slot.progress->in,
                                         slot.motion->energies(stored(lane)));
      result.reaction_peaks = reaction_peaks(lane);
      const std::chrono::duration<double> elapsed = Clock::now() - slot.started;
      result.solver.wall_s = elapsed.count() / static_cast<double>(busy_);  // lanes share the time
      end(lane, std::move(result), {});
    } catch (const SolveError& error) {
      end(lane, std::nullopt, error.what());
    }
  }

  /// Frees the lane before it calls the sink, because the sink may delete the chain.
  void end(std::size_t lane, std::optional<CaseResult>&& result, std::string error) {
    lanes_[lane].progress.reset();
    stepper_.idle(lane);
    sink_({lanes_[lane].contact_case.number, std::move(result), std::move(error)});
  }

  std::vector<ReactionPeak> reaction_peaks(std::size_t lane) {
    Progress& progress = *lanes_[lane].progress;
    if (progress.reactions.rises_at_end()) {
      Eigen::Matrix2Xd reactions_N;
      lanes_[lane].motion->reactions(progress.contact.force(), stored(lane), reactions_N);
      const Eigen::RowVectorXd squared_N2 = reactions_N.colwise().squaredNorm();
      progress.reactions.add(progress.contact.time_s(), 0.0, squared_N2.data());
    }
    return progress.reactions.peaks();
  }

  const ChainState& stored(std::size_t lane) {
    stepper_.store(lane, column_.q.data(), column_.v.data());
    return column_;
  }

  const Source& source_;
  const Sink& sink_;
  const Tracing& tracing_;
  LaneStepper stepper_;
  std::vector<Lane> lanes_;
  std::size_t busy_ = 0;                 ///< number of lanes that are not idle
  std::deque<Branch> branches_;          ///< started before further cases of the source
  std::optional<ContactCase> upcoming_;  ///< next case of the source
  bool is_exhausted_ = false;            ///< the source has no further cases
  std::vector<unsigned char> accept_;
  ChainState column_;
};

}  // namespace

void solve_contacts(const Chain& shape, const Source& source, const Sink& sink,
                    const Tracing& tracing, const LaneKernel& kernel) {
  ContactLanes(shape, source, sink, tracing, kernel).solve();
}

}  // namespace oblique::solver
