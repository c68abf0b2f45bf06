#include "client/output/columns.h"

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/result_fields.h"

namespace oblique::client {

ShownColumn shown_column(const std::string& name) {
  const auto* field = solver::find_result_column(name);
  if (field == nullptr || field->shown_per_unit == 1.0) {
    return {name};
  }
  return {fmt::format("{} [{}]", name, field->shown_unit), field->shown_per_unit};
}

protocol::QueryReply in_shown_units(protocol::QueryReply rows) {
  for (int i = 0; i < rows.columns_size(); ++i) {
    const auto shown = shown_column(rows.columns(i));
    rows.set_columns(i, shown.heading);
    for (auto& row : *rows.mutable_rows()) {
      auto& value = *row.mutable_values(i);
      if (value.has_real()) {
        value.set_real(value.real() * shown.per_unit);
      }
    }
  }
  return rows;
}

}  // namespace oblique::client
