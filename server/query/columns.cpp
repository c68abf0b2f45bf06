#include "server/query/columns.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "server/query/elements.h"
#include "server/query/sql_functions.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

using protocol::CellKind;

struct Described {
  std::string_view name;
  std::string_view meaning;
  CellKind values = CellKind::kText;
};

constexpr std::array<Described, 12> kRowColumns{{
    {"study", "name of the study"},
    {"study_id", "its number in the database", CellKind::kInteger},
    {"point", "number of the point in its study, from 0", CellKind::kInteger},
    {"model_id", "number of the model in the database", CellKind::kInteger},
    {"status", "solved or failed"},
    {"error", "why it failed"},
    {"worker_id", "number of the worker that solved it", CellKind::kInteger},
    {"worker_name", "that worker's name"},
    {"instruction_set", "vector instructions that it used"},
    {"attempt", "number of the lease under which it was solved", CellKind::kInteger},
    {"solved_at", "when the result arrived (UTC)"},
    {"reused_from",
     "STUDY/POINT, as named then, of which this result is a copy; NULL: solved for this point"},
}};

/// An SQL expression over the columns of `runs` for the list `part`. Numbers keep their digits.
std::string list_sql(const solver::ListPart& part) {
  const std::string list = fmt::format("runs.{}", part.list->column);
  if (part.member.empty()) {
    return list;
  }
  const auto index_of = [&](std::string_view member) {
    const auto& members = part.list->members;
    return std::find(members.begin(), members.end(), member) - members.begin();
  };
  return fmt::format(
      "CASE WHEN {0} IS NOT NULL THEN (SELECT json_group_array(item.value -> {1}) "
      "FROM json_each({0}) AS item{2}) END",
      list, index_of(part.member),
      part.where.empty() ? "" : fmt::format(" WHERE item.value ->> {}", index_of(part.where)));
}

std::string place_in_json(const solver::ResultField& field) {
  return field.group.empty() ? std::string(field.name)
                             : std::string(field.group) + '.' + std::string(field.name);
}

Column input(const solver::ParameterKey& key, std::string place) {
  return {std::string(key.name), std::string(key.unit), "input", std::move(place),
          fmt::format("{}; {}", key.meaning, key.allowed)};
}

void add_inputs(std::vector<Column>& columns) {
  for (const auto& key : solver::point_keys()) {
    columns.push_back(input(key, std::string(key.name)));
  }
  for (const auto& key : solver::model_keys()) {
    const auto* output = solver::find_result_column(key.name);
    auto column = input(key, output == nullptr ? std::string() : place_in_json(*output));
    column.name = column_of_key(key.name);
    if (column.name != key.name) {
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

/// Adds the lists of the database that `solve --json` shows in another form.
void add_stored_lists(std::vector<Column>& columns) {
  for (const auto* list : solver::result_lists()) {
    if (solver::find_result_column(list->column) == nullptr) {
      columns.push_back({std::string(list->column), std::string(list->unit), "output", "",
                         std::string(list->meaning)});
    }
  }
}

}  // namespace

std::string column_of_key(std::string_view key) {
  return key == "E" ? "E_Pa" : std::string(key);
}

const std::vector<Column>& all_columns() {
  static const std::vector<Column> all = [] {
    std::vector<Column> columns;
    add_inputs(columns);
    add_outputs(columns);
    add_stored_lists(columns);
    for (const auto& [name, meaning, values] : kRowColumns) {
      columns.push_back({std::string(name), "", "row", "", std::string(meaning)});
    }
    return columns;
  }();
  return all;
}

std::vector<Column> columns_and_functions() {
  auto columns = all_columns();
  for (const WrittenForm& element : element_forms()) {
    columns.push_back({element.form, element.unit, "element", "", element.meaning});
  }
  for (const SqlFunction& function : sql_functions()) {
    if (!function.form.empty()) {
      columns.push_back(
          {std::string(function.form), "", "function", "", std::string(function.meaning)});
    }
  }
  return columns;
}

const std::vector<ListColumn>& lists_of_queries() {
  static const std::vector<ListColumn> all = [] {
    std::vector<ListColumn> lists;
    for (const auto& field : solver::result_fields()) {
      const auto* part = std::get_if<solver::ListPart>(&field.value);
      if (part != nullptr && field.column != part->list->column) {
        lists.push_back({std::string(field.column), list_sql(*part)});
      }
    }
    return lists;
  }();
  return all;
}

protocol::CellKind kind_of_values(std::string_view name) {
  const auto* described =
      std::find_if(kRowColumns.begin(), kRowColumns.end(),
                   [&](const Described& column) { return column.name == name; });
  if (described != kRowColumns.end()) {
    return described->values;
  }
  if (const auto* field = solver::find_result_column(name)) {
    return std::holds_alternative<solver::Member<double>>(field->value)         ? CellKind::kReal
           : std::holds_alternative<solver::Member<std::int64_t>>(field->value) ? CellKind::kInteger
                                                                                : CellKind::kText;
  }
  if (solver::find_result_list(name) != nullptr || name == "lengths_m" || name == "integrator") {
    return CellKind::kText;
  }
  const auto& columns = all_columns();
  if (std::none_of(columns.begin(), columns.end(),
                   [&](const Column& column) { return column.name == name; })) {
    return CellKind::kNull;
  }
  const auto* key = solver::find_model_key(name);
  const bool is_whole = key != nullptr && key->is_allowed(2.0) && !key->is_allowed(2.5);
  return is_whole ? CellKind::kInteger : CellKind::kReal;
}

std::string unit_of_column(std::string_view name) {
  for (const Column& column : all_columns()) {
    if (column.name == name) {
      return column.unit.find(',') == std::string::npos ? column.unit : "";
    }
  }
  return {};
}

}  // namespace oblique::server
