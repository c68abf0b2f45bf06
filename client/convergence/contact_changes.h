#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "worker/solver/model/case_result.h"

namespace oblique::client {

/// A part of one contact that another solution of the same point does not have: the mark of an
/// event that grazes its condition, as a V_n that touches zero and may or may not pass it.
struct ContactChange {
  enum class Kind {
    kCompression,  ///< two turns: compression starts again for a while
    kRestitution,  ///< two turns: restitution for a while, then compression goes on
    kStick,        ///< P comes to rest for a while
    kSlip,         ///< P slides for a while between two sticks
    kRipple,       ///< no event: a peak near the depth at which ripples are merged
  };
  Kind kind;
  double t0_s;  ///< since touch
  double t1_s;
  bool in_finer;  ///< whether the finer solution has it, or the coarser
};

/// What one of two solutions of a point has and the other has not, turns first, in the order of
/// time. Events of one kind are put beside each other in their order, and those stay alone whose
/// leaving out brings the times of the others closest together. Empty when both have the same
/// events and the same major peaks.
std::vector<ContactChange> changes_between(const solver::CaseResult& coarser,
                                           const solver::CaseResult& finer);

/// "a restitution of 5.97 us, from 187.58 to 193.55 us (V_n grazes 0)".
std::string described(const ContactChange& change);

/// "restitution", "stick", ...
const char* name_of(ContactChange::Kind kind);

/// Given two ascending lists of times whose lengths differ by an even number: the first index of
/// each pair of neighbours to leave out of `longer` so that the sum of |differences| to `shorter`
/// is least.
std::vector<std::size_t> lone_pairs(const std::vector<double>& longer,
                                    const std::vector<double>& shorter);

}  // namespace oblique::client
