#include "worker/solver/fast/lane_batch.h"

#include <algorithm>
#include <utility>

#include "worker/solver/model/errors.h"

namespace oblique::solver {

LaneBatch::LaneBatch(const Chain& shape, const LaneKernel& kernel)
    : tip_row_(shape.tables().tip_row),
      stepper_(shape.tables(), kernel),
      lanes_(kernel.lanes),
      accept_(kernel.lanes, 0),
      column_(shape.at_rest()) {}

void LaneBatch::solve(const Source& source, const Sink& sink, const Tracing& tracing) {
  for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
    fill(lane, source, tracing);
  }
  for (std::size_t busy = busy_lanes(); busy > 0; busy = busy_lanes()) {
    stepper_.step();
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      accept_[lane] = lanes_[lane].contact && advance(lane, sink) ? 1 : 0;
    }
    stepper_.settle(accept_);
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      Lane& slot = lanes_[lane];
      if (!slot.contact) {
        if (!branches_.empty()) {
          start_branch(lane);
        }
        continue;
      }
      if (accept_[lane] != 0 && slot.tracer) {
        slot.tracer->accepted(*slot.contact, stored(lane));
      }
      if (!slot.followers.empty() && slot.contact->is_at_first_turn()) {
        branch_off(lane);
      }
      if (slot.contact->finished()) {
        finish(lane, busy, sink);
      }
      if (slot.contact->finished() || slot.failed) {
        fill(lane, source, tracing);
      }
    }
  }
}

std::size_t LaneBatch::busy_lanes() const {
  return static_cast<std::size_t>(std::count_if(
      lanes_.begin(), lanes_.end(), [](const Lane& lane) { return lane.contact.has_value(); }));
}

void LaneBatch::fill(std::size_t lane, const Source& source, const Tracing& tracing) {
  Lane& slot = lanes_[lane];
  slot.tracer.reset();
  slot.contact.reset();
  slot.failed = false;
  if (!branches_.empty()) {
    start_branch(lane);
    return;
  }
  const auto next = upcoming_ ? std::exchange(upcoming_, std::nullopt) : source();
  if (!next) {
    stepper_.idle(lane);
    return;
  }
  start(lane, *next);
  if (tracing.sink) {
    slot.tracer.emplace(*slot.motion, tracing, slot.touch);
    slot.tracer->accepted(*slot.contact, *next->touch);
  } else {
    take_followers(slot, source);
  }
}

void LaneBatch::take(std::size_t lane, const ContactCase& next) {
  Lane& slot = lanes_[lane];
  slot.contact_case = next;
  slot.motion.emplace(*next.chain);
  slot.started = Clock::now();
}

void LaneBatch::put_in(std::size_t lane, Contact contact, const ChainState& state) {
  Lane& slot = lanes_[lane];
  stepper_.load(lane, slot.contact_case.chain->tables(), state.q.data(), state.v.data());
  stepper_.set_step(lane, contact.trial_step_s());
  stepper_.set_force(lane, contact.force());
  slot.contact = std::move(contact);
}

void LaneBatch::start(std::size_t lane, const ContactCase& next) {
  take(lane, next);
  Lane& slot = lanes_[lane];
  const ChainState& touch = *next.touch;
  slot.touch = slot.motion->tip(touch);
  slot.in = slot.motion->energies(touch);
  slot.reactions = ReactionPeaks(next.chain->links());
  put_in(lane, Contact(next.parameters, slot.touch, next.steps), touch);
}

/// The state at touch of the case just started is in its lane by now: the source may move on.
void LaneBatch::take_followers(Lane& slot, const Source& source) {
  while (slot.followers.size() + 1 < kLargestGroup) {
    upcoming_ = source();
    if (!upcoming_ || upcoming_->group != slot.contact_case.group) {
      return;
    }
    slot.followers.push_back(*upcoming_);
    upcoming_.reset();
  }
}

