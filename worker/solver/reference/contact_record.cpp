#include "worker/solver/reference/contact_record.h"

#include <algorithm>
#include <numeric>

namespace oblique::solver {
namespace {

constexpr double kRippleFraction = 0.05;

/// Distance of F_t from the limit of the cone at which P would slide in `direction`.
double to_cone_N(const ContactLaw& law, double direction, const TipState& tip) {
  return law.mu() * law.fn_N(tip) + direction * law.ft_N(tip);
}

}  // namespace

ContactRecord::ContactRecord(const ContactLaw& law, const TipState& touch)
    : xP_m_(law.xP_m(touch)) {
  states_.push_back({law.is_stick(), law.is_compression(), 0.0});
}

void ContactRecord::add_step(const ContactLaw& law, const TipState& start, const TipState& end,
                             const ContactIntegrals<double>& integrals) {
  result_.impulse_n_Ns += integrals.impulse_n;
  result_.impulse_t_Ns += integrals.impulse_t;
  work_t_J_ += integrals.work_t;
  // F_n is affine in y between events, so its work is exact.
  const double work_n = 0.5 * (law.fn_N(start) + law.fn_N(end)) * (end.y_m - start.y_m);
  work_n_J_ += work_n;
  result_.energy.exchanged_J += std::abs(work_n) + std::abs(integrals.work_t);
  const double ft_N = std::abs(law.ft_N(end));
  ft_span_N_ = std::max(ft_span_N_, ft_N);
  result_.ft_peak_N = std::max(result_.ft_peak_N, ft_N);
}

void ContactRecord::add_turn(const ContactLaw& before, const TipState& tip, double t_s) {
  if (!before.is_compression()) {
    turns_.back().ft_span_N = ft_span_N_;
    ft_span_N_ = std::abs(before.ft_N(tip));
  }
  turns_.push_back({t_s, before.fn_N(tip), 0.0});
}

/// Adds the slide of the last regime. Drops a regime without duration, such as a slip that rounding
/// causes where both forces vanish together.
void ContactRecord::close_state(const ContactLaw& law, const TipState& tip, double t_s) {
  const double xP = law.xP_m(tip);
  if (!states_.back().stick) {
    result_.slide_m += std::abs(xP - xP_m_);
  }
  xP_m_ = xP;
  if (states_.back().t0_s == t_s) {
    states_.pop_back();
  }
}

void ContactRecord::add_state(const ContactLaw& law, const TipState& tip, double t_s) {
  close_state(law, tip, t_s);
  const bool is_new = states_.empty() || states_.back().stick != law.is_stick() ||
                      states_.back().compression != law.is_compression();
  if (is_new) {
    states_.push_back({law.is_stick(), law.is_compression(), t_s});
  }
}

void ContactRecord::finish(const ContactLaw& law, const TipState& tip, double t_s) {
  close_state(law, tip, t_s);
  turns_.back().ft_span_N = ft_span_N_;
  result_.duration_s = t_s;
}

std::vector<bool> without_ripples(const std::vector<double>& fn_N) {
  std::vector<std::size_t> left(fn_N.size());
  std::iota(left.begin(), left.end(), 0U);
  while (!left.empty()) {
    auto ripple = left.end();
    double shallowest_N = kRippleFraction * *std::max_element(fn_N.begin(), fn_N.end());
    for (auto turn = left.begin(); turn + 1 != left.end(); ++turn) {
      const double depth_N = std::abs(fn_N[turn[1]] - fn_N[turn[0]]);
      if (depth_N < shallowest_N) {
        shallowest_N = depth_N;
        ripple = turn;
      }
    }
    if (ripple == left.end()) {
      break;
    }
    left.erase(ripple, ripple + 2);
  }
  std::vector<bool> survives(fn_N.size(), false);
  for (const std::size_t turn : left) {
    survives[turn] = true;
  }
  return survives;
}

std::string ContactRecord::mode(const std::vector<bool>& survives) const {
  std::string text;
  std::string last;
  for (const State& state : states_) {
    // Each turn that is not part of a ripple switches between compression and restitution.
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

CaseResult ContactRecord::result() const {
  CaseResult result = result_;
  std::vector<double> turns_N;
  for (const Turn& turn : turns_) {
    turns_N.push_back(turn.fn_N);
  }
  const std::vector<bool> survives = without_ripples(turns_N);
  result.mode = mode(std::vector<bool>(turns_.size(), true));
  result.major_mode = mode(survives);
  double phase_start_s = 0.0;
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    const auto& [t_s, fn_N, ft_span_N] = turns_[i];
    const bool is_peak = i % 2 == 0;
    if (is_peak) {
      result.peaks.push_back({t_s, fn_N, ft_span_N, survives[i]});
      result.fn_peak_N = std::max(result.fn_peak_N, fn_N);
    }
    result.phases.push_back(
        {is_peak ? PhaseKind::kCompression : PhaseKind::kRestitution, phase_start_s, t_s, fn_N});
    phase_start_s = t_s;
  }
  result.phases.push_back({PhaseKind::kRestitution, phase_start_s, result.duration_s, 0.0});
  for (auto state = states_.begin(); state != states_.end();) {
    const auto next = std::find_if(state, states_.end(),
                                   [&](const State& other) { return other.stick != state->stick; });
    if (state->stick) {
      const double t1_s = next != states_.end() ? next->t0_s : result.duration_s;
      result.stick_intervals.push_back({state->t0_s, t1_s});
      result.stick_total_s += t1_s - state->t0_s;
    }
    state = next;
  }
  result.energy.friction_J = -work_t_J_;
  result.energy.restitution_J = -work_n_J_;
  return result;
}

/// Integral of a function that is positive at the start, from there to its zero in the step.
double ContactMargin::Course::path_while_positive_m() const {
  const double a = rise0() / h_s;
  const double b = (rise1() - rise0()) / (2.0 * h_s);
  const double z = 2.0 * first_m_s / (std::sqrt(a * a - 4.0 * b * first_m_s) - a);
  return h_s * z * (first_m_s + z * (a / 2.0 + z * b / 3.0));
}

ContactMargin::ContactMargin(const ContactLaw& law, const TipState& touch)
    : touch_speed_m_s_(std::hypot(touch.vx_m_s, touch.vy_m_s)) {
  add_speed(touch_speed_m_s_, "separation");
  if (law.mu() > 0.0) {
    add_speed(std::abs(law.slip_velocity_m_s(touch)), "touch");
  }
}

void ContactMargin::add_speed(double distance_m_s, std::string_view event) {
  // Within a step a function may come nearer to zero than at the ends of the step. kInside is the
  // difference, relative to the speed at touch.
  constexpr double kInside = 0.005;
  speed_m_s_.add(distance_m_s, event);
  near_m_s_ = -(speed_m_s_.distance + kInside * touch_speed_m_s_);
}

void ContactMargin::follow(Approach& approach, const Course& course, std::string_view event) {
  if (course.has_extremum() && course.rise0() > 0.0) {
    add_speed(-course.extremum_m_s(), event);
  } else if (course.has_extremum()) {
    approach.deepest = std::min(approach.deepest, course.extremum_m_s());
  } else if (approach.rises && course.rise0() <= 0.0) {
    add_speed(-course.first_m_s, event);
  }
  approach.is_near = course.last_m_s > near_m_s_;
  approach.deepest = std::min(approach.deepest, course.last_m_s);
  approach.rises = approach.is_near && course.rise1() > 0.0;
}

/// F_t nears a limit of the cone at the rate k_t times the speed at which P would slide, so it is
/// nearest where this speed changes sign.
void ContactMargin::follow_cone(const ContactLaw& law, const TipState& start, const TipState& end,
                                double h_s) {
  for (const double direction : {1.0, -1.0}) {
    const auto speed = [&](const TipState& tip) { return law.slip_speed_m_s(tip, direction); };
    const Course course{speed(start), speed(end), speed(displacement(start, end)), h_s};
    if (direction == law.slip_direction()) {
      const double least_m_s = course.has_extremum() ? course.extremum_m_s() : course.last_m_s;
      back_m_s_ = std::max({back_m_s_, -course.first_m_s, -course.last_m_s, -least_m_s});
    }
    if (direction != left_side_ && course.first_m_s > 0.0 && course.last_m_s <= 0.0) {
      const double nearer_N = law.tangential_stiffness_N_m() * course.path_while_positive_m();
      force_N_.add(to_cone_N(law, direction, start) - nearer_N, "slip");
    }
  }
  left_side_ = 0.0;
}

void ContactMargin::add_event(const ContactLaw& before, ContactEvent event, const TipState& tip) {
  const bool is_turn = event == ContactEvent::kTurn;
  const bool is_stick = event == ContactEvent::kStick;
  const bool is_separation = event == ContactEvent::kSeparation;
  if (event == ContactEvent::kTangentialExtremum || (is_stick && before.mu() == 0.0)) {
    return;  // no change of state; without friction P reverses instead of sticking
  }
  const double s = before.slip_direction();
  if (!is_turn && !is_separation && turn_.rises) {
    add_speed(std::abs(tip.vy_m_s), "turn");
  }
  if ((is_turn || is_separation) && !before.is_stick() && stick_.rises) {
    add_speed(before.slip_speed_m_s(tip, s), "stick");
  }
  if ((is_turn || is_stick) && !before.is_compression()) {
    force_N_.add(before.fn_N(tip), "separation");
  }
  if (is_separation) {
    const double deceleration_m_s2 = (last_vn_m_s_ - tip.vy_m_s) / last_step_s_;
    if (deceleration_m_s2 > 0.0) {
      const double further_m = 0.5 * tip.vy_m_s * tip.vy_m_s / deceleration_m_s2;
      force_N_.add(before.normal_stiffness_N_m() * further_m, "separation");
    }
  } else if (is_turn) {
    if (has_turned_) {
      add_speed(-turn_.deepest, "turn");
    }
    has_turned_ = true;
    turn_ = {};
    for (const double direction : {1.0, -1.0}) {
      if (before.is_stick() && before.slip_speed_m_s(tip, direction) > 0.0) {
        force_N_.add(to_cone_N(before, direction, tip), "slip");
      }
    }
  } else if (is_stick) {
    if (slip_began_m_) {
      const double slid_m = std::abs(before.xP_m(tip) - *slip_began_m_);
      force_N_.add(before.tangential_stiffness_N_m() * slid_m, "slip");
    }
    back_m_s_ = 0.0;
    stick_follows_slip_ = true;
    left_side_ = s;
  } else {  // slip
    if (stick_follows_slip_ && (event == ContactEvent::kSlipForward) == (s > 0.0)) {
      add_speed(back_m_s_, "stick");
    }
    stick_ = {};
    slip_began_m_ = before.xP_m(tip);
  }
}

ContactMargin::Nearest ContactMargin::nearest(double largest_fn_N) const {
  const double force = force_N_.distance / largest_fn_N;
  const double speed = speed_m_s_.distance / touch_speed_m_s_;
  return force < speed ? Nearest{force, force_N_.event} : Nearest{speed, speed_m_s_.event};
}

void ReactionPeaks::add_maximum(Reaction& reaction, const Span& next, double next_N2) const {
  if (reaction.last_N2 < 0.0) {
    return;  // the first value
  }
  ReactionPeak peak{last_.middle_s, std::sqrt(reaction.last_N2)};
  const double right = (std::sqrt(next_N2) - peak.force_N) / (next.middle_s - last_.middle_s);
  if (reaction.before_N2 < 0.0) {
    // If a reaction falls from the start, its peak is there and is extrapolated linearly.
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
    // If steps resolve the motion, the parabola exceeds the middle value by less than 5 %.
    constexpr double kThreshold = 0.9;
    reaction.largest = peak;
    reaction.threshold_N2 = kThreshold * peak.force_N * peak.force_N;
  }
}

std::vector<ReactionPeak> ReactionPeaks::peaks() const {
  std::vector<ReactionPeak> peaks;
  for (const Reaction& reaction : reactions_) {
    // If a reaction rises at the end, its peak is there and is extrapolated linearly.
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
    return reaction.last_N2 > reaction.threshold_N2 && reaction.last_N2 >= reaction.before_N2;
  });
}

}  // namespace oblique::solver
