#include "worker/solver/contact/reaction_peaks.h"

#include <algorithm>
#include <cmath>

namespace oblique::solver {
namespace {

/// A parabola through three neighbours rises above the middle one by less than a twentieth of it
/// where steps resolve the motion: lower values need no look.
constexpr double kWorthALook = 0.9;
constexpr double kNone = -1.0;

struct OneNumber {
  using Vector = double __attribute__((vector_size(8)));
};
using OneContact = ReactionKernel<OneNumber>;

}  // namespace

ReactionPeaks::ReactionPeaks(std::size_t reactions)
    : ReactionPeaks(reactions, 1, {&OneContact::mark_candidates, &OneContact::shift}) {}

ReactionPeaks::ReactionPeaks(std::size_t reactions, std::size_t lanes, const ReactionLoops& loops)
    : reactions_(reactions),
      lanes_(lanes),
      loops_(loops),
      is_new_(lanes, 0.0),
      spans_(lanes),
      last_N2_(reactions * lanes, kNone),
      before_N2_(reactions * lanes, kNone),
      worth_a_look_N2_(reactions * lanes, 0.0),
      candidates_(reactions * lanes, 0),
      largest_(reactions * lanes, ReactionPeak{0.0, 0.0}) {}

void ReactionPeaks::restart(std::size_t lane) {
  is_new_[lane] = 0.0;
  spans_[lane] = {};
  for (std::size_t reaction = 0; reaction < reactions_; ++reaction) {
    const std::size_t i = at(lane, reaction);
    last_N2_[i] = kNone;
    before_N2_[i] = kNone;
    worth_a_look_N2_[i] = 0.0;
    largest_[i] = {0.0, 0.0};
  }
}

void ReactionPeaks::set_span(std::size_t lane, double end_s, double width_s) {
  Spans& spans = spans_[lane];
  const double middle_s = end_s - 0.5 * width_s;
  const bool is_first = reactions_ > 0 && last_N2_[lane] < 0.0;
  if (is_first || middle_s > spans.next.middle_s) {
    spans.before = spans.last;
    spans.last = spans.next;
    spans.next = {middle_s, width_s};
    is_new_[lane] = 1.0;
  }
}

void ReactionPeaks::add(const double* squared_N2) {
  const ReactionArrays arrays{reactions_,
                              lanes_,
                              is_new_.data(),
                              squared_N2,
                              last_N2_.data(),
                              before_N2_.data(),
                              worth_a_look_N2_.data(),
                              candidates_.data()};
  if (loops_.mark_candidates(arrays)) {
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      if (candidates_[i] != 0) {
        look(i % lanes_, i / lanes_, squared_N2[i]);
      }
    }
  }
  loops_.shift(arrays);
  std::fill(is_new_.begin(), is_new_.end(), 0.0);
}

void ReactionPeaks::keep_larger(std::size_t at, const ReactionPeak& peak) {
  if (peak.force_N > largest_[at].force_N) {
    largest_[at] = peak;
    worth_a_look_N2_[at] = kWorthALook * peak.force_N * peak.force_N;
  }
}

void ReactionPeaks::look(std::size_t lane, std::size_t reaction, double next_N2) {
  const std::size_t i = at(lane, reaction);
  if (last_N2_[i] < 0.0) {
    return;  // `next` is the first value
  }
  const auto& [before, last, next] = spans_[lane];
  const double middle_N = std::sqrt(last_N2_[i]);
  const double right = (std::sqrt(next_N2) - middle_N) / (next.middle_s - last.middle_s);
  if (before_N2_[i] < 0.0) {
    // Falling from the first value on: the straight line through the first two, at the start.
    const double back_s = right <= 0.0 ? 0.5 * last.width_s : 0.0;
    keep_larger(i, {last.middle_s - back_s, middle_N - right * back_s});
    return;
  }
  const double left = (middle_N - std::sqrt(before_N2_[i])) / (last.middle_s - before.middle_s);
  const double curvature = (right - left) / (next.middle_s - before.middle_s);
  ReactionPeak peak{last.middle_s, middle_N};
  if (curvature < 0.0) {
    const double slope = left + curvature * (last.middle_s - before.middle_s);
    const double shift_s = -0.5 * slope / curvature;
    peak.t_s += shift_s;
    peak.force_N += 0.5 * slope * shift_s - curvature * last.width_s * last.width_s / 12.0;
  }
  keep_larger(i, peak);
}

std::vector<ReactionPeak> ReactionPeaks::peaks(std::size_t lane) const {
  std::vector<ReactionPeak> peaks;
  peaks.reserve(reactions_);
  const Span& before = spans_[lane].last;
  const Span& last = spans_[lane].next;
  for (std::size_t reaction = 0; reaction < reactions_; ++reaction) {
    const std::size_t i = at(lane, reaction);
    // Rising up to the last value: the straight line through the last two, at the end.
    ReactionPeak end{last.middle_s, std::sqrt(std::max(last_N2_[i], 0.0))};
    if (before_N2_[i] >= 0.0 && last_N2_[i] >= before_N2_[i]) {
      const double rise_N_s =
          (end.force_N - std::sqrt(before_N2_[i])) / (last.middle_s - before.middle_s);
      end.t_s += 0.5 * last.width_s;
      end.force_N += rise_N_s * 0.5 * last.width_s;
    }
    peaks.push_back(end.force_N > largest_[i].force_N ? end : largest_[i]);
  }
  return peaks;
}

bool ReactionPeaks::rises_at_end(std::size_t lane) const {
  for (std::size_t reaction = 0; reaction < reactions_; ++reaction) {
    const std::size_t i = at(lane, reaction);
    if (last_N2_[i] > worth_a_look_N2_[i] && last_N2_[i] >= before_N2_[i]) {
      return true;
    }
  }
  return false;
}

ReactionPeaks ReactionPeaks::taken_out(std::size_t lane) const {
  ReactionPeaks one(reactions_);
  one.spans_[0] = spans_[lane];
  for (std::size_t reaction = 0; reaction < reactions_; ++reaction) {
    const std::size_t i = at(lane, reaction);
    one.last_N2_[reaction] = last_N2_[i];
    one.before_N2_[reaction] = before_N2_[i];
    one.worth_a_look_N2_[reaction] = worth_a_look_N2_[i];
    one.largest_[reaction] = largest_[i];
  }
  return one;
}

void ReactionPeaks::put_in(std::size_t lane, const ReactionPeaks& one) {
  is_new_[lane] = 0.0;
  spans_[lane] = one.spans_[0];
  for (std::size_t reaction = 0; reaction < reactions_; ++reaction) {
    const std::size_t i = at(lane, reaction);
    last_N2_[i] = one.last_N2_[reaction];
    before_N2_[i] = one.before_N2_[reaction];
    worth_a_look_N2_[i] = one.worth_a_look_N2_[reaction];
    largest_[i] = one.largest_[reaction];
  }
}

}  // namespace oblique::solver
