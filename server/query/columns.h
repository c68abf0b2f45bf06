#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/cell.h"

namespace oblique::server {

/// One column of queries or one member of `solve --json`.
struct Column {
  std::string name;
  std::string unit;        ///< SI; empty for pure numbers and texts
  std::string kind;        ///< input, output, row (about the row), element or function
  std::string solve_json;  ///< where `solve --json` has it, as energy.friction_J; empty: nowhere
  std::string meaning;     ///< one line; for inputs with what is allowed, for outputs with the sign
};

/// All columns, in the order of listings: inputs, outputs, columns about the row.
const std::vector<Column>& all_columns();

/// The column of the input `key`. SQL takes E for e, so the column of E is E_Pa.
std::string column_of_key(std::string_view key);

/// The same, elements of lists, and functions: all that a query may name.
std::vector<Column> columns_and_functions();

/// A list that queries have beside the columns of the view `runs`, and its expression over the
/// columns of a table called `runs`.
struct ListColumn {
  std::string name;
  std::string sql;
};
const std::vector<ListColumn>& lists_of_queries();

/// The unit of a column, or of a member of `solve --json`; empty for pure numbers, texts, lists of
/// several quantities and other names.
std::string unit_of_column(std::string_view name);

/// The kind of the values of a column that are not NULL; kNull for other names.
protocol::CellKind kind_of_values(std::string_view name);

}  // namespace oblique::server
