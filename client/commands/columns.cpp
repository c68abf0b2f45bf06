#include <fnmatch.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/io/row_output.h"
#include "proto/text.h"
#include "server/query/columns.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::client {
namespace {

constexpr const char* kListColumnsExamples = R"(Examples:
  oblique columns
  oblique columns fn_peak_N
  oblique columns "*peak*"                  a pattern: * is any text, ? any character
  oblique columns --format csv
  oblique columns --trace                   columns of the files that `oblique trace` writes

Lists the columns of `oblique query` and their names in `oblique solve --json`, then the elements
of lists, counted from 0, and the functions that `oblique query` accepts. Values are in SI units.
Tables show short times in us or ms and slides in mm; the heading gives the unit. x points from the
pin to the released tip, y up. Times of a contact count from touch.)";

/// Returns the columns that match `pattern`; an empty pattern matches all. Throws
/// solver::InputError if none match.
std::vector<server::Column> columns_like(const std::string& pattern) {
  auto columns = server::columns_and_functions();
  if (pattern.empty()) {
    return columns;
  }
  std::vector<std::string_view> names;
  for (const auto& column : columns) {
    names.push_back(column.name);
  }
  const auto nearest = protocol::did_you_mean(pattern, names);
  std::vector<server::Column> found;
  std::copy_if(
      columns.begin(), columns.end(), std::back_inserter(found), [&](const server::Column& column) {
        // The pattern may also be the name of a function without its arguments.
        return column.name == pattern || fnmatch(pattern.c_str(), column.name.c_str(), 0) == 0 ||
               column.name.starts_with(pattern + "(");
      });
  if (found.empty()) {
    throw solver::InputError(
        fmt::format("there is no column {}{}; `oblique columns` lists all", pattern, nearest));
  }
  return found;
}

/// Returns the names of numbered columns as trace files contain them: "R0x_N, R0y_N, R1x_N, ...".
std::string names_of(const solver::TraceColumn& column) {
  const std::size_t space = column.name.find(' ');
  if (space == std::string_view::npos) {
    return std::string(column.name);
  }
  const std::string_view x = column.name.substr(0, space);
  const std::string_view y = column.name.substr(space + 1);
  return fmt::format(fmt::runtime("{}, {}, {}, ..."), fmt::format(fmt::runtime(x), 0),
                     fmt::format(fmt::runtime(y), 0), fmt::format(fmt::runtime(x), 1));
}

struct ColumnsFlags {
  std::string pattern;
  std::string format{"table"};
  bool trace = false;
};

int list_columns(const ColumnsFlags& flags, Console&) {
  const Format format = format_named(flags.format);
  protocol::Table table;
  if (flags.trace) {
    table.columns = {"column", "unit", "meaning"};
    for (const auto& column : solver::trace_columns()) {
      table.rows.push_back(
          {names_of(column), std::string(column.unit), std::string(column.meaning)});
    }
  } else {
    table.columns = {"column", "unit", "kind", "solve --json", "meaning"};
    for (const auto& column : columns_like(flags.pattern)) {
      table.rows.push_back(
          {column.name, column.unit, column.kind, column.solve_json, column.meaning});
    }
  }
  print_out(table, format);
  return kDone;
}

}  // namespace

void add_columns(CLI::App& app, Action& parsed) {
  auto [command, flags] =
      new_command(app, parsed, "columns", "Name, unit and meaning of every input and output",
                  kListColumnsExamples, list_columns);
  command.add_option("COLUMN", flags.pattern, "a column, or a pattern with * and ?; default: all")
      ->type_name("");
  command.add_flag("--trace", flags.trace, "list the columns of `oblique trace`");
  add_format_flag(command, flags.format);
}

}  // namespace oblique::client
