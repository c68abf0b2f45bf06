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
};

/// All columns, in the order of listings: inputs, outputs, properties of the row.
const std::vector<Column>& all_columns();

/// The column of the input `key`. SQL does not distinguish E from e, so the column of E is E_Pa.
std::string column_of_key(std::string_view key);

/// All columns, elements of lists, and functions: everything that a query may name.
std::vector<Column> columns_and_functions();

/// A list that queries may name in addition to the columns of the view `runs`, and its SQL
/// expression over the columns of `runs`.
struct ListColumn {
  std::string name;
  std::string sql;
};
const std::vector<ListColumn>& lists_of_queries();

/// The unit of a column, or of a member of `solve --json`; empty for pure numbers, texts, lists of
/// several quantities and other names.
std::string unit_of_column(std::string_view name);

/// The kind of the values of a column other than NULL; kNull for an unknown name.
protocol::CellKind kind_of_values(std::string_view name);

}  // namespace oblique::server
