#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "worker/solver/model/case_result.h"
#include "worker/solver/reference/contact_events.h"
#include "worker/solver/reference/contact_law.h"

namespace oblique::solver {

/// Collects the outputs of a contact from accepted steps and events.
class ContactRecord {
 public:
  ContactRecord(const ContactLaw& law, const TipState& touch);

  /// An accepted step from `start` to `end` in one regime.
  void add_step(const ContactLaw& law, const TipState& start, const TipState& end,
                const ContactIntegrals<double>& integrals);
  /// A turn between compression and restitution at t_s. `before` is the law before the turn.
  void add_turn(const ContactLaw& before, const TipState& tip, double t_s);
  /// A local maximum of |F_t|.
  void add_tangential_peak(double ft_N, double t_s) {
    result_.ft_peaks.push_back({t_s, std::abs(ft_N)});
  }
  /// The regime of `law` begins at t_s.
  void add_state(const ContactLaw& law, const TipState& tip, double t_s);
  /// Separation.
  void finish(const ContactLaw& law, const TipState& tip, double t_s);

  /// The outputs that the contact determines; others are zero. Requires finish().
  CaseResult result() const;
  bool turned_once_at(double t_s) const { return turns_.size() == 1 && turns_[0].t_s == t_s; }
  double work_n_J() const { return work_n_J_; }
  double work_t_J() const { return work_t_J_; }

 private:
  struct Turn {
    double t_s;
    double fn_N;
    double ft_span_N;  ///< largest |F_t| between the valleys on either side of a peak
  };
  struct State {
    bool stick;
    bool compression;
    double t0_s;
  };
  void close_state(const ContactLaw& law, const TipState& tip, double t_s);
  std::string mode(const std::vector<bool>& survives) const;

  CaseResult result_{};
  std::vector<Turn> turns_;  ///< peak, valley, peak, ..., peak
  std::vector<State> states_;
  double ft_span_N_ = 0.0;
  double xP_m_;            ///< P at the start of the present regime
  double work_n_J_ = 0.0;  ///< work done on the finger by F_n
  double work_t_J_ = 0.0;
};

/// Selects the extrema of F_n (fn_N: peak, valley, ..., peak) that remain when ripples are merged.
/// A ripple is a peak and a neighbouring valley whose forces differ by less than 5 % of the largest
/// peak. The ripple with the smallest difference is merged first.
std::vector<bool> without_ripples(const std::vector<double>& fn_N);

/// The margin of a contact: its smallest distance from a change in the order of events (theory.md).
class ContactMargin {
 public:
  struct Nearest {
    double distance;         ///< from 0 to 1
    std::string_view event;  ///< "touch", "separation", "turn", "slip" or "stick"
  };

  ContactMargin(const ContactLaw& law, const TipState& touch);

  /// An accepted step in one regime.
  void add_step(const ContactLaw& law, const TipState& start, const TipState& end, double h_s);
  /// An event at the end of the last step. `before` is the law before the event.
  void add_event(const ContactLaw& before, ContactEvent event, const TipState& tip);

  /// The smallest distance so far, with forces relative to `largest_fn_N`.
  Nearest nearest(double largest_fn_N) const;

 private:
  struct Least {
    double distance = std::numeric_limits<double>::infinity();
    std::string_view event = "separation";

    void add(double other, std::string_view its_event) {
      if (other < distance) {
        distance = other > 0.0 ? other : 0.0;
        event = its_event;
      }
    }
  };
  /// A function of velocities over a step: the quadratic with these end values and integral.
  struct Course {
    double first_m_s;
    double last_m_s;
    double path_m;
    double h_s;

    /// Rates of change at the start and the end of the step, times h_s^2.
    double rise0() const { return 6.0 * path_m - h_s * (4.0 * first_m_s + 2.0 * last_m_s); }
    double rise1() const { return h_s * (2.0 * first_m_s + 4.0 * last_m_s) - 6.0 * path_m; }
    bool has_extremum() const { return rise0() * rise1() < 0.0; }
    double extremum_m_s() const {
      return first_m_s + rise0() * rise0() / (2.0 * h_s * (rise0() - rise1()));
    }
    double path_while_positive_m() const;
  };
  /// A function of velocities that is negative in a regime and zero at the event that ends it.
  struct Approach {
    bool is_near = true;   ///< at the end of the last step
    bool rises = false;    ///< at the end of the last step
    double deepest = 0.0;  ///< minimum of the function
  };

