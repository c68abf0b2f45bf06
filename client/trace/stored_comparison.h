#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "client/service/source.h"
#include "proto/wire/chunk.h"
#include "worker/solver/model/case_result.h"

namespace oblique::client {

/// The row of one point in the view `runs`.
struct StoredRow {
  std::map<std::string, protocol::Value> values;  ///< by column

  /// The text of a column; empty where it is NULL or missing.
  std::string text(const std::string& column) const;
  bool has_failed() const { return text("status") == "failed"; }
};

/// The row of that point; nothing: it is not solved yet.
std::optional<StoredRow> stored_row(Source& source, const std::string& study, std::uint64_t point);

/// Names the outputs in which the stored row differs from `result`, the same point solved again:
/// scalars in any bit, numbers in lists in one of the 8 digits that a database keeps; `wall_s` is
/// left out. As "fn_peak_N, mode: stored by solver 0.1, now by 0.2"; empty: there are none.
std::string differences_in_words(const StoredRow& stored, const solver::CaseResult& result);

}  // namespace oblique::client
