#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "worker/solver/contact/reaction_kernel.h"
#include "worker/solver/model/case_result.h"

namespace oblique::solver {

/// The loops of ReactionKernel compiled for one instruction set.
struct ReactionLoops {
  bool (*mark_candidates)(const ReactionArrays&);
  void (*shift)(const ReactionArrays&);
};

/// The largest magnitude of each reaction over a contact, from values at instants or from means
/// over spans of time: by a parabola through the three around the largest one seen. A mean over a
/// span w lies w^2 f''/24 beside the value at its middle, which is put right. For one contact, or
/// as many as there are lanes, each with spans of its own.
class ReactionPeaks {
 public:
  /// Of one contact, in lane 0.
  explicit ReactionPeaks(std::size_t reactions);
  ReactionPeaks(std::size_t reactions, std::size_t lanes, const ReactionLoops& loops);

  /// Makes a lane as new.
  void restart(std::size_t lane);

  /// The next span of a lane, taken by the next add(): its end and its length, 0 for an instant.
  /// Spans come in order; one of no time since the last (the other side of an event) is passed
  /// over.
  void set_span(std::size_t lane, double end_s, double width_s);
  /// Takes the spans that were set since the last call. `squared_N2[reaction * lanes + lane]` is
  /// the squared magnitude of the mean over the span.
  void add(const double* squared_N2);

  /// Over all that was added. One that rises up to its last span is taken on to the end by a
  /// straight line; adding the value at that instant does better where rises_at_end() says so.
  std::vector<ReactionPeak> peaks(std::size_t lane) const;
  bool rises_at_end(std::size_t lane) const;

  /// A lane as a contact of its own, and back into a lane.
  ReactionPeaks taken_out(std::size_t lane) const;
  void put_in(std::size_t lane, const ReactionPeaks& one);

 private:
  struct Span {
    double middle_s;
    double width_s;
  };
  /// The last three, as they are while the latest is taken.
  struct Spans {
    Span before;
    Span last;
    Span next;
  };
  void look(std::size_t lane, std::size_t reaction, double next_N2);
  void keep_larger(std::size_t at, const ReactionPeak& peak);
  std::size_t at(std::size_t lane, std::size_t reaction) const { return reaction * lanes_ + lane; }

  std::size_t reactions_;
  std::size_t lanes_;
  ReactionLoops loops_;
  std::vector<double> is_new_;  // one a lane
  std::vector<Spans> spans_;    // one a lane
  std::vector<double> last_N2_;
  std::vector<double> before_N2_;
  std::vector<double> worth_a_look_N2_;
  std::vector<std::int64_t> candidates_;
  std::vector<ReactionPeak> largest_;
};

}  // namespace oblique::solver
