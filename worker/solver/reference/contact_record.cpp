#include "worker/solver/reference/contact_record.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace oblique::solver {
namespace {

constexpr double kRippleFraction = 0.05;

/// How far |F_t| is from the side of the cone where P would slide in `direction`.
double to_cone_N(const ContactLaw& law, double direction, const TipState& tip) {
  return law.mu() * law.fn_N(tip) + direction * law.ft_N(tip);
}

/// P's velocity in `direction` if it slid in it: |F_t| nears that side of the cone where it is > 0.
double sliding_m_s(const ContactLaw& law, double direction, const TipState& tip) {
  return direction * tip.vx_m_s + law.slip_coupling() * tip.vy_m_s;
}

}  // namespace

// ---- ContactRecord ------------------------------------------------------------------------------

ContactRecord::ContactRecord(const ContactLaw& law, const TipState& touch)
    : xP_m_(law.xP_m(touch)) {
  states_.push_back({law.is_stick(), law.is_compression(), 0.0});
}

void ContactRecord::add_step(const ContactLaw& law, const TipState& start, const TipState& end,
                             const ContactIntegrals<double>& integrals) {
  impulse_n_Ns_ += integrals.impulse_n;
  impulse_t_Ns_ += integrals.impulse_t;
  work_t_J_ += integrals.work_t;
  // F_n is affine in y between events, so its work is exact.
  const double work_n = 0.5 * (law.fn_N(start) + law.fn_N(end)) * (end.y_m - start.y_m);
  work_n_J_ += work_n;
  exchanged_J_ += std::abs(work_n) + std::abs(integrals.work_t);
  ft_span_N_ = std::max(ft_span_N_, std::abs(law.ft_N(end)));
  ft_largest_N_ = std::max(ft_largest_N_, std::abs(law.ft_N(end)));
}

void ContactRecord::add_turn(const ContactLaw& before, const TipState& tip, double t_s) {
  if (!before.is_compression()) {
    turns_.back().ft_span_N = ft_span_N_;
    ft_span_N_ = std::abs(before.ft_N(tip));
  }
  turns_.push_back({t_s, before.fn_N(tip), 0.0});
}

void ContactRecord::add_tangential_peak(double ft_N, double t_s) {
  ft_peaks_.push_back({t_s, std::abs(ft_N)});
}

void ContactRecord::close_slide(const ContactLaw& law, const TipState& tip) {
  const double xP = law.xP_m(tip);
  if (!states_.back().stick) {
    slide_m_ += std::abs(xP - xP_m_);
  }
  xP_m_ = xP;
}

void ContactRecord::add_state(const ContactLaw& law, const TipState& tip, double t_s) {
  close_slide(law, tip);
  if (states_.back().t0_s == t_s) {
    states_.pop_back();
  }
  const bool is_new = states_.empty() || states_.back().stick != law.is_stick() ||
                      states_.back().compression != law.is_compression();
  if (is_new) {
    states_.push_back({law.is_stick(), law.is_compression(), t_s});
  }
}

void ContactRecord::finish(const ContactLaw& law, const TipState& tip, double t_s) {
  close_slide(law, tip);
  if (states_.back().t0_s == t_s) {
    states_.pop_back();  // as where both forces vanish together, and rounding lets P slip first
  }
  turns_.back().ft_span_N = ft_span_N_;
  duration_s_ = t_s;
}

std::vector<bool> without_ripples(const std::vector<double>& fn_N) {
  std::vector<bool> survives(fn_N.size(), true);
  const double threshold =
      fn_N.empty() ? 0.0 : kRippleFraction * *std::max_element(fn_N.begin(), fn_N.end());
  while (true) {
    const std::size_t none = fn_N.size();
    std::size_t before = none;  // the last one that survives
    std::pair<std::size_t, std::size_t> ripple{none, none};
    double shallowest = threshold;
    for (std::size_t i = 0; i < fn_N.size(); ++i) {
      if (!survives[i]) {
        continue;
      }
      if (before != none && std::abs(fn_N[i] - fn_N[before]) < shallowest) {
        shallowest = std::abs(fn_N[i] - fn_N[before]);
        ripple = {before, i};
      }
      before = i;
    }
    if (ripple.first == none) {
      return survives;
    }
    survives[ripple.first] = survives[ripple.second] = false;
  }
}

