#pragma once

#include <string>

#include "server/database/sqlite.h"

namespace oblique::server {

/// The columns of `results` that say the same thing twice, as a list for SQL; `reaction_peaks`
/// follows them.
inline constexpr const char* kArrayColumns =
    "duration_s, fn_peak_N, ft_peak_N, stick_total_s, mode, peaks, ft_peaks, phases,"
    " stick_intervals";

/// Why the arrays of a solved row cannot be right, or an empty text: one that is not the JSON that
/// schema.sql describes, instants that do not ascend, phases with gaps or in another order than the
/// mode's, a largest force, duration or time in stick that is not the arrays'. The columns stand
/// from `first` on in the present row of `row`: kArrayColumns, then reaction_peaks, which may be
/// NULL.
std::string fault_of_arrays(const Statement& row, int first);

}  // namespace oblique::server
