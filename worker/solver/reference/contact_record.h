#pragma once

#include <string>
#include <vector>

#include "worker/solver/model/case_result.h"
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
  std::vector<bool> surviving_turns() const;
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

}  // namespace oblique::solver
