#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/chunk.h"

namespace oblique::server {

/// One column of queries or one member of `solve --json`.
struct Column {
  std::string name;
  std::string unit;        ///< SI; empty for pure numbers and texts
  std::string kind;        ///< input, output, row (a property of the row), element or function
  std::string solve_json;  ///< member of `solve --json`, such as energy.friction_J; empty: none
  std::string meaning;     ///< one line, with the allowed values of inputs and the sign of outputs
  protocol::CellKind values = protocol::CellKind::kText;  ///< kind of the values that are not NULL
  /// whether the table `results` has it in the same form as the view `runs`
  bool is_stored = false;
  std::string sql = {};  ///< expression over the columns of `runs`
};

/// All columns, in the order of listings: inputs, outputs, properties of the row.
const std::vector<Column>& all_columns();

/// The column of that name; nullptr if there is none.
const Column* find_column(std::string_view name);

/// The column of the input `key`: E_Pa for E, because SQL does not distinguish E from e, else the
/// key itself.
std::string column_of_key(std::string_view key);

/// All columns, elements of lists, and functions: everything that a query may name.
std::vector<Column> columns_and_functions();

/// Whether the values of a column are lists, as JSON arrays.
bool is_list_column(std::string_view name);

/// Whether the values of a column are lists of numbers.
bool is_list_of_numbers(std::string_view name);

/// The unit of a column; empty for pure numbers, texts, lists of several quantities and other
/// names.
std::string unit_of_column(std::string_view name);

/// The unit of a member of the elements of a list, such as t_s.
std::string unit_of_member(std::string_view member);

/// The kind of the values of a column that are not NULL; kNull for an unknown name.
protocol::CellKind kind_of_values(std::string_view name);

/// The default columns of a query: the point, the axes that vary in the study, and the main
/// outputs. A recipe without blocks counts as one with the axes H, mu and e.
std::vector<std::string> usual_columns(const protocol::Recipe& recipe);

}  // namespace oblique::server
