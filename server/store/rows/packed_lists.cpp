#include "server/store/rows/packed_lists.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>

namespace oblique::server {
namespace {

constexpr double kLargestWhole = 9007199254740992.0;  // 2^53: every whole number below is a double

/// Writes one array, number by number.
class ArrayText {
 public:
  ArrayText(const StoredDigits& digits, std::string& to)
      : to_(to), time_(digits.decimals(kListTime)), force_(digits.decimals(kListForce)) {
    to_ = '[';
  }
  ~ArrayText() { to_ += ']'; }
  ArrayText(const ArrayText&) = delete;
  ArrayText& operator=(const ArrayText&) = delete;

  void time(double t_s) { add(t_s * kListTime.per_unit, time_); }
  void force(double force_N) { add(force_N * kListForce.per_unit, force_); }
  void ripple(double force_N) {
    // One of no height has a unit, for there is no minus nought.
    add(std::min(-force_N * kListForce.per_unit, -1.0), force_);
  }

 private:
  void add(double value, int decimals) {
    std::array<char, 40>
        text;  // the longest: -2.2250738585072014e-308, or 16 digits and 5 decimals
    char* end = text.data();
    if (to_.size() > 1) {
      *end++ = ',';
    }
    char* const limit = text.data() + text.size();
    if (decimals == StoredDigits::kAllDigits || !(std::abs(value) < kLargestWhole)) {
      end = std::to_chars(end, limit, value).ptr;
    } else if (decimals == 0) {
      end = std::to_chars(end, limit, static_cast<std::int64_t>(std::round(value))).ptr;
    } else {
      end = std::to_chars(end, limit, value, std::chars_format::fixed, decimals).ptr;
    }
    to_.append(text.data(), end);
  }

  std::string& to_;
  int time_;
  int force_;
};

}  // namespace

void pack_peaks(const solver::CaseResult& result, const StoredDigits& digits, std::string& to) {
  ArrayText array(digits, to);
  for (const solver::Peak& peak : result.peaks) {
    array.time(peak.t_s);
    if (peak.major) {
      array.force(peak.fn_N);
    } else {
      array.ripple(peak.fn_N);
    }
    array.force(peak.ft_N);
  }
}

void pack_ft_peaks(const solver::CaseResult& result, const StoredDigits& digits, std::string& to) {
  ArrayText array(digits, to);
  for (const solver::TangentialPeak& peak : result.ft_peaks) {
    array.time(peak.t_s);
    array.force(peak.ft_N);
  }
}

void pack_phases(const solver::CaseResult& result, const StoredDigits& digits, std::string& to) {
  ArrayText array(digits, to);
  for (std::size_t i = 0; i + 1 < result.phases.size(); ++i) {
    array.time(result.phases[i].t1_s);
  }
}

void pack_stick_intervals(const solver::CaseResult& result, const StoredDigits& digits,
                          std::string& to) {
  ArrayText array(digits, to);
  for (const solver::StickInterval& interval : result.stick_intervals) {
    array.time(interval.t0_s);
    array.time(interval.t1_s);
  }
}

void pack_reaction_peaks(const solver::CaseResult& result, const StoredDigits& digits,
                         std::string& to) {
  ArrayText array(digits, to);
  for (const solver::ReactionPeak& peak : result.reaction_peaks) {
    array.time(peak.t_s);
    array.force(peak.force_N);
  }
}

bool ft_peaks_are_those_of_peaks(const solver::CaseResult& result) {
  return std::equal(result.peaks.begin(), result.peaks.end(), result.ft_peaks.begin(),
                    result.ft_peaks.end(),
                    [](const solver::Peak& peak, const solver::TangentialPeak& ft_peak) {
                      return peak.t_s == ft_peak.t_s && peak.ft_N == ft_peak.ft_N;
                    });
}

}  // namespace oblique::server
