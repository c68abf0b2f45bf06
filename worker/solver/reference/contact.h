#pragma once

#include <cstdint>
#include <optional>

#include "worker/solver/reference/contact_events.h"
#include "worker/solver/reference/contact_law.h"
#include "worker/solver/reference/contact_record.h"

namespace oblique::solver {

/// One contact from touch to separation, as a state machine for any integrator (solve_contact.cpp).
/// The integrator steps a copy of its accepted state by trial_step_s() under force(), and accepts
/// the copy if judge() returns true. judge() refuses a step that passes an event, until a shorter
/// step ends at the event.
class Contact {
 public:
  static constexpr double kLongest_s = 20e-3;
  static constexpr std::int64_t kMaxSteps = 5'000'000;  ///< 10,000 times the usual number of steps

  Contact(const ContactParameters& parameters, const TipState& touch, const ContactSteps& steps);

  bool finished() const { return finished_; }
  double trial_step_s() const { return trial_s_; }
  AffineContactForce<double> force() const { return law_.affine(); }
  const ContactLaw& law() const { return law_; }

  /// True when the step is accepted. Throws SolveError when the tip's state is not finite, or the
  /// contact outlasts kLongest_s or kMaxSteps steps.
  bool judge(const TipState& end, const ContactIntegrals<double>& integrals);

  /// Whether the first compression ended with the last accepted step. e* has no effect before that.
  bool is_at_first_turn() const { return record_.turned_once_at(t_s_); }
  /// A copy that continues with another e* and other steps in restitution. It has the same bits as
  /// a contact solved with them from touch. Requires is_at_first_turn().
  Contact branched(double e_star, const ContactSteps& steps) const;

  /// Complete once finished().
  const ContactRecord& record() const { return record_; }
  const ContactMargin& margin() const { return margin_; }
  double time_s() const { return t_s_; }
  std::int64_t steps() const { return steps_; }
  const ContactSteps& step_lengths() const { return steps_s_; }
  /// Number of events so far. force() changes only at events.
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
    double last_s = -1.0;  ///< time of the last trial; negative before the first trial
    double last_value = 0.0;
    double full_s = 0.0;   ///< length of the step that passed the event
    double guess_s = 0.0;  ///< zero of the polynomial
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
  unsigned fresh_ = 0;    ///< events whose function starts at zero; a bit per ContactEvent
  unsigned refuted_ = 0;  ///< events that the polynomial wrongly showed in the present step
  Search search_;
  ContactRecord record_;
  ContactMargin margin_;
};

}  // namespace oblique::solver
