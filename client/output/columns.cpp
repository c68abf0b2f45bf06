#include "client/output/columns.h"

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/result_fields.h"

namespace oblique::client {

namespace {

/// Whether a name says its unit at its end, as vt_in_m_s and impulse_n_Ns do.
bool says_unit(const std::string& name, const std::string& unit) {
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
  return {unit.empty() || says_unit(name, unit) ? name : fmt::format("{} [{}]", name, unit)};
}

std::vector<ShownColumn> shown_columns(const protocol::QueryReply& chunk) {
  std::vector<ShownColumn> shown;
  for (int i = 0; i < chunk.columns_size(); ++i) {
    shown.push_back(
        shown_column(chunk.columns(i), i < chunk.units_size() ? chunk.units(i) : std::string()));
  }
  return shown;
}

}  // namespace oblique::client
