#pragma once

#include <string>

#include "server/store/rows/stored_units.h"
#include "worker/solver/model/case_result.h"

// Lists of a result as `packed_results` has them: JSON arrays of plain numbers, in units of
// kListTime and kListForce.
namespace oblique::server {

/// t, fn, ft of each peak in turn; fn of a ripple is negative.
void pack_peaks(const solver::CaseResult& result, const StoredDigits& digits, std::string& to);
/// t, ft in turn.
void pack_ft_peaks(const solver::CaseResult& result, const StoredDigits& digits, std::string& to);
/// The instants between two phases. The first one begins at 0 and the last ends with the contact.
void pack_phases(const solver::CaseResult& result, const StoredDigits& digits, std::string& to);
/// t0, t1 in turn.
void pack_stick_intervals(const solver::CaseResult& result, const StoredDigits& digits,
                          std::string& to);
/// t, force in turn.
void pack_reaction_peaks(const solver::CaseResult& result, const StoredDigits& digits,
                         std::string& to);

/// Whether the tangential peaks are those of the normal force, as wherever the tip slips all the
/// time: then they are not stored again.
bool ft_peaks_are_those_of_peaks(const solver::CaseResult& result);

}  // namespace oblique::server