std::string ContactRecord::mode(const std::vector<bool>& survives) const {
  std::string text;
  std::string last;
  for (const State& state : states_) {
    // A state lies between two turns; its kind is the parity of the surviving turns before it.
    bool compression = true;
    for (std::size_t i = 0; i < turns_.size() && turns_[i].t_s <= state.t0_s; ++i) {
      compression = survives[i] ? !compression : compression;
    }
    const std::string name = {state.stick ? 'S' : 's', compression ? 'C' : 'R'};
    if (name != last) {
      text += (text.empty() ? "" : " ") + name;
    }
    last = name;
  }
  return text;
}

void ContactRecord::write_to(CaseResult& result) const {
  std::vector<double> turns_N;
  for (const Turn& turn : turns_) {
    turns_N.push_back(turn.fn_N);
  }
  const std::vector<bool> survives = without_ripples(turns_N);
  result.mode = mode(std::vector<bool>(turns_.size(), true));
  result.major_mode = mode(survives);
  result.duration_s = duration_s_;
  result.slide_m = slide_m_;
  result.impulse_n_Ns = impulse_n_Ns_;
  result.impulse_t_Ns = impulse_t_Ns_;
  result.ft_peaks = ft_peaks_;
  result.ft_peak_N = ft_largest_N_;
  result.fn_peak_N = 0.0;
  double phase_start_s = 0.0;
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    const bool is_peak = i % 2 == 0;
    if (is_peak) {
      result.peaks.push_back({turns_[i].t_s, turns_[i].fn_N, turns_[i].ft_span_N, survives[i]});
      result.fn_peak_N = std::max(result.fn_peak_N, turns_[i].fn_N);
    }
    result.phases.push_back({is_peak ? PhaseKind::kCompression : PhaseKind::kRestitution,
                             phase_start_s, turns_[i].t_s, turns_[i].fn_N});
    phase_start_s = turns_[i].t_s;
  }
  result.phases.push_back({PhaseKind::kRestitution, phase_start_s, duration_s_, 0.0});
  result.stick_total_s = 0.0;
  for (auto state = states_.begin(); state != states_.end();) {
    const auto next = std::find_if(state, states_.end(),
                                   [&](const State& other) { return other.stick != state->stick; });
    if (state->stick) {
      const double t1_s = next != states_.end() ? next->t0_s : duration_s_;
      result.stick_intervals.push_back({state->t0_s, t1_s});
      result.stick_total_s += t1_s - state->t0_s;
    }
    state = next;
  }
  result.energy.exchanged_J = exchanged_J_;
  result.energy.friction_J = -work_t_J_;
  result.energy.restitution_J = -work_n_J_;
}

// ---- ContactMargin ------------------------------------------------------------------------------

/// A function of velocities over a step, as the quadratic by which its events are guessed.
struct ContactMargin::Course {
  Course(double first_m_s, double last_m_s, double path_m, double h_s)
      : first(first_m_s),
        last(last_m_s),
        rise0(6.0 * path_m - h_s * (4.0 * first + 2.0 * last)),
        rise1(h_s * (2.0 * first + 4.0 * last) - 6.0 * path_m),
        step_s(h_s) {}
  /// `sign` times P's velocity if it slid in `direction`.
  static Course of_sliding(const Step& step, double direction, double sign) {
    const auto& [law, start, end, h_s] = step;
    const double path_m =
        direction * (end.x_m - start.x_m) + law.slip_coupling() * (end.y_m - start.y_m);
    return {sign * sliding_m_s(law, direction, start), sign * sliding_m_s(law, direction, end),
            sign * path_m, h_s};
  }
  bool has_extremum() const { return rise0 * rise1 < 0.0; }
  double extremum() const { return first + rise0 * rise0 / (2.0 * step_s * (rise0 - rise1)); }
  /// Of one that is positive at the start and not at the end: its integral up to the zero.
  double path_while_positive_m() const {
    const double a = rise0 / step_s;
    const double b = (rise1 - rise0) / (2.0 * step_s);
    const double z = 2.0 * first / (std::sqrt(a * a - 4.0 * b * first) - a);
    return step_s * z * (first + z * (a / 2.0 + z * b / 3.0));
  }

