#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace oblique::server {

/// What a flag's text is to be in the statement that it becomes a part of.
enum class SqlPart {
  kCondition,  ///< one expression, as after WHERE
  kColumns,    ///< expressions between commas, each with a name of its own if need be
  kGroup,      ///< expressions between commas
  kOrder,      ///< expressions between commas, each with ASC or DESC if need be
};

/// Throws solver::InputError, naming `flag`, the text and what is allowed, unless `text` is a whole
/// `part` in SQLite's dialect, so that nothing in it reaches what stands around it: every bracket
/// and quote is closed, there is no comment, parameter or semicolon, and no other clause begins
/// outside brackets. Whether the names in it exist is SQLite's to say.
void check_sql_part(std::string_view flag, std::string_view text, SqlPart part);

/// SQL takes E for e. Throws solver::InputError, with the right name, for a name in `text` that
/// differs from one of `columns` only in case. Functions, names that are given with AS, and names
/// of tables may be anything, as may what `names_given` holds. `text` has passed check_sql_part.
void check_case_of_columns(std::string_view flag, std::string_view text,
                           const std::vector<std::string>& columns,
                           const std::vector<std::string>& names_given = {});

/// The names that `text` gives its columns with AS.
std::vector<std::string> names_given_in(std::string_view text);

/// A text as SQL writes it, in single quotes.
std::string sql_text(const std::string& text);

}  // namespace oblique::server
