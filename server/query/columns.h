#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/chunk.h"

namespace oblique::server {

/// A column of a query, or a member of the object that `solve --json` prints.
struct Column {
  std::string name;
  std::string unit;        ///< SI unit; empty for pure numbers and texts
  std::string kind;        ///< input, output, row (a property of the row), element or function
  std::string solve_json;  ///< path in `solve --json`, such as energy.friction_J; or empty
  /// one line; for an input with the allowed values, for an output with the positive direction
  std::string meaning;
  protocol::CellKind values = protocol::CellKind::kText;  ///< kind of all values except NULL
  /// true if the table `results` has the column in the same form as the view `runs`
  bool is_stored = false;
  std::string sql = {};  ///< SQL expression over the columns of `runs`
};

/// Returns all columns, in the order of listings: inputs, outputs, properties of the row.
const std::vector<Column>& all_columns();

/// Returns the column called `name`; nullptr for an unknown name.
const Column* find_column(std::string_view name);

/// Returns the column of the input `key`. This is the key itself, except E_Pa for E, because SQL
/// ignores case and e is another key.
std::string column_of_key(std::string_view key);

/// Replaces the inputs of a point, as this machine computes them from the recipe, by those of its
/// row in `runs`, which a worker solved and which may differ in the last bits. `row` has no row if
/// the point is not solved. Values that differ by more are those of a damaged row, and ignored.
void use_stored_inputs(const protocol::Table& row, protocol::TraceReply& inputs);

/// Returns everything that a query may name: all columns, elements of lists, and functions.
std::vector<Column> columns_and_functions();

/// Returns whether the values of a column are lists, which are stored as JSON arrays.
bool is_list_column(std::string_view name);

/// Returns whether the values of a column are lists of numbers.
bool is_list_of_numbers(std::string_view name);

/// Returns the unit of a column; empty for numbers without unit, texts, mixed lists and unknown
/// names.
std::string unit_of_column(std::string_view name);

/// Returns the unit of a member of list elements, such as "s" for t_s.
std::string unit_of_member(std::string_view member);

/// Returns the kind of a column's values, ignoring NULL; kNull for an unknown name.
protocol::CellKind kind_of_values(std::string_view name);

/// Returns the default columns of a query: the point, the axes that vary in the study, and the main
/// outputs. A recipe without blocks is treated as if H, mu and e varied.
std::vector<std::string> usual_columns(const protocol::Recipe& recipe);

}  // namespace oblique::server