  double first;
  double last;
  double rise0;  ///< rate at the start, times the square of the step
  double rise1;  ///< at the end
  double step_s;
};

ContactMargin::ContactMargin(const ContactLaw& law, const TipState& touch)
    : touch_speed_m_s_(std::hypot(touch.vx_m_s, touch.vy_m_s)) {
  add_speed(touch_speed_m_s_, "separation");
  if (law.mu() > 0.0) {
    add_speed(std::abs(sliding_m_s(law, law.slip_direction(), touch)), "touch");
  }
}

void ContactMargin::add_speed(double distance_m_s, std::string_view event) {
  // Between the ends of a step a function may come nearer than at both by this much of the speed.
  constexpr double kInside = 0.005;
  speed_m_s_.add(distance_m_s, event);
  near_m_s_ = -(speed_m_s_.distance + kInside * touch_speed_m_s_);
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

void ContactMargin::follow_turn(const Step& step) {
  const auto& [law, start, end, h_s] = step;
  const double sign = law.is_compression() ? 1.0 : -1.0;
  follow(turn_, {sign * start.vy_m_s, sign * end.vy_m_s, sign * (end.y_m - start.y_m), h_s},
         "turn");
}

void ContactMargin::follow_stick(const Step& step) {
  if (step.law.mu() > 0.0) {
    follow(stick_, Course::of_sliding(step, step.law.slip_direction(), -1.0), "stick");
  }
}

void ContactMargin::follow_cone(const Step& step) {
  for (const double direction : {1.0, -1.0}) {
    if (direction == step.law.slip_direction()) {
      const Course back = Course::of_sliding(step, direction, -1.0);
      beyond_m_s_ = std::max(
          {beyond_m_s_, back.first, back.last, back.has_extremum() ? back.extremum() : back.last});
    }
    // k_t v_P is the rate at which F_t nears this side, so it is nearest where P would turn back.
    const Course sliding = Course::of_sliding(step, direction, 1.0);
    const bool neared = direction > 0.0 ? nears_forward_ : nears_backward_;
    if (neared && sliding.first > 0.0 && sliding.last <= 0.0) {
      const double nearer_N = step.law.tangential_stiffness_N_m() * sliding.path_while_positive_m();
      force_N_.add(to_cone_N(step.law, direction, step.start) - nearer_N, "slip");
    }
  }
}

void ContactMargin::add_event(const ContactLaw& before, ContactEvent event, const TipState& tip) {
  const double s = before.slip_direction();
  const auto add_kept_stick = [&] {  // P nearly came to rest
    if (before.mu() > 0.0 && !before.is_stick() && stick_.rises) {
      add_speed(sliding_m_s(before, s, tip), "stick");
    }
  };
  const auto add_kept_turn = [&] {
    if (turn_.rises) {
      add_speed(std::abs(tip.vy_m_s), "turn");
    }
  };
  const auto add_kept_separation = [&] {
    if (!before.is_compression()) {
      force_N_.add(before.fn_N(tip), "separation");
    }
  };
  switch (event) {
    case ContactEvent::kSeparation: {
      add_kept_stick();
      const double deceleration_m_s2 = (last_vn_m_s_ - tip.vy_m_s) / last_step_s_;
      if (deceleration_m_s2 > 0.0) {
        const double further_m = 0.5 * tip.vy_m_s * tip.vy_m_s / deceleration_m_s2;
        force_N_.add(before.normal_stiffness_N_m() * further_m, "separation");
      }
      return;
    }
    case ContactEvent::kTurn:
      add_kept_separation();
      if (has_turned_) {
        add_speed(-turn_.deepest, "turn");
      }
      has_turned_ = true;
      turn_ = {};
      add_kept_stick();
      for (const double direction : {1.0, -1.0}) {
        if (before.is_stick() && sliding_m_s(before, direction, tip) > 0.0) {
          force_N_.add(to_cone_N(before, direction, tip), "slip");
        }
      }
      return;
    case ContactEvent::kSlipForward:
    case ContactEvent::kSlipBackward:
      add_kept_turn();
      if (stick_follows_slip_ && (event == ContactEvent::kSlipForward) == (s > 0.0)) {
        add_speed(beyond_m_s_, "stick");
      }
      stick_ = {};
      slip_follows_stick_ = true;
      slip_began_m_ = before.xP_m(tip);
      return;
    case ContactEvent::kStick:
      if (before.mu() == 0.0) {
        return;  // P reverses, which is no change of state
      }
      add_kept_turn();
      add_kept_separation();
      if (slip_follows_stick_) {
        const double slid_m = std::abs(before.xP_m(tip) - slip_began_m_);
        force_N_.add(before.tangential_stiffness_N_m() * slid_m, "slip");
      }
      beyond_m_s_ = 0.0;
      stick_follows_slip_ = true;
      // F_t is at the side of the slip, and leaves it.
      nears_forward_ = s < 0.0 && sliding_m_s(before, 1.0, tip) > 0.0;
      nears_backward_ = s > 0.0 && sliding_m_s(before, -1.0, tip) > 0.0;
      return;
    case ContactEvent::kTangentialExtremum:
      return;
  }
}

ContactMargin::Nearest ContactMargin::nearest(double largest_fn_N) const {
  const double force = force_N_.distance / largest_fn_N;
  const double speed = speed_m_s_.distance / touch_speed_m_s_;
  return force < speed ? Nearest{force, force_N_.event} : Nearest{speed, speed_m_s_.event};
}

// ---- ReactionPeaks ------------------------------------------------------------------------------

void ReactionPeaks::look(Reaction& reaction, const Span& next, double next_N2) const {
  if (reaction.last_N2 < 0.0) {
    return;  // `next` is the first value
  }
  ReactionPeak peak{last_.middle_s, std::sqrt(reaction.last_N2)};
  const double right = (std::sqrt(next_N2) - peak.force_N) / (next.middle_s - last_.middle_s);
  if (reaction.before_N2 < 0.0) {
    // Falling from the first value on: the straight line through the first two, at the start.
    const double back_s = right <= 0.0 ? 0.5 * last_.width_s : 0.0;
    peak = {last_.middle_s - back_s, peak.force_N - right * back_s};
  } else {
    const double left =
        (peak.force_N - std::sqrt(reaction.before_N2)) / (last_.middle_s - before_.middle_s);
    const double curvature = (right - left) / (next.middle_s - before_.middle_s);
    if (curvature < 0.0) {
      const double slope = left + curvature * (last_.middle_s - before_.middle_s);
      const double shift_s = -0.5 * slope / curvature;
      peak.t_s += shift_s;
      peak.force_N += 0.5 * slope * shift_s - curvature * last_.width_s * last_.width_s / 12.0;
    }
  }
  if (peak.force_N > reaction.largest.force_N) {
    // A parabola through three neighbours rises above the middle one by less than a twentieth of it
    // where steps resolve the motion: lower values need no look.
    constexpr double kWorthALook = 0.9;
    reaction.largest = peak;
    reaction.worth_a_look_N2 = kWorthALook * peak.force_N * peak.force_N;
  }
}

std::vector<ReactionPeak> ReactionPeaks::peaks() const {
  std::vector<ReactionPeak> peaks;
  for (const Reaction& reaction : reactions_) {
    // Rising up to the last value: the straight line through the last two, at the end.
    ReactionPeak end{last_.middle_s, std::sqrt(std::max(reaction.last_N2, 0.0))};
    if (reaction.before_N2 >= 0.0 && reaction.last_N2 >= reaction.before_N2) {
      const double rise_N_s =
          (end.force_N - std::sqrt(reaction.before_N2)) / (last_.middle_s - before_.middle_s);
      end.t_s += 0.5 * last_.width_s;
      end.force_N += rise_N_s * 0.5 * last_.width_s;
    }
    peaks.push_back(end.force_N > reaction.largest.force_N ? end : reaction.largest);
  }
  return peaks;
}

bool ReactionPeaks::rises_at_end() const {
  return std::any_of(reactions_.begin(), reactions_.end(), [](const Reaction& reaction) {
    return reaction.last_N2 > reaction.worth_a_look_N2 && reaction.last_N2 >= reaction.before_N2;
  });
}

}  // namespace oblique::solver
