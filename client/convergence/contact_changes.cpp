#include "client/convergence/contact_changes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::fixed_number;
using solver::readable_number;
using Kind = ContactChange::Kind;

constexpr double kMicro = 1e6;

// Peak, valley, peak, ..., peak.
std::vector<double> turn_times(const solver::CaseResult& result) {
  std::vector<double> times;
  for (std::size_t i = 0; i + 1 < result.phases.size(); ++i) {
    times.push_back(result.phases[i].t1_s);
  }
  return times;
}

// Start, end, start, ..., end. A contact that begins or ends in stick has these ends too, so that
// lengths are even whatever the first and the last state.
std::vector<double> stick_times(const solver::CaseResult& result) {
  std::vector<double> times;
  for (const auto& stick : result.stick_intervals) {
    times.insert(times.end(), {stick.t0_s, stick.t1_s});
  }
  return times;
}

void add_lone(std::vector<ContactChange>& changes, const std::vector<double>& coarser,
              const std::vector<double>& finer, Kind even, Kind odd) {
  const bool in_finer = finer.size() > coarser.size();
  const auto& longer = in_finer ? finer : coarser;
  for (const std::size_t i : lone_pairs(longer, in_finer ? coarser : finer)) {
    changes.push_back({i % 2 == 0 ? even : odd, longer[i], longer[i + 1], in_finer});
  }
}

const char* cause_of(Kind kind) {
  switch (kind) {
    case Kind::kStick:
      return "P's velocity grazes 0";
    case Kind::kSlip:
      return "|F_t| grazes mu F_n";
    default:
      return "V_n grazes 0";
  }
}

}  // namespace

std::vector<std::size_t> lone_pairs(const std::vector<double>& longer,
                                    const std::vector<double>& shorter) {
  const std::size_t columns = shorter.size() + 1;
  // cost[i * columns + j]: the first i of `longer` against the first j of `shorter`.
  std::vector<double> cost((longer.size() + 1) * columns, std::numeric_limits<double>::infinity());
  cost[0] = 0.0;
  const auto matched = [&](std::size_t i, std::size_t j) {
    return i > 0 && j > 0
               ? cost[(i - 1) * columns + j - 1] + std::abs(longer[i - 1] - shorter[j - 1])
               : std::numeric_limits<double>::infinity();
  };
  const auto skipped = [&](std::size_t i, std::size_t j) {
    return i > 1 ? cost[(i - 2) * columns + j] : std::numeric_limits<double>::infinity();
  };
  for (std::size_t i = 1; i <= longer.size(); ++i) {
    for (std::size_t j = 0; j < columns; ++j) {
      cost[i * columns + j] = std::min(matched(i, j), skipped(i, j));
    }
  }
  std::vector<std::size_t> lone;
  std::size_t i = longer.size();
  std::size_t j = shorter.size();
  while (i > 0) {
    if (matched(i, j) <= skipped(i, j)) {
      --i;
      --j;
    } else {
      i -= 2;
      lone.push_back(i);
    }
  }
  std::reverse(lone.begin(), lone.end());
  return lone;
}

std::vector<ContactChange> changes_between(const solver::CaseResult& coarser,
                                           const solver::CaseResult& finer) {
  std::vector<ContactChange> changes;
  add_lone(changes, turn_times(coarser), turn_times(finer), Kind::kRestitution, Kind::kCompression);
  if (changes.empty()) {
    for (std::size_t i = 0; i < coarser.peaks.size() && i < finer.peaks.size(); ++i) {
      if (coarser.peaks[i].major != finer.peaks[i].major) {
        const double t_s = finer.peaks[i].t_s;
        changes.push_back({Kind::kRipple, t_s, t_s, finer.peaks[i].major});
      }
    }
  }
  add_lone(changes, stick_times(coarser), stick_times(finer), Kind::kStick, Kind::kSlip);
  return changes;
}

const char* name_of(Kind kind) {
  switch (kind) {
    case Kind::kCompression:
      return "compression";
    case Kind::kRestitution:
      return "restitution";
    case Kind::kStick:
      return "stick";
    case Kind::kSlip:
      return "slip";
    default:
      return "ripple";
  }
}

std::string described(const ContactChange& change) {
  if (change.kind == Kind::kRipple) {
    return fmt::format("a peak of F_n at {} us, near the depth at which ripples are merged",
                       fixed_number(change.t0_s * kMicro, 2));
  }
  return fmt::format("a {} of {} us, from {} to {} us ({})", name_of(change.kind),
                     readable_number((change.t1_s - change.t0_s) * kMicro, 3),
                     fixed_number(change.t0_s * kMicro, 2), fixed_number(change.t1_s * kMicro, 2),
                     cause_of(change.kind));
}

}  // namespace oblique::client
