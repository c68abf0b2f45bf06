#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace oblique::server {

/// Throws solver::InputError, naming `flag`, when an item of `text`, which asks for a row a group,
/// has one of `columns` that is neither gathered by a function nor among the items of `group`: SQL
/// would take its value from any row. The texts passed check_sql_part.
void check_gathered(std::string_view flag, std::string_view text, std::string_view group,
                    const std::vector<std::string>& columns,
                    const std::vector<std::string>& names_given);

/// Throws solver::InputError, naming `flag`, when a function in `text` gathers all rows into one
/// and an item of it has one of `columns` beside that, whose value SQL would take from any row.
void check_gathered_into_one(std::string_view flag, std::string_view text,
                             const std::vector<std::string>& columns);

/// Throws solver::InputError, naming `flag`, when a function in `text` that computes with numbers
/// is given a column of texts or lists, which SQL would take for 0, or min() or max() one of lists.
/// `names_given` are other than the columns of these names.
void check_numbers(std::string_view flag, std::string_view text,
                   const std::vector<std::string>& names_given);

/// Whether each row that `selected` gives is one of a point: no function gathers, and no row is
/// left out for being like another.
bool gives_points(std::string_view selected);

}  // namespace oblique::server