void LaneBatch::branch_off(std::size_t lane) {
  Lane& slot = lanes_[lane];
  const auto trunk = std::make_shared<const Trunk>(
      Trunk{*slot.contact, stored(lane), slot.touch, slot.in, slot.reactions});
  for (const ContactCase& follower : slot.followers) {
    branches_.push_back({trunk, follower});
  }
  slot.followers.clear();
}

void LaneBatch::start_branch(std::size_t lane) {
  Lane& slot = lanes_[lane];
  const Branch branch = std::move(branches_.front());
  branches_.pop_front();
  const Trunk& trunk = *branch.trunk;
  take(lane, branch.contact_case);
  slot.touch = trunk.touch;
  slot.in = trunk.in;
  slot.reactions = trunk.reactions;
  put_in(lane,
         trunk.contact.branched(branch.contact_case.parameters.e_star, branch.contact_case.steps),
         trunk.state);
}

bool LaneBatch::advance(std::size_t lane, const Sink& sink) {
  Lane& slot = lanes_[lane];
  const std::size_t tip = 2 * tip_row_;
  const TipState end{stepper_.trial_q(lane, tip), stepper_.trial_q(lane, tip + 1),
                     stepper_.trial_v(lane, tip), stepper_.trial_v(lane, tip + 1)};
  const int events = slot.contact->events();
  const double h_s = slot.contact->trial_step_s();
  bool is_accepted = false;
  try {
    is_accepted = slot.contact->judge(end, stepper_.integrals(lane));
  } catch (const SolveError& error) {
    slot.failed = true;
    stepper_.idle(lane);  // from here on the caller may drop its chain
    sink({slot.contact_case.tag, std::nullopt, error.what()});
    for (const ContactCase& follower : slot.followers) {
      sink({follower.tag, std::nullopt, error.what()});  // it would come the same way
    }
    slot.followers.clear();
    return false;
  }
  if (is_accepted && h_s >= kShortestSpan * slot.contact_case.steps.compression_s) {
    slot.reactions.add(slot.contact->time_s(), h_s, stepper_.mean_reactions_squared_N2() + lane,
                       lanes_.size());
  }
  stepper_.set_step(lane, slot.contact->trial_step_s());
  if (slot.contact->events() != events) {
    stepper_.set_force(lane, slot.contact->force());
  }
  return is_accepted;
}

void LaneBatch::finish(std::size_t lane, std::size_t busy, const Sink& sink) {
  Lane& slot = lanes_[lane];
  ContactOutcome outcome{slot.contact_case.tag, std::nullopt, {}};
  try {
    CaseResult result = contact_result(*slot.contact, slot.contact_case.parameters, slot.touch,
                                       slot.in, slot.motion->energies(stored(lane)));
    result.reaction_peaks = reaction_peaks(lane);
    result.solver.dt_s = slot.contact_case.steps.compression_s;
    result.solver.steps = slot.contact->steps();
    // The lanes share the time.
    const std::chrono::duration<double> elapsed = Clock::now() - slot.started;
    result.solver.wall_s = elapsed.count() / static_cast<double>(busy);
    outcome.result = std::move(result);
  } catch (const SolveError& error) {
    outcome.error = error.what();
  }
  stepper_.idle(lane);  // from here on the caller may drop its chain
  sink(std::move(outcome));
}

/// Of a contact that has just ended.
std::vector<ReactionPeak> LaneBatch::reaction_peaks(std::size_t lane) {
  ReactionPeaks& peaks = lanes_[lane].reactions;
  if (peaks.rises_at_end()) {
    const Contact& contact = *lanes_[lane].contact;
    Eigen::Matrix2Xd reactions_N;
    lanes_[lane].motion->reactions(contact.force(), stored(lane), reactions_N);
    const Eigen::RowVectorXd squared_N2 = reactions_N.colwise().squaredNorm();
    peaks.add(contact.time_s(), 0.0, squared_N2.data());
  }
  return peaks.peaks();
}

const ChainState& LaneBatch::stored(std::size_t lane) {
  stepper_.store(lane, column_.q.data(), column_.v.data());
  return column_;
}

}  // namespace oblique::solver
