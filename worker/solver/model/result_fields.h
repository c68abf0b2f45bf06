#pragma once

#include <span>
#include <string_view>

namespace oblique::solver {

/// One output of a solved point: what it is called, in which unit it stands, and what it means.
/// Printed results, database columns and their documentation go by these names.
struct ResultField {
  std::string_view name;               ///< in `solve --json`, inside `group`
  std::string_view group;              ///< the object of `solve --json` that holds it; empty: none
  std::string_view column;             ///< of the view `runs` and of queries
  std::string_view unit;               ///< SI; empty for pure numbers and texts
  std::string_view meaning;            ///< one line, the sign included
  bool is_list;                        ///< a JSON array, packed as text in the database
  std::string_view shown_unit = unit;  ///< in which tables for people show it
  double shown_per_unit = 1.0;         ///< so many shown units are one `unit`
};

/// All outputs in the order in which `solve --json` has them.
std::span<const ResultField> result_fields();

/// The field with that column, or nullptr.
const ResultField* find_result_column(std::string_view column);

}  // namespace oblique::solver
