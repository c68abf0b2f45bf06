#include "worker/solver/reference/contact_margin.h"

#include <cmath>

namespace oblique::solver {
namespace {

/// How far |F_t| is from the side of the cone where P would slide in `direction`.
double to_cone_N(const ContactLaw& law, double direction, const TipState& tip) {
  return law.mu() * law.fn_N(tip) + direction * law.ft_N(tip);
}

/// P's velocity in `direction` if it slid in it: |F_t| nears that side of the cone where it is > 0.
double sliding_m_s(const ContactLaw& law, double direction, const TipState& tip) {
  return direction * tip.vx_m_s + law.slip_coupling() * tip.vy_m_s;
}

}  // namespace

ContactMargin::ContactMargin(const ContactLaw& law, const TipState& touch)
    : touch_speed_m_s_(std::hypot(touch.vx_m_s, touch.vy_m_s)) {
  add_speed(touch_speed_m_s_, "separation");
  if (law.mu() > 0.0) {
    add_speed(std::abs(sliding_m_s(law, law.slip_direction(), touch)), "touch");
  }
}

ContactMargin::Course ContactMargin::Course::of_sliding(const ContactLaw& law, double direction,
                                                        const TipState& start, const TipState& end,
                                                        double h_s) {
  return {sliding_m_s(law, direction, start), sliding_m_s(law, direction, end),
          direction * (end.x_m - start.x_m) + law.slip_coupling() * (end.y_m - start.y_m), h_s};
}

double ContactMargin::Course::path_while_positive_m() const {
  const double a = rise0 / step_s;
  const double b = (rise1 - rise0) / (2.0 * step_s);
  const double z = 2.0 * first / (std::sqrt(a * a - 4.0 * b * first) - a);
  return step_s * z * (first + z * (a / 2.0 + z * b / 3.0));
}

void ContactMargin::follow(Approach& approach, const Course& course, std::string_view event) {
  if (course.has_extremum()) {
    const double extremum = course.extremum();
    if (course.rise0 > 0.0) {
      add_speed(-extremum, event);
    } else {
      approach.deepest = std::min(approach.deepest, extremum);
    }
  } else if (approach.rises && course.rise0 <= 0.0) {
    add_speed(-course.first, event);
  }
  approach.is_near = course.last > near_m_s_;
  approach.deepest = std::min(approach.deepest, course.last);
  approach.rises = approach.is_near && course.rise1 > 0.0;
}

void ContactMargin::follow_turn(const ContactLaw& law, const TipState& start, const TipState& end,
                                double h_s) {
  const double sign = law.is_compression() ? 1.0 : -1.0;
  follow(turn_, {sign * start.vy_m_s, sign * end.vy_m_s, sign * (end.y_m - start.y_m), h_s},
         "turn");
}

void ContactMargin::follow_stick(const ContactLaw& law, const TipState& start, const TipState& end,
                                 double h_s) {
  if (law.mu() > 0.0) {
    follow(stick_, Course::of_sliding(law, law.slip_direction(), start, end, h_s).negative(),
           "stick");
  }
}

void ContactMargin::add_speed(double distance_m_s, std::string_view event) {
  // Between the ends of a step a function may come nearer than at both by this much of the speed.
  constexpr double kInside = 0.005;
  speed_m_s_.add(distance_m_s, event);
  near_m_s_ = -(speed_m_s_.distance + kInside * touch_speed_m_s_);
}

void ContactMargin::follow_cone(const ContactLaw& law, const TipState& start, const TipState& end,
                                double h_s) {
  for (const double direction : {1.0, -1.0}) {
    const Course sliding = Course::of_sliding(law, direction, start, end, h_s);
    if (direction == law.slip_direction()) {
      beyond_m_s_ = std::max(beyond_m_s_, sliding.negative().highest());
    }
    // k_t v_P is the rate at which F_t nears this side, so it is nearest where P would turn back.
    const bool neared = direction > 0.0 ? nears_forward_ : nears_backward_;
    if (neared && sliding.first > 0.0 && sliding.last <= 0.0) {
      const double nearer_N = law.tangential_stiffness_N_m() * sliding.path_while_positive_m();
      force_N_.add(to_cone_N(law, direction, start) - nearer_N, "slip");
    }
  }
}

void ContactMargin::add_event(const ContactLaw& before, ContactEvent event, const TipState& tip) {
  switch (event) {
    case ContactEvent::kSeparation:
      return add_separation(before, tip);
    case ContactEvent::kTurn:
      return add_turn(before, tip);
    case ContactEvent::kSlipForward:
      return add_slip(before, 1.0, tip);
    case ContactEvent::kSlipBackward:
      return add_slip(before, -1.0, tip);
    case ContactEvent::kStick:
      return add_stick(before, tip);
    case ContactEvent::kTangentialExtremum:
      return;
  }
}

void ContactMargin::add_turn(const ContactLaw& before, const TipState& tip) {
  if (!before.is_compression()) {
    force_N_.add(before.fn_N(tip), "separation");
  }
  if (has_turned_) {
    add_speed(-turn_.deepest, "turn");
  }
  has_turned_ = true;
  turn_ = {};
  if (before.mu() == 0.0) {
    return;
  }
  if (!before.is_stick()) {
    if (stick_.rises) {
      add_speed(sliding_m_s(before, before.slip_direction(), tip), "stick");
    }
    return;
  }
  for (const double direction : {1.0, -1.0}) {
    if (sliding_m_s(before, direction, tip) > 0.0) {
      force_N_.add(to_cone_N(before, direction, tip), "slip");
    }
  }
}

void ContactMargin::add_slip(const ContactLaw& before, double direction, const TipState& tip) {
  if (turn_.rises) {
    add_speed(std::abs(tip.vy_m_s), "turn");
  }
  if (stick_follows_slip_ && direction == before.slip_direction()) {
    add_speed(beyond_m_s_, "stick");
  }
  stick_ = {};
  slip_follows_stick_ = true;
  slip_began_m_ = before.xP_m(tip);
}

void ContactMargin::add_stick(const ContactLaw& before, const TipState& tip) {
  if (before.mu() == 0.0) {
    return;  // P reverses, which is no change of state
  }
  if (turn_.rises) {
    add_speed(std::abs(tip.vy_m_s), "turn");
  }
  if (!before.is_compression()) {
    force_N_.add(before.fn_N(tip), "separation");
  }
  if (slip_follows_stick_) {
    const double slid_m = std::abs(before.xP_m(tip) - slip_began_m_);
    force_N_.add(before.tangential_stiffness_N_m() * slid_m, "slip");
  }
  beyond_m_s_ = 0.0;
  stick_follows_slip_ = true;
  // F_t is at the side of the slip, and leaves it.
  nears_forward_ = before.slip_direction() < 0.0 && sliding_m_s(before, 1.0, tip) > 0.0;
  nears_backward_ = before.slip_direction() > 0.0 && sliding_m_s(before, -1.0, tip) > 0.0;
}

void ContactMargin::add_separation(const ContactLaw& before, const TipState& tip) {
  if (before.mu() > 0.0 && !before.is_stick() && stick_.rises) {
    add_speed(sliding_m_s(before, before.slip_direction(), tip), "stick");
  }
  const double deceleration_m_s2 = (last_vn_m_s_ - tip.vy_m_s) / last_step_s_;
  if (deceleration_m_s2 > 0.0) {
    const double further_m = 0.5 * tip.vy_m_s * tip.vy_m_s / deceleration_m_s2;
    force_N_.add(before.normal_stiffness_N_m() * further_m, "separation");
  }
}

ContactMargin::Nearest ContactMargin::nearest(double largest_fn_N) const {
  const double force = force_N_.distance / largest_fn_N;
  const double speed = speed_m_s_.distance / touch_speed_m_s_;
  return force < speed ? Nearest{force, force_N_.event} : Nearest{speed, speed_m_s_.event};
}

}  // namespace oblique::solver
