#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/service/source.h"
#include "proto/oblique.pb.h"
#include "proto/wire/chunk.h"
#include "worker/solver/model/case_result.h"

namespace oblique::client {

/// What a database has of one point.
class StoredRow {
 public:
  /// `rows`: of the view `runs`, one row at most.
  explicit StoredRow(protocol::Table rows) : rows_(std::move(rows)) {}

  /// The value of that column of the view `runs`; nothing: the view has no such column.
  std::optional<protocol::Value> value(const std::string& column) const;
  /// The text of a column; empty where it is NULL or missing.
  std::string text(const std::string& column) const;
  bool has_failed() const { return text("status") == "failed"; }

 private:
  protocol::Table rows_;
};

/// The row of that point; nothing: it is not solved yet.
std::optional<StoredRow> stored_row(Source& source, const std::string& study, std::uint64_t point);

/// The outputs, by column, in which the stored row differs from `result`, the same point solved
/// again: scalars in any bit, numbers in lists in one of the 8 digits that a database keeps. The
/// time that the solver took is left out.
std::vector<std::string> differences(const StoredRow& stored, const solver::CaseResult& result);

/// The same for people: "fn_peak_N, mode: stored by solver 0.1, now by 0.2"; empty: there are none.
std::string differences_in_words(const StoredRow& stored, const solver::CaseResult& result);

}  // namespace oblique::client
