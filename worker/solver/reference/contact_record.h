#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "worker/solver/model/case_result.h"
#include "worker/solver/reference/contact_events.h"
#include "worker/solver/reference/contact_law.h"

namespace oblique::solver {

/// Gathers what a contact gives, from accepted steps and events.
class ContactRecord {
 public:
  ContactRecord(const ContactLaw& law, const TipState& touch);

  /// An accepted step from `start` to `end` in one regime.
  void add_step(const ContactLaw& law, const TipState& start, const TipState& end,
                const ContactIntegrals<double>& integrals);
  /// A turn at t_s; `before` is the law that held up to it.
  void add_turn(const ContactLaw& before, const TipState& tip, double t_s);
  /// A local maximum of |F_t|.
  void add_tangential_peak(double ft_N, double t_s);
  /// The regime from t_s on. A regime that lasted no time leaves no trace.
  void add_state(const ContactLaw& law, const TipState& tip, double t_s);
  /// Separation: closes phases, stick, slide and peaks.
  void finish(const ContactLaw& law, const TipState& tip, double t_s);

  /// Fills the parts of `result` that the contact determines. Needs finish().
  void write_to(CaseResult& result) const;
  bool turned_once_at(double t_s) const { return turns_.size() == 1 && turns_[0].t_s == t_s; }
  double work_n_J() const { return work_n_J_; }
  double work_t_J() const { return work_t_J_; }

 private:
  struct Turn {
    double t_s;
    double fn_N;
    double ft_span_N;  ///< largest |F_t| since the valley before (peaks only)
  };
  struct State {
    bool stick;
    bool compression;
    double t0_s;
  };
  void close_slide(const ContactLaw& law, const TipState& tip);
  std::string mode(const std::vector<bool>& survives) const;

  std::vector<Turn> turns_;  ///< peak, valley, peak, ..., peak
  std::vector<State> states_;
  std::vector<TangentialPeak> ft_peaks_;
  double ft_span_N_ = 0.0;
  double ft_largest_N_ = 0.0;
  double xP_m_;  ///< P at the start of the present regime
  double slide_m_ = 0.0;
  double impulse_n_Ns_ = 0.0;
  double impulse_t_Ns_ = 0.0;
  double work_n_J_ = 0.0;  ///< done on the finger
  double work_t_J_ = 0.0;
  double exchanged_J_ = 0.0;
  double duration_s_ = 0.0;
};

/// Which of the turns peak, valley, ..., peak (forces in fn_N) stay when ripples are merged. A
/// ripple is a peak and a neighbouring valley less than 5 % of the largest peak apart; the
/// shallowest goes first, so that what stays does not depend on the order of looking.
std::vector<bool> without_ripples(const std::vector<double>& fn_N);

/// Watches how near a contact comes to another order of events: its margin (theory.md). Distances
/// of forces and of speeds are kept apart, and made dimensionless at the end.
class ContactMargin {
 public:
  struct Nearest {
    double distance;  ///< from 0 to 1
    /// What came near to happening, or to not happening: "touch", "separation", "turn", "slip" or
    /// "stick".
    std::string_view event;
  };

  ContactMargin(const ContactLaw& law, const TipState& touch);

  /// An accepted step in one regime.
  void add_step(const ContactLaw& law, const TipState& start, const TipState& end, double h_s);
  /// An event at the end of the last step; `before` is the law that held up to it.
  void add_event(const ContactLaw& before, ContactEvent event, const TipState& tip);

  /// The nearest of all so far; `largest_fn_N` is what forces are compared with.
  Nearest nearest(double largest_fn_N) const;

 private:
  /// The least distance of one kind.
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
  struct Step {
    const ContactLaw& law;
    const TipState& start;
    const TipState& end;
    double h_s;
  };
  /// A function of velocities that is below zero and may come near to it.
  struct Approach {
    bool is_near = true;   ///< at the end of the last step
    bool rises = false;    ///< there
    double deepest = 0.0;  ///< where it was farthest below
  };
  struct Course;

  void add_speed(double distance_m_s, std::string_view event);
  void follow(Approach& approach, const Course& course, std::string_view event);
  void follow_turn(const Step& step);
  void follow_stick(const Step& step);
  void follow_cone(const Step& step);

