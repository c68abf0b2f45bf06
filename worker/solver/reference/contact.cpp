#include "worker/solver/reference/contact.h"

#include <cmath>
#include <string>

#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::solver {
namespace {

/// An event is located when the next correction of its time is smaller than this [s].
constexpr double kLocated_s = 1e-13;

constexpr unsigned bit(ContactEvent event) {
  return 1U << static_cast<unsigned>(event);
}

double sign_of(double value) {
  return value < 0.0 ? -1.0 : 1.0;
}

}  // namespace

Contact::Contact(const ContactParameters& parameters, const TipState& touch,
                 const ContactSteps& steps)
    : law_(parameters, touch),
      steps_s_(steps),
      tip_(touch),
      vt_sign_(sign_of(touch.vx_m_s)),
      trial_s_(steps.compression_s),
      // At touch both forces are zero, and so are both limits of the friction cone.
      fresh_(bit(ContactEvent::kSlipForward) | bit(ContactEvent::kSlipBackward)),
      record_(law_, touch),
      margin_(law_, touch) {}

std::optional<EventGuess> Contact::earliest_event(const TipState& end, double h_s) const {
  std::optional<EventGuess> earliest;
  if (is_far_from_events(law_, tip_, end, h_s, vt_sign_)) {
    return earliest;
  }
  for (const ContactEvent event : kContactEvents) {
    if (!is_possible(law_, event)) {
      continue;
    }
    const auto guess =
        guess_event(law_, event, tip_, end, h_s, vt_sign_, (fresh_ & bit(event)) != 0);
    if (!guess || (guess->inside_only && (refuted_ & bit(event)) != 0)) {
      continue;
    }
    if (!earliest || guess->fraction * h_s < earliest->fraction * h_s - kSimultaneous_s) {
      earliest = guess;
    }
  }
  return earliest;
}

bool Contact::judge(const TipState& end, const ContactIntegrals<double>& integrals) {
  if (!std::isfinite(end.x_m + end.y_m + end.vx_m_s + end.vy_m_s)) {
    throw SolveError("the contact diverged after " + readable_number(t_s_) +
                     " s with dt = " + readable_number(full_step_s()) + " s");
  }
  if (search_.seeking == Seeking::kPeak) {
    const bool has_crossed = event_function(law_, search_.event, end, vt_sign_).value >= 0.0;
    search_.seeking = has_crossed ? Seeking::kCrossing : Seeking::kNothing;
    trial_s_ = has_crossed ? search_.guess_s : search_.full_s;
    refuted_ |= has_crossed ? 0U : bit(search_.event);
    return false;
  }
  if (search_.seeking == Seeking::kCrossing) {
    return judge_crossing(end, integrals);
  }
  if (const auto guess = earliest_event(end, trial_s_)) {
    start_search(*guess, trial_s_);
    return false;
  }
  accept(end, integrals);
  return true;
}

void Contact::start_search(const EventGuess& guess, double h_s) {
  search_ = Search{};
  search_.seeking = guess.inside_only ? Seeking::kPeak : Seeking::kCrossing;
  search_.event = guess.event;
  search_.slope = guess.slope / h_s;
  search_.full_s = h_s;
  search_.guess_s = guess.fraction * h_s;
  search_.high_s = guess.inside_only ? guess.peak_fraction * h_s : h_s;
  trial_s_ = guess.inside_only ? search_.high_s : search_.guess_s;
}

