#include "client/output/columns.h"

#include <array>
#include <span>
#include <string_view>

#include "worker/solver/model/parameters.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client {
namespace {

struct Described {
  std::string_view name;
  std::string_view unit;
  std::string_view meaning;
};

/// Outputs as the database packs them, with more than `solve --json` says.
constexpr std::array<Described, 3> kPackedOutputs{{
    {"peaks", "s, N",
     "every peak of the normal force: t_s counted from touch, fn_N, ft_N the largest tangential "
     "magnitude around it, and whether it is major (1) or a ripple (0)"},
    {"ft_peaks", "s, N", "every peak of the tangential magnitude: t_s counted from touch and ft_N"},
    {"stick_intervals", "s", "the same as stick_intervals_s"},
}};

constexpr std::array<Described, 11> kRowColumns{{
    {"study", "", "name of the study"},
    {"study_id", "", "its number in the database"},
    {"point", "", "number of the point in its study, from 0"},
    {"model_id", "", "number of the model in the database"},
    {"status", "", "solved or failed"},
    {"error", "", "why it failed"},
    {"worker", "", "number of the worker that solved it"},
    {"worker_name", "", "that worker's name"},
    {"instruction_set", "", "vector instructions that it used"},
    {"attempt", "", "number of the lease under which it was solved"},
    {"solved_at", "", "when the result arrived (UTC)"},
}};

/// Lists of `solve --json` made of those that the view packs. The numbers stay texts, so that no
/// bit of them is lost; a damaged list is NULL and does not spoil the query.
constexpr std::string_view kRowsOfQueries = R"((SELECT *,
  CASE WHEN json_valid(runs.peaks) THEN '[' || coalesce((SELECT group_concat(item.value -> 1)
    FROM json_each(runs.peaks) AS item), '') || ']' END AS fn_peaks_N,
  CASE WHEN json_valid(runs.ft_peaks) THEN '[' || coalesce((SELECT group_concat(item.value -> 1)
    FROM json_each(runs.ft_peaks) AS item), '') || ']' END AS ft_peaks_N,
  CASE WHEN json_valid(runs.peaks) THEN '[' || coalesce((SELECT group_concat(item.value -> 1)
    FROM json_each(runs.peaks) AS item WHERE item.value ->> 3), '') || ']' END AS major_peaks_N,
  runs.stick_intervals AS stick_intervals_s FROM runs))";

std::string place_in_json(const solver::ResultField& field) {
  return field.group.empty() ? std::string(field.name)
                             : std::string(field.group) + '.' + std::string(field.name);
}

Column input(const solver::ParameterKey& key, std::string place) {
  return {std::string(key.name), std::string(key.unit), "input", std::move(place),
          std::string(key.meaning) + "; " + std::string(key.allowed)};
}

void add_inputs(std::vector<Column>& columns) {
  for (const auto& key : solver::point_keys()) {
    columns.push_back(input(key, std::string(key.name)));
  }
  for (const auto& key : solver::model_keys()) {
    const auto* output = solver::find_result_column(key.name);
    auto column = input(key, output == nullptr ? std::string() : place_in_json(*output));
    if (key.name == "E") {
      column.name = "E_Pa";  // SQL does not tell E from e
      column.meaning += " (E on flags and in study files)";
    }
    columns.push_back(std::move(column));
    if (key.name == "length") {
      columns.push_back(
          {"lengths_m", "m", "input", "", "length of each link, from the pin outwards; each > 0"});
    }
  }
}

void add_outputs(std::vector<Column>& columns) {
  for (const auto& field : solver::result_fields()) {
    if (solver::find_model_key(field.column) == nullptr) {
      columns.push_back({std::string(field.column), std::string(field.unit), "output",
                         place_in_json(field), std::string(field.meaning)});
    }
  }
}

void add_described(std::vector<Column>& columns, std::span<const Described> described,
                   const std::string& kind) {
  for (const auto& each : described) {
    columns.push_back(
        {std::string(each.name), std::string(each.unit), kind, "", std::string(each.meaning)});
  }
}

}  // namespace

std::vector<Column> all_columns() {
  std::vector<Column> columns;
  add_inputs(columns);
  add_outputs(columns);
  add_described(columns, kPackedOutputs, "output");
  add_described(columns, kRowColumns, "row");
  return columns;
}

std::string rows_of_queries() {
  return std::string(kRowsOfQueries);
}

ShownColumn shown_column(const std::string& name) {
  const auto* field = solver::find_result_column(name);
  if (field == nullptr || field->shown_per_unit == 1.0) {
    return {name};
  }
  return {name + " [" + std::string(field->shown_unit) + ']', field->shown_per_unit};
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
