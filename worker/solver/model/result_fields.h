#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "worker/solver/model/case_result.h"

namespace oblique::solver {

// What solving a point gives, as one table. Messages, database rows and their checks, `solve
// --json`, tables for people and `oblique columns` walk it, so that an output is named once.

/// A member of a CaseResult, or of a struct in one: a T, or a std::optional<T> where results may
/// lack it. What is absent is NULL in the database, null in JSON and nothing in tables.
template <class T>
struct Member {
  using Value = T;
  const T* (*of)(const CaseResult& result);  ///< nullptr: the result lacks it
  /// A result that lacks it has it from then on. nullptr: it follows from a list.
  T& (*in)(CaseResult& result);
  bool may_be_absent = false;
};

/// One value of an element of a list. `bool` is 1 or 0 in JSON.
using Cell = std::variant<double, bool, std::string_view>;
using TakeElement = std::function<void(std::span<const Cell> element)>;

/// A list that a result has. A column of the database packs it as a JSON array with an array for
/// each element.
struct ResultList {
  std::string_view column;
  std::string_view unit;
  std::string_view meaning;
  std::span<const std::string_view> members;  ///< what an element's values are called, in order
  /// Gives `take` the elements in order.
  void (*each)(const CaseResult& result, const TakeElement& take);
  bool has_names = true;  ///< elements of `solve --json` and `query` are objects, else arrays
};

/// A list of outputs made of a ResultList: the list itself, or one member of its elements.
struct ListPart {
  const ResultList* list;
  std::string_view member = {};  ///< empty: whole elements
  std::string_view where = {};  ///< a member that is true in the elements that count; empty: all do
};

/// What brings a value from a worker to the database.
enum class SentWith {
  kResult,  ///< each result's message
  kPeaks,   ///< it follows from the result's list of peaks
  kModel,   ///< it is a parameter of the study's model
  kWorker,  ///< the worker tells it once for all its results
};

/// One output of a solved point: what it is called, in which unit it stands, what it means, and
/// where a CaseResult has it.
struct ResultField {
  std::string_view name;           ///< in `solve --json`, inside `group`
  std::string_view group = {};     ///< the object of `solve --json` that holds it; empty: none
  std::string_view column = name;  ///< of the view `runs` and of queries
  std::string_view unit = {};      ///< SI; empty for pure numbers and texts
  std::string_view meaning = {};   ///< one line, the sign included
  std::variant<Member<double>, Member<std::int64_t>, Member<std::string>, ListPart> value;
  std::string_view shown_unit = unit;  ///< in which tables for people show it
  double shown_per_unit = 1.0;         ///< so many shown units are one `unit`
  SentWith sent_with = SentWith::kResult;
};

/// All outputs in the order in which `solve --json` has them. Of each type those that are
/// SentWith::kResult travel in this order; a new one may stand anywhere.
std::span<const ResultField> result_fields();

/// All lists, in the order in which rows have them.
std::span<const ResultList* const> result_lists();

/// The field with that column, or nullptr.
const ResultField* find_result_column(std::string_view column);

/// The list with that column, or nullptr.
const ResultList* find_result_list(std::string_view column);

/// Calls `take` with each field of type T that a row of a result has, and its member.
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

/// The same with each that is sent with a result.
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