bool Contact::judge_crossing(const TipState& end, const ContactIntegrals<double>& integrals) {
  const double t = trial_s_;
  // In a shorter step rounding errors dominate, and the search would find the last event again.
  if (t > kSimultaneous_s) {
    const auto first = earliest_event(end, t);
    if (first && first->event != search_.event &&
        (first->fraction * t < t - kSimultaneous_s || first->event < search_.event)) {
      start_search(*first, t);
      return false;
    }
  }
  const EventFunction function = event_function(law_, search_.event, end, vt_sign_);
  (function.value < 0.0 ? search_.low_s : search_.high_s) = t;
  if (is_force_event(search_.event)) {
    search_.slope = function.rate;
  } else if (search_.last_s >= 0.0 && t != search_.last_s) {
    search_.slope = (function.value - search_.last_value) / (t - search_.last_s);
  }
  search_.last_s = t;
  search_.last_value = function.value;
  const double correction_s = -function.value / search_.slope;
  const bool is_located = std::abs(correction_s) <= kLocated_s;
  const bool is_cornered = search_.high_s - search_.low_s <= kLocated_s;
  if (is_located || is_cornered) {
    const ContactEvent event = search_.event;
    accept(end, integrals);
    happen(event);
    return true;
  }
  const double next = t + correction_s;
  trial_s_ =
      next > search_.low_s && next < search_.high_s ? next : 0.5 * (search_.low_s + search_.high_s);
  return false;
}

Contact Contact::branched(double e_star, const ContactSteps& steps) const {
  Contact branch = *this;
  branch.law_.set_restitution(e_star);
  branch.steps_s_ = steps;
  branch.trial_s_ = branch.full_step_s();
  return branch;
}

double Contact::full_step_s() const {
  return law_.is_compression() ? steps_s_.compression_s : steps_s_.restitution_s;
}

void Contact::accept(const TipState& end, const ContactIntegrals<double>& integrals) {
  record_.add_step(law_, tip_, end, integrals);
  margin_.add_step(law_, tip_, end, trial_s_);
  tip_ = end;
  t_s_ += trial_s_;
  ++steps_;
  if (trial_s_ > 0.0) {
    fresh_ = 0;
  }
  refuted_ = 0;
  search_.seeking = Seeking::kNothing;
  trial_s_ = full_step_s();
  if (t_s_ > kLongest_s) {
    throw SolveError("the contact did not end within " + exact_number(kLongest_s) + " s");
  }
  if (steps_ > kMaxSteps) {
    throw SolveError("the contact takes more than " + std::to_string(kMaxSteps) + " steps of " +
                     readable_number(full_step_s()) +
                     " s: a longer dt, a looser tolerance or a larger k takes fewer");
  }
}

void Contact::happen(ContactEvent event) {
  ++events_;
  margin_.add_event(law_, event, tip_);
  const double ft = law_.ft_N(tip_);
  const double ft_rate_before = sign_of(ft) * law_.ft_rate_N_s(tip_);
  switch (event) {
    case ContactEvent::kSeparation:
      record_.finish(law_, tip_, t_s_);
      finished_ = true;
      return;
    case ContactEvent::kTurn:
      if (!law_.is_stick() && law_.is_compression() && law_.mu() > 0.0) {
        record_.add_tangential_peak(ft, t_s_);
      }
      record_.add_turn(law_, tip_, t_s_);
      law_.turn(tip_);
      fresh_ |= bit(ContactEvent::kTurn);
      break;
    case ContactEvent::kSlipForward:
    case ContactEvent::kSlipBackward:
      law_.start_slip(tip_, event == ContactEvent::kSlipForward ? 1.0 : -1.0);
      if (ft_rate_before > 0.0 && sign_of(ft) * law_.ft_rate_N_s(tip_) < 0.0) {
        record_.add_tangential_peak(ft, t_s_);
      }
      fresh_ |= bit(ContactEvent::kStick);
      break;
    case ContactEvent::kStick:
      fresh_ |= bit(ContactEvent::kStick) |
                bit(law_.slip_direction() > 0.0 ? ContactEvent::kSlipForward
                                                : ContactEvent::kSlipBackward);
      law_.stop_slip(tip_);
      vt_sign_ = sign_of(tip_.vx_m_s);
      break;
    case ContactEvent::kTangentialExtremum:
      if (-vt_sign_ * ft > 0.0) {
        record_.add_tangential_peak(ft, t_s_);
      }
      vt_sign_ = -vt_sign_;
      fresh_ |= bit(ContactEvent::kTangentialExtremum);
      return;
  }
  trial_s_ = full_step_s();
  record_.add_state(law_, tip_, t_s_);
}

}  // namespace oblique::solver
