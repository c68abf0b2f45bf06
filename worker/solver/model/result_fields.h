#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "worker/solver/model/case_result.h"

namespace oblique::solver {

/// A member of a CaseResult or of a struct in it, of type T or std::optional<T>.
template <class T>
struct Member {
  using Value = T;
  const T* (*of)(const CaseResult& result);  ///< null if the member is absent
  T& (*in)(CaseResult& result);  ///< creates the member; null if the value is taken from a list
  bool may_be_absent = false;
};

/// One value of an element of a list. A `bool` is 1 or 0 in JSON.
using Cell = std::variant<double, bool, std::string_view>;
using TakeElement = std::function<void(std::span<const Cell> element)>;

/// A list of a result. Its database column contains a JSON array of arrays, one for each element.
struct ResultList {
  std::string_view column;
  std::string_view unit;
  std::string_view meaning;
  std::span<const std::string_view> members;  ///< names of an element's values
  /// Calls `take` with each element in order.
  void (*each)(const CaseResult& result, const TakeElement& take);
  bool has_names = true;  ///< true: elements in JSON for users are objects; false: arrays
};

/// An output that consists of the elements of a ResultList, or of one member of each.
struct ListPart {
  const ResultList* list;
  std::string_view member = {};  ///< empty: whole elements
  std::string_view where = {};   ///< selects elements whose member of this name is true
};

/// The origin of a value in the database.
enum class SentWith {
  kResult,  ///< the message of each result
  kPeaks,   ///< the result's list of peaks
  kModel,   ///< the study's model
  kWorker,  ///< the worker's first message
};

/// One output of a solved point.
struct ResultField {
  std::string_view name;           ///< name of the output in `solve --json`
  std::string_view group = {};     ///< object of `solve --json` that contains the output; or empty
  std::string_view column = name;  ///< name of the column in the view `runs` and in queries
  std::string_view unit = {};      ///< SI; empty for pure numbers and texts
  std::string_view meaning = {};   ///< in one line; says which direction is positive
  std::variant<Member<double>, Member<std::int64_t>, Member<std::string>, ListPart> value;
  std::string_view shown_unit = unit;  ///< in tables for people
  double shown_per_unit = 1.0;         ///< number of shown units in one `unit`
  SentWith sent_with = SentWith::kResult;
};

/// All outputs in the order of `solve --json`. Messages contain the SentWith::kResult outputs of
/// each type in this order.
std::span<const ResultField> result_fields();

/// All lists, in the order of their columns.
std::span<const ResultList* const> result_lists();

/// Returns nullptr for an unknown column.
const ResultField* find_result_column(std::string_view column);

/// Returns nullptr for an unknown column.
const ResultList* find_result_list(std::string_view column);

/// Calls `take(field, member)` for each field of type T that is stored in a database row.
template <class T, class Take>
void for_each_stored(const Take& take) {
  for (const ResultField& field : result_fields()) {
    const auto* member = std::get_if<Member<T>>(&field.value);
    if (member != nullptr &&
        (field.sent_with == SentWith::kResult || field.sent_with == SentWith::kPeaks)) {
      take(field, *member);
    }
  }
}

/// Calls `take(field, member)` for each field of type T in the message of a result.
template <class T, class Take>
void for_each_sent(const Take& take) {
  for_each_stored<T>([&](const ResultField& field, const Member<T>& member) {
    if (field.sent_with == SentWith::kResult) {
      take(field, member);
    }
  });
}

/// Whether every number of a result is finite.
bool is_finite(const CaseResult& result);

}  // namespace oblique::solver
