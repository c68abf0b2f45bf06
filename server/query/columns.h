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
  std::string kind;        ///< input, output, row (properties of the row), element or function
  std::string solve_json;  ///< member of `solve --json`, such as energy.friction_J; empty: none
  std::string meaning;     ///< one line; for inputs the allowed values, for outputs the sign
  protocol::CellKind values = protocol::CellKind::kText;  ///< kind of values other than NULL
  bool is_stored = false;  ///< the table `results` has it in the form of the view `runs`
  std::string sql = {};    ///< expression over the columns of `runs`
};

/// All columns, in the order of listings: inputs, outputs, properties of the row.
const std::vector<Column>& all_columns();

/// The column of that name; nullptr: none.
const Column* find_column(std::string_view name);

/// The column of the input `key`. SQL does not distinguish E from e, so the column of E is E_Pa.
std::string column_of_key(std::string_view key);

/// All columns, elements of lists, and functions: everything that a query may name.
std::vector<Column> columns_and_functions();

/// Whether the values of a column are lists, as JSON arrays.
bool is_list_column(std::string_view name);

/// Whether they are lists of numbers.
bool is_list_of_numbers(std::string_view name);

/// The unit of a column; empty for pure numbers, texts, lists of several quantities and other
/// names.
std::string unit_of_column(std::string_view name);

/// The unit of a member of the elements of a list, such as t_s.
std::string unit_of_member(std::string_view member);

/// The kind of the values of a column other than NULL; kNull for an unknown name.
protocol::CellKind kind_of_values(std::string_view name);

/// The columns of a query that selects none: the point, the axes that vary in the study, and the
/// main outputs. Without a block in the recipe H, mu and e stand for the axes.
std::vector<std::string> usual_columns(const protocol::Recipe& recipe);

}  // namespace oblique::server
