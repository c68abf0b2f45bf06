#include "client/io/tables.h"

#include <spdlog/fmt/fmt.h>

#include "client/io/row_output.h"
#include "client/io/sink.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client {
namespace {

/// Whether a name ends in its unit, as vt_in_m_s and impulse_n_Ns do.
bool ends_in_unit(const std::string& name, const std::string& unit) {
  std::string suffix = "_";
  for (const char letter : unit) {
    if (letter != ' ' && letter != '^') {
      suffix += letter == '/' ? '_' : letter;
    }
  }
  return name.ends_with(suffix);
}

}  // namespace

ShownColumn shown_column(const std::string& name, const std::string& unit) {
  const auto* field = solver::find_result_column(name);
  if (field != nullptr && field->shown_per_unit != 1.0) {
    return {fmt::format("{} [{}]", name, field->shown_unit), field->shown_per_unit};
  }
  return {unit.empty() || ends_in_unit(name, unit) ? name : fmt::format("{} [{}]", name, unit)};
}

std::vector<ShownColumn> shown_columns(const protocol::QueryReply& chunk) {
  std::vector<ShownColumn> shown;
  for (int i = 0; i < chunk.columns_size(); ++i) {
    shown.push_back(
        shown_column(chunk.columns(i), i < chunk.units_size() ? chunk.units(i) : std::string()));
  }
  return shown;
}

void print(std::ostream& out, const protocol::Table& rows, Format format) {
  out << text_of({protocol::chunk_of(rows)}, {.format = format});
}

void print_out(const protocol::Table& rows, Format format) {
  RowOutput out({.format = format, .may_page = false, .may_leave_out = false});
  out.print(protocol::chunk_of(rows));
  out.finish();
}

}  // namespace oblique::client