  // What nearly every step looks at, and no more of it.
  double near_m_s_;  ///< functions of velocities below this are too far off to matter
  Approach turn_;
  Approach stick_;  ///< in slip
  // In stick, as P would move if it slid on.
  double beyond_m_s_ = 0.0;     ///< how fast it went back at most
  bool nears_forward_ = false;  ///< F_t nears the side of the cone from which P slides forwards
  bool nears_backward_ = false;
  double last_vn_m_s_ = 0.0;  ///< at the start of the last step
  double last_step_s_ = 1.0;

  double touch_speed_m_s_;
  Least speed_m_s_;
  Least force_N_;
  bool has_turned_ = false;
  bool stick_follows_slip_ = false;  ///< the present stick did not begin at touch
  bool slip_follows_stick_ = false;
  double slip_began_m_ = 0.0;  ///< position of P
};

inline void ContactMargin::add_step(const ContactLaw& law, const TipState& start,
                                    const TipState& end, double h_s) {
  // Over a shorter time the mean of a velocity is rounding.
  constexpr double kShortest_s = 1e-9;
  if (h_s < kShortest_s) {
    return;
  }
  last_vn_m_s_ = start.vy_m_s;
  last_step_s_ = h_s;
  const double turn_m_s = law.is_compression() ? end.vy_m_s : -end.vy_m_s;
  if (turn_m_s > near_m_s_ || turn_.is_near) [[unlikely]] {
    follow_turn({law, start, end, h_s});
  }
  if (law.is_stick()) [[unlikely]] {
    const double common_m_s = law.slip_coupling() * end.vy_m_s;
    const bool nears_forward = common_m_s + end.vx_m_s > 0.0;
    const bool nears_backward = common_m_s - end.vx_m_s > 0.0;
    if (beyond_m_s_ < -near_m_s_ || nears_forward < nears_forward_ ||
        nears_backward < nears_backward_) {
      follow_cone({law, start, end, h_s});
    }
    nears_forward_ = nears_forward;
    nears_backward_ = nears_backward;
    return;
  }
  const double stick_m_s = -law.slip_direction() * law.slip_velocity_m_s(end);
  if (stick_m_s > near_m_s_ || stick_.is_near) [[unlikely]] {
    follow_stick({law, start, end, h_s});
  }
}

/// The largest magnitude of each reaction over a contact, from values at instants or from means
/// over spans of time: by a parabola through the three around the largest one seen. A mean over a
/// span w lies w^2 f''/24 beside the value at its middle, which is put right.
class ReactionPeaks {
 public:
  explicit ReactionPeaks(std::size_t reactions) : reactions_(reactions) {}

  /// The next span: its end, its length (0 for an instant), and the squared magnitudes of the means
  /// over it, `stride` numbers apart. Spans come in order; one of no time since the last (the other
  /// side of an event) is passed over.
  void add(double end_s, double width_s, const double* squared_N2, std::size_t stride = 1) {
    const Span next{end_s - 0.5 * width_s, width_s};
    if (has_last_ && !(next.middle_s > last_.middle_s)) {
      return;
    }
    has_last_ = true;
    for (Reaction& reaction : reactions_) {
      const double next_N2 = *squared_N2;
      squared_N2 += stride;
      const bool is_maximum = reaction.last_N2 > reaction.worth_a_look_N2 &&
                              reaction.last_N2 >= reaction.before_N2 && reaction.last_N2 >= next_N2;
      if (is_maximum || reaction.before_N2 < 0.0) [[unlikely]] {
        look(reaction, next, next_N2);
      }
      reaction.before_N2 = reaction.last_N2;
      reaction.last_N2 = next_N2;
    }
    before_ = last_;
    last_ = next;
  }

  /// Over all that was added. One that rises up to its last span is taken on to the end by a
  /// straight line; adding the value at that instant does better where rises_at_end() says so.
  std::vector<ReactionPeak> peaks() const;
  bool rises_at_end() const;

 private:
  struct Span {
    double middle_s = 0.0;
    double width_s = 0.0;
  };
  struct Reaction {
    double last_N2 = -1.0;  ///< below 0: none yet
    double before_N2 = -1.0;
    double worth_a_look_N2 = 0.0;  ///< a lower maximum is not the largest
    ReactionPeak largest{0.0, 0.0};
  };
  void look(Reaction& reaction, const Span& next, double next_N2) const;

  std::vector<Reaction> reactions_;
  bool has_last_ = false;
  Span before_;  ///< of the values before_N2, as the next of last_N2
  Span last_;
};

}  // namespace oblique::solver
