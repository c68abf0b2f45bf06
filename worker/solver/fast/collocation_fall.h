#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "worker/solver/fast/collocation_lanes.h"
#include "worker/solver/reference/fall.h"

namespace oblique::solver {

/// The tip's height over one step: the polynomial through the stages.
class TipOverStep {
 public:
  using Stages = std::array<double, GaussCollocation::kStages>;

  TipOverStep(double h_s, double y_m, double vy_m_s, const Stages& ay_m_s2)
      : h_s_(h_s), y_m_(y_m), vy_m_s_(vy_m_s), ay_m_s2_(ay_m_s2) {}

  /// At the fraction c of the step.
  double y_m(double c) const;
  double vy_m_s(double c) const;
  /// Where the tip first stops falling, as a fraction of the step; above 1 when it falls on. It is
  /// looked at in the stages and at the end.
  double turn() const;
  /// The fraction at which it has dropped H_m, in [0, last].
  double at_drop(double H_m, double last) const;

 private:
  double vy_by(const double* weights) const;

  double h_s_;
  double y_m_;
  double vy_m_s_;
  Stages ay_m_s2_;
};

/// A fall solved by Gauss collocation. The polynomial through the stages of a step gives the states
/// within it. Kept are states at intervals; an interval is solved again, with the same bits, when
/// a drop within it is first asked for, and kept then while there is room.
class CollocationFall : public Fall {
 public:
  /// `chain` must outlive this. `error_m` is what CollocationLanes::attempt is given.
  CollocationFall(const LaneKernel& kernel, const Chain& chain, double error_m)
      : kernel_(kernel), chain_(chain), error_m_(error_m) {}

  /// Takes the last attempt of `lanes`, a step of h_s seconds, before it is accepted. True when the
  /// tip turns within it: the fall is then complete.
  bool append(const CollocationLanes& lanes, std::size_t lane, double h_s);

  double largest_drop_m() const override { return largest_drop_m_; }
  ChainState state_at_time(double t_s) const override;

  std::size_t bytes() const override;

  double time_s() const { return time_s_; }
  std::size_t steps() const { return steps_.size(); }

 private:
  ChainState state_at_drop(double H_m) const override;
  struct Step {
    double t_s;  ///< at its begin, as what follows
    double drop_m;
    double h_s;
  };
  /// Steps of an interval, one after the other: position, rates, accelerations at the stages.
  using Interval = std::vector<double>;

  void keep(const CollocationLanes& lanes, std::size_t lane);
  std::shared_ptr<const Interval> interval(std::size_t number) const;
  std::shared_ptr<const Interval> kept_interval(std::size_t number) const;
  std::shared_ptr<const Interval> solve_again(std::size_t number) const;
  /// At the fraction c of that step, whose numbers lie at `q`.
  ChainState within(const Step& step, const double* q, double c) const;
  /// Numbers of one step in an interval.
  std::size_t step_size() const { return (2 + GaussCollocation::kStages) * size(); }
  std::size_t size() const { return 2 * static_cast<std::size_t>(chain_.rows()); }
  std::size_t tip() const { return 2 * static_cast<std::size_t>(chain_.tip_row()) + 1; }

  LaneKernel kernel_;
  const Chain& chain_;
  double error_m_;
  double time_s_ = 0.0;
  double largest_drop_m_ = 0.0;
  double last_turn_ = 1.0;  ///< where the tip turns, as a fraction of the last step
  std::vector<Step> steps_;
  std::size_t steps_kept_ = 2;               ///< steps from one kept state to the next: an interval
  std::vector<std::vector<double>> states_;  ///< kept: position, rates, mean acceleration
  mutable std::mutex mutex_;                 ///< of what follows
  mutable std::vector<std::shared_ptr<const Interval>> intervals_;
  mutable std::size_t numbers_ = 0;  ///< in intervals_
};

}  // namespace oblique::solver
