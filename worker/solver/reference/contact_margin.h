#pragma once

#include <algorithm>
#include <limits>
#include <string_view>

#include "worker/solver/reference/contact_events.h"
#include "worker/solver/reference/contact_law.h"

namespace oblique::solver {

/// Watches how near a contact comes to another order of events: what README.md of this folder calls
/// its margin. Distances of forces and of speeds are kept apart, and made dimensionless at the end.
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
  /// A function of velocities over a step, as the quadratic by which its events are guessed.
  struct Course {
    double first;
    double last;
    double rise0;  ///< rate at the start, times the square of the step
    double rise1;  ///< at the end
    double step_s;

    Course(double first_m_s, double last_m_s, double path_m, double h_s)
        : first(first_m_s),
          last(last_m_s),
          rise0(6.0 * path_m - h_s * (4.0 * first + 2.0 * last)),
          rise1(h_s * (2.0 * first + 4.0 * last) - 6.0 * path_m),
          step_s(h_s) {}
    /// P's velocity if it slid in that direction.
    static Course of_sliding(const ContactLaw& law, double direction, const TipState& start,
                             const TipState& end, double h_s);
    Course negative() const {
      Course other = *this;
      other.first = -first;
      other.last = -last;
      other.rise0 = -rise0;
      other.rise1 = -rise1;
      return other;
    }
    /// Of one that is positive at the start and not at the end: its integral up to the zero.
    double path_while_positive_m() const;
    bool has_extremum() const { return rise0 * rise1 < 0.0; }
    double extremum() const { return first + rise0 * rise0 / (2.0 * step_s * (rise0 - rise1)); }
    double highest() const {
      const double end = std::max(first, last);
      return has_extremum() ? std::max(end, extremum()) : end;
    }
  };
  /// A function of velocities that is below zero and may come near to it.
  struct Approach {
    bool is_near = true;   ///< at the end of the last step
    bool rises = false;    ///< there
    double deepest = 0.0;  ///< where it was farthest below
  };

  void add_speed(double distance_m_s, std::string_view event);
  void follow(Approach& approach, const Course& course, std::string_view event);
  void follow_turn(const ContactLaw& law, const TipState& start, const TipState& end, double h_s);
  void follow_stick(const ContactLaw& law, const TipState& start, const TipState& end, double h_s);
  void follow_cone(const ContactLaw& law, const TipState& start, const TipState& end, double h_s);
  void add_turn(const ContactLaw& before, const TipState& tip);
  void add_slip(const ContactLaw& before, double direction, const TipState& tip);
  void add_stick(const ContactLaw& before, const TipState& tip);
  void add_separation(const ContactLaw& before, const TipState& tip);

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
    follow_turn(law, start, end, h_s);
  }
  if (law.is_stick()) [[unlikely]] {
    const double common_m_s = law.slip_coupling() * end.vy_m_s;
    const bool nears_forward = common_m_s + end.vx_m_s > 0.0;
    const bool nears_backward = common_m_s - end.vx_m_s > 0.0;
    if (beyond_m_s_ < -near_m_s_ || nears_forward < nears_forward_ ||
        nears_backward < nears_backward_) {
      follow_cone(law, start, end, h_s);
    }
    nears_forward_ = nears_forward;
    nears_backward_ = nears_backward;
    return;
  }
  const double stick_m_s = -law.slip_direction() * law.slip_velocity_m_s(end);
  if (stick_m_s > near_m_s_ || stick_.is_near) [[unlikely]] {
    follow_stick(law, start, end, h_s);
  }
}

}  // namespace oblique::solver