  void add_speed(double distance_m_s, std::string_view event);
  void follow(Approach& approach, const Course& course, std::string_view event);
  void follow_cone(const ContactLaw& law, const TipState& start, const TipState& end, double h_s);

  double touch_speed_m_s_;
  Least speed_m_s_;
  Least force_N_;
  double near_m_s_;  ///< a function of velocities below this cannot reduce speed_m_s_
  Approach turn_;
  Approach stick_;            ///< in slip
  double last_vn_m_s_ = 0.0;  ///< at the start of the last step
  double last_step_s_ = 1.0;
  bool has_turned_ = false;
  bool stick_follows_slip_ = false;     ///< false if the present stick began at touch
  double back_m_s_ = 0.0;               ///< largest speed during stick at which P would slide back
  double left_side_ = 0.0;              ///< direction of a slip that ended with the last step, or 0
  std::optional<double> slip_began_m_;  ///< position of P when the last slip began
};

inline void ContactMargin::add_step(const ContactLaw& law, const TipState& start,
                                    const TipState& end, double h_s) {
  // In a shorter step the mean of a velocity is mostly rounding error.
  constexpr double kShortest_s = 1e-9;
  if (h_s < kShortest_s) {
    return;
  }
  last_vn_m_s_ = start.vy_m_s;
  last_step_s_ = h_s;
  const auto follow_event = [&](ContactEvent event, Approach& approach, std::string_view name) {
    const auto phi = [&](const TipState& tip) {
      return event_function(law, event, tip, 0.0).value;
    };
    if (phi(end) > near_m_s_ || approach.is_near) [[unlikely]] {
      follow(approach, {phi(start), phi(end), phi(displacement(start, end)), h_s}, name);
    }
  };
  follow_event(ContactEvent::kTurn, turn_, "turn");
  if (law.is_stick()) [[unlikely]] {
    follow_cone(law, start, end, h_s);
  } else if (law.mu() > 0.0) {
    follow_event(ContactEvent::kStick, stick_, "stick");
  }
}

/// Finds the largest magnitude of each reaction in a contact by the parabola through three
/// neighbouring values. Values are instantaneous, or means over spans w, corrected by w^2 f''/24.
class ReactionPeaks {
 public:
  explicit ReactionPeaks(std::size_t reactions) : reactions_(reactions) {}

  /// Adds the next span: its end, its length (0 for an instant), and the squared magnitude of each
  /// reaction's mean. These magnitudes are `stride` numbers apart. A second span at the same time,
  /// after an event, is ignored.
  void add(double end_s, double width_s, const double* squared_N2, std::size_t stride = 1) {
    const Span next{end_s - 0.5 * width_s, width_s};
    if (!(next.middle_s > last_.middle_s)) {
      return;
    }
    for (Reaction& reaction : reactions_) {
      const double next_N2 = *squared_N2;
      squared_N2 += stride;
      const bool is_maximum = reaction.last_N2 > reaction.threshold_N2 &&
                              reaction.last_N2 >= reaction.before_N2 && reaction.last_N2 >= next_N2;
      if (is_maximum || reaction.before_N2 < 0.0) [[unlikely]] {
        add_maximum(reaction, next, next_N2);
      }
      reaction.before_N2 = reaction.last_N2;
      reaction.last_N2 = next_N2;
    }
    before_ = last_;
    last_ = next;
  }

  /// A reaction that rises up to the last span is extrapolated linearly to the end of this span. If
  /// rises_at_end(), add the value at the end first, which is more accurate.
  std::vector<ReactionPeak> peaks() const;
  bool rises_at_end() const;

 private:
  struct Span {
    double middle_s = -std::numeric_limits<double>::infinity();
    double width_s = 0.0;
  };
  struct Reaction {
    double last_N2 = -1.0;  ///< negative before the first value
    double before_N2 = -1.0;
    double threshold_N2 = 0.0;  ///< lower maxima cannot be the largest
    ReactionPeak largest{0.0, 0.0};
  };
  void add_maximum(Reaction& reaction, const Span& next, double next_N2) const;

  std::vector<Reaction> reactions_;
  Span before_;  ///< span of before_N2
  Span last_;    ///< span of last_N2
};

}  // namespace oblique::solver
