#include "worker/solver/lane_batch.h"

#include <utility>

#include "worker/solver/errors.h"

namespace oblique::solver {

LaneBatch::LaneBatch(const Chain& chain, const LaneKernel& kernel)
    : chain_(chain),
      motion_(chain),
      stepper_(chain.tables(), kernel),
      lanes_(kernel.lanes),
      accept_(kernel.lanes, 0),
      column_(chain.at_rest()) {}

void LaneBatch::solve(const Source& source, const Sink& sink, const Finger::Extras& extras) {
  std::size_t busy = 0;
  for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
    fill(lane, source, extras);
    busy += lanes_[lane].contact ? 1U : 0U;
  }
  while (busy > 0) {
    stepper_.step();
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      accept_[lane] = lanes_[lane].contact && advance(lane, sink) ? 1 : 0;
    }
    stepper_.settle(accept_);
    for (std::size_t lane = 0; lane < lanes_.size(); ++lane) {
      Lane& slot = lanes_[lane];
      if (!slot.contact) {
        continue;
      }
      if (accept_[lane] != 0 && slot.observer) {
        slot.observer->accepted(*slot.contact, stored(lane));
      }
      if (slot.contact->finished()) {
        finish(lane, busy, sink);
      }
      if (slot.contact->finished() || slot.failed) {
        fill(lane, source, extras);
        busy -= slot.contact ? 0U : 1U;
      }
    }
  }
}

void LaneBatch::fill(std::size_t lane, const Source& source, const Finger::Extras& extras) {
  Lane& slot = lanes_[lane];
  slot.observer.reset();
  slot.contact.reset();
  slot.failed = false;
  const auto next = source();
  if (!next) {
    stepper_.set_step(lane, 0.0);  // idle lanes stand still
    return;
  }
  slot.contact_case = *next;
  slot.started = std::chrono::steady_clock::now();
  const ChainState& touch = *next->touch;
  stepper_.load(lane, touch.q.data(), touch.v.data());
  slot.touch = chain_.tip(touch);
  slot.in = motion_.energies(touch);
  slot.contact.emplace(next->parameters, slot.touch, next->steps);
  stepper_.set_step(lane, slot.contact->trial_step_s());
  stepper_.set_force(lane, slot.contact->force());
  if (ContactObserver::is_needed(extras)) {
    slot.observer.emplace(motion_, extras, slot.touch);
    slot.observer->accepted(*slot.contact, touch);
  }
}

bool LaneBatch::advance(std::size_t lane, const Sink& sink) {
  Lane& slot = lanes_[lane];
  const std::size_t tip = 2 * chain_.tip_row();
  const TipState end{stepper_.trial_q(lane, tip), stepper_.trial_q(lane, tip + 1),
                     stepper_.trial_v(lane, tip), stepper_.trial_v(lane, tip + 1)};
  const int events = slot.contact->events();
  bool is_accepted = false;
  try {
    is_accepted = slot.contact->judge(end, stepper_.integrals(lane));
  } catch (const SolveError& error) {
    slot.failed = true;
    sink({slot.contact_case.tag, std::nullopt, error.what()});
    return false;
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
                                       slot.in, motion_.energies(stored(lane)));
    if (slot.observer) {
      result.reaction_peaks = slot.observer->reaction_peaks();
    }
    result.solver.dt_s = slot.contact_case.steps.compression_s;
    result.solver.steps = slot.contact->steps();
    // The lanes share the time.
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - slot.started;
    result.solver.wall_s = elapsed.count() / static_cast<double>(busy);
    outcome.result = std::move(result);
  } catch (const SolveError& error) {
    outcome.error = error.what();
  }
  sink(std::move(outcome));
}

const ChainState& LaneBatch::stored(std::size_t lane) {
  stepper_.store(lane, column_.q.data(), column_.v.data());
  return column_;
}

}  // namespace oblique::solver
