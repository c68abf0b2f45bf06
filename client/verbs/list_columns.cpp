#include <iostream>
#include <memory>
#include <string>

#include "client/output/printer.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"
#include "server/asking/columns.h"

namespace oblique::client {
namespace {

constexpr const char* kListColumnsExamples = R"(Examples:
  oblique columns
  oblique columns --format csv

Inputs and outputs: columns of `oblique query`, and where `oblique solve --json` has them. Values
are in SI units; tables show short times in us or ms and slides in mm, and say so in the heading.
x points from the pin to the released tip, y up; times of a contact count from touch.)";

int list_columns(const std::string& format) {
  protocol::QueryReply table;
  for (const char* heading : {"column", "unit", "kind", "solve --json", "meaning"}) {
    table.add_columns(heading);
  }
  for (const auto& column : server::all_columns()) {
    auto& row = *table.add_rows();
    add_value(row, column.name);
    add_value(row, column.unit);
    add_value(row, column.kind);
    add_value(row, column.solve_json);
    add_value(row, column.meaning);
  }
  print(std::cout, table, format_named(format));
  return kDone;
}

}  // namespace

void add_columns(CLI::App& app, Command& command) {
  auto format = std::make_shared<std::string>("table");
  auto* verb = app.add_subcommand("columns", "Name, unit and meaning of every input and output");
  verb->footer(kListColumnsExamples);
  add_format_flag(*verb, *format);
  verb->callback([format, &command] { command = [format] { return list_columns(*format); }; });
}

}  // namespace oblique::client
