#include "worker/solver/fast/lane_batch.h"

#include <utility>

#include "worker/solver/model/errors.h"

namespace oblique::solver {
namespace {

/// Largest group: the first case and those that branch off.
constexpr std::size_t kLargestGroup = 16;
/// A span shorter than this fraction of a step, as beside an event, gives no mean of a reaction
/// that rounding leaves alone.
constexpr double kShortestSpan = 1e-3;

}  // namespace

LaneBatch::LaneBatch(const Chain& shape, const LaneKernel& kernel)
    : tip_row_(shape.tables().tip_row),
      stepper_(shape.tables(), kernel),
      lanes_(kernel.lanes),
      accept_(kernel.lanes, 0),
      column_(shape.at_rest()) {}

void LaneBatch::solve(const Source& source, const Sink& sink, const Tracing& tracing) {
  is_exhausted_ = false;
  for (;;) {
    std::size_t busy = 0;
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      if (!lanes_[lane].progress) {
        fill(lane, source, tracing);
      }
      busy += lanes_[lane].progress ? 1U : 0U;
    }
    if (busy == 0) {
      return;
    }
    stepper_.step();
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      accept_[lane] = lanes_[lane].progress && advance(lane, sink) ? 1 : 0;
    }
    stepper_.settle(accept_);
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      Lane& slot = lanes_[lane];
      if (!slot.progress) {
        continue;
      }
      if (accept_[lane] != 0 && slot.tracer) {
        slot.tracer->accepted(slot.progress->contact, stored(lane));
      }
      if (!slot.followers.empty() && slot.progress->contact.is_at_first_turn()) {
        branch_off(lane);
      }
      if (slot.progress->contact.finished()) {
        finish(lane, busy, sink);
      }
    }
  }
}

void LaneBatch::fill(std::size_t lane, const Source& source, const Tracing& tracing) {
  if (!branches_.empty()) {
    const Branch branch = std::move(branches_.front());
    branches_.pop_front();
    const ContactCase& next = branch.contact_case;
    const Progress& trunk = *branch.progress;
    start(lane, next, *branch.state,
          {trunk.contact.branched(next.parameters.e_star, next.steps), trunk.touch, trunk.in,
           trunk.reactions});
    return;
  }
  const auto next = upcoming_ || is_exhausted_ ? std::exchange(upcoming_, std::nullopt) : source();
  if (!next) {
    is_exhausted_ = true;
    return;
  }
  const ChainState& touch = *next->touch;
  const ExplicitMotion motion(*next->chain);
  const TipState tip = motion.tip(touch);
  start(lane, *next, touch,
        {Contact(next->parameters, tip, next->steps), tip, motion.energies(touch),
         ReactionPeaks(next->chain->links())});
  Lane& slot = lanes_[lane];
  if (tracing.sink) {
    slot.tracer.emplace(*slot.motion, tracing, tip);
    slot.tracer->accepted(slot.progress->contact, touch);
  } else {
    take_followers(slot, source);
  }
}

void LaneBatch::start(std::size_t lane, const ContactCase& next, const ChainState& state,
                      Progress progress) {
  Lane& slot = lanes_[lane];
  slot.contact_case = next;
  slot.motion.emplace(*next.chain);
  slot.tracer.reset();
  slot.started = Clock::now();
  stepper_.load(lane, next.chain->tables(), state.q.data(), state.v.data());
  stepper_.set_step(lane, progress.contact.trial_step_s());
  stepper_.set_force(lane, progress.contact.force());
  slot.progress = std::move(progress);
}

/// The state at touch of the case just started is in its lane by now: the source may move on.
void LaneBatch::take_followers(Lane& slot, const Source& source) {
  while (slot.followers.size() + 1 < kLargestGroup) {
    upcoming_ = source();
    if (!upcoming_ || upcoming_->group != slot.contact_case.group) {
      is_exhausted_ = !upcoming_;
      return;
    }
    slot.followers.push_back(*upcoming_);
    upcoming_.reset();
  }
}

void LaneBatch::branch_off(std::size_t lane) {
  Lane& slot = lanes_[lane];
  const auto progress = std::make_shared<const Progress>(*slot.progress);
  const auto state = std::make_shared<const ChainState>(stored(lane));
  for (const ContactCase& follower : slot.followers) {
    branches_.push_back({progress, state, follower});
  }
  slot.followers.clear();
}

bool LaneBatch::advance(std::size_t lane, const Sink& sink) {
  Lane& slot = lanes_[lane];
  Contact& contact = slot.progress->contact;
  const int events = contact.events();
  const double h_s = contact.trial_step_s();
  bool is_accepted = false;
  try {
    is_accepted = contact.judge(stepper_.trial_tip(lane, tip_row_), stepper_.integrals(lane));
  } catch (const SolveError& error) {
    slot.progress.reset();
    stepper_.idle(lane);  // from here on the caller may drop its chain
    sink({slot.contact_case.tag, std::nullopt, error.what()});
    for (const ContactCase& follower : slot.followers) {
      sink({follower.tag, std::nullopt, error.what()});  // it would come the same way
    }
    slot.followers.clear();
    return false;
  }
  if (is_accepted && h_s >= kShortestSpan * slot.contact_case.steps.compression_s) {
    slot.progress->reactions.add(contact.time_s(), h_s, stepper_.mean_reactions_squared_N2() + lane,
                                 lanes_.size());
  }
  stepper_.set_step(lane, contact.trial_step_s());
  if (contact.events() != events) {
    stepper_.set_force(lane, contact.force());
  }
  return is_accepted;
}

void LaneBatch::finish(std::size_t lane, std::size_t busy, const Sink& sink) {
  Lane& slot = lanes_[lane];
  const Contact& contact = slot.progress->contact;
  ContactOutcome outcome{slot.contact_case.tag, std::nullopt, {}};
  try {
    CaseResult result = contact_result(contact, slot.contact_case.parameters, slot.progress->touch,
                                       slot.progress->in, slot.motion->energies(stored(lane)));
    result.reaction_peaks = reaction_peaks(lane);
    result.solver.dt_s = slot.contact_case.steps.compression_s;
    result.solver.steps = contact.steps();
    // The lanes share the time.
    const std::chrono::duration<double> elapsed = Clock::now() - slot.started;
    result.solver.wall_s = elapsed.count() / static_cast<double>(busy);
    outcome.result = std::move(result);
  } catch (const SolveError& error) {
    outcome.error = error.what();
  }
  slot.progress.reset();
  stepper_.idle(lane);  // from here on the caller may drop its chain
  sink(std::move(outcome));
}

/// Of a contact that has just ended.
std::vector<ReactionPeak> LaneBatch::reaction_peaks(std::size_t lane) {
  Progress& progress = *lanes_[lane].progress;
  if (progress.reactions.rises_at_end()) {
    Eigen::Matrix2Xd reactions_N;
    lanes_[lane].motion->reactions(progress.contact.force(), stored(lane), reactions_N);
    const Eigen::RowVectorXd squared_N2 = reactions_N.colwise().squaredNorm();
    progress.reactions.add(progress.contact.time_s(), 0.0, squared_N2.data());
  }
  return progress.reactions.peaks();
}

const ChainState& LaneBatch::stored(std::size_t lane) {
  stepper_.store(lane, column_.q.data(), column_.v.data());
  return column_;
}

}  // namespace oblique::solver
