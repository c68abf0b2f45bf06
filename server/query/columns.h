#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/wire/cell.h"

namespace oblique::server {

/// What is known of one column of queries or one member of `solve --json`.
struct Column {
  std::string name;
  std::string unit;  ///< SI; empty for pure numbers and texts
  /// input, output, or row: about the row in the database; of listings also element and function
  std::string kind;
  std::string solve_json;  ///< where `solve --json` has it, as energy.friction_J; empty: nowhere
  std::string meaning;     ///< one line; for inputs with what is allowed, for outputs with the sign
};

/// All of them, in the order of listings: inputs, outputs, what else a row tells.
const std::vector<Column>& all_columns();

/// The column of an input that users call `key`. SQL does not tell E from e: that one is E_Pa.
std::string column_of_key(std::string_view key);

/// The same, and what else questions may be made of: elements of lists, and functions.
std::vector<Column> columns_and_functions();

/// What `query` selects from, in parentheses: the view `runs`, with the lists that `solve --json`
/// has and the view packs otherwise.
std::string rows_of_queries();

/// A list that questions have beside the columns of `runs`: its name, and the expression for SQL
/// over a view or table that is called `runs`.
struct ListColumn {
  std::string name;
  std::string sql;
};
std::vector<ListColumn> lists_of_queries();

/// The unit of a column, or of a member of `solve --json`; empty for pure numbers, texts, lists of
/// several quantities and other names.
std::string unit_of_column(std::string_view name);

/// What the values of a column of queries are where they are not NULL; kNull for other names.
protocol::CellKind kind_of_values(std::string_view name);

}  // namespace oblique::server
