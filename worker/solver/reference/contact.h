#pragma once

#include <cstdint>
#include <optional>

#include "worker/solver/reference/contact_events.h"
#include "worker/solver/reference/contact_law.h"
#include "worker/solver/reference/contact_record.h"

namespace oblique::solver {

/// One contact from touch to separation, as a state machine that any integrator drives
/// (solve_contact.cpp). The integrator keeps the state at the last accepted instant, steps a copy
/// of it by trial_step_s() under force(), and makes the copy the accepted state if judge() returns
/// true. A step that passes an event is refused; shorter ones follow until the event is at a step's
/// end.
class Contact {
 public:
  /// Time within which a contact must end [s].
  static constexpr double kLongest_s = 20e-3;
  /// Ten thousand times the steps that a contact takes by default.
  static constexpr std::int64_t kMaxSteps = 5'000'000;

  Contact(const ContactParameters& parameters, const TipState& touch, const ContactSteps& steps);

  bool finished() const { return finished_; }
  double trial_step_s() const { return trial_s_; }
  AffineContactForce<double> force() const { return law_.affine(); }
  const ContactLaw& law() const { return law_; }

  /// True when the step is accepted. Throws SolveError when the tip's state is not finite, or the
  /// contact outlasts kLongest_s or kMaxSteps steps.
  bool judge(const TipState& end, const ContactIntegrals<double>& integrals);

  /// Whether the last accepted step ended at the first turn. Up to there e* has no effect.
  bool is_at_first_turn() const { return record_.turned_once_at(t_s_); }
  /// A copy of this contact that continues with another e* and other steps in restitution. It
  /// equals a contact solved with them from touch. Requires is_at_first_turn().
  Contact branched(double e_star, const ContactSteps& steps) const;

  /// Complete once finished.
  const ContactRecord& record() const { return record_; }
  const ContactMargin& margin() const { return margin_; }
  double time_s() const { return t_s_; }
  std::int64_t steps() const { return steps_; }
  const ContactSteps& step_lengths() const { return steps_s_; }
  /// Number of events so far; when it grows, force() has changed.
  int events() const { return events_; }
  const TipState& tip() const { return tip_; }

 private:
  enum class Seeking { kNothing, kCrossing, kPeak };
  struct Search {
    Seeking seeking = Seeking::kNothing;
    ContactEvent event = ContactEvent::kTurn;
    double low_s = 0.0;    ///< phi is negative here
    double high_s = 0.0;   ///< phi is not negative here
    double slope = 0.0;    ///< d phi / dt near the crossing
    double last_s = -1.0;  ///< the last trial, < 0 before the first
    double last_value = 0.0;
    double full_s = 0.0;   ///< the step in which the event was found
    double guess_s = 0.0;  ///< where the polynomial crosses
  };

  std::optional<EventGuess> earliest_event(const TipState& end, double h_s) const;
  bool judge_crossing(const TipState& end, const ContactIntegrals<double>& integrals);
  void start_search(const EventGuess& guess, double h_s);
  double full_step_s() const;
  void accept(const TipState& end, const ContactIntegrals<double>& integrals);
  void happen(ContactEvent event);

  ContactLaw law_;
  ContactSteps steps_s_;
  double t_s_ = 0.0;
  TipState tip_;
  double vt_sign_;
  bool finished_ = false;
  double trial_s_;
  std::int64_t steps_ = 0;
  int events_ = 0;
  unsigned fresh_ = 0;    ///< bit a ContactEvent
  unsigned refuted_ = 0;  ///< events seen inside the present step that turned out not to happen
  Search search_;
  ContactRecord record_;
  ContactMargin margin_;
};

}  // namespace oblique::solver
