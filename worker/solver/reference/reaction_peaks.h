#pragma once

#include <cstddef>
#include <vector>

#include "worker/solver/model/case_result.h"

namespace oblique::solver {

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

    void keep_larger(const ReactionPeak& peak);
  };
  void look(Reaction& reaction, const Span& next, double next_N2) const;

  std::vector<Reaction> reactions_;
  bool has_last_ = false;
  Span before_;  ///< of the values before_N2, as the next of last_N2
  Span last_;
};

}  // namespace oblique::solver
