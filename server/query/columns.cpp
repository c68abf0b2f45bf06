#include "server/query/columns.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <variant>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/blocks.h"
#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "server/query/sql_text.h"
#include "worker/solver/model/parameters.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

using protocol::CellKind;

std::vector<Column> row_columns() {
  return {
      {"study", "", "row", "", "name of the study", CellKind::kText, true},
      {"study_id", "", "row", "", "its number in the database", CellKind::kInteger, true},
      {"point", "", "row", "", "number of the point in its study, from 0", CellKind::kInteger,
       true},
      {"model_id", "", "row", "", "number of the model in the database", CellKind::kInteger, true},
      {"status", "", "row", "", "solved or failed", CellKind::kText, true},
      {"error", "", "row", "", "why it failed", CellKind::kText, true},
      {"worker_id", "", "row", "", "number of the worker that solved it", CellKind::kInteger, true},
      {"worker_name", "", "row", "", "that worker's name"},
      {"instruction_set", "", "row", "", "vector instructions that it used"},
      {"attempt", "", "row", "", "number of times that the point was leased until it was solved",
       CellKind::kInteger, true},
      {"solved_at", "", "row", "", "when the result arrived (UTC)", CellKind::kText, true},
      {"reused_from", "", "row", "",
       "STUDY/POINT that this result was copied from, by its name then; NULL: not a copy",
       CellKind::kText, true},
  };
}

/// Returns whether the view `runs` shows the list in another form than the table `results`.
bool is_remade_by_view(const solver::ResultList& list) {
  return list.column == "phases" || list.column == "ft_peaks";
}

/// Returns SQL for the list `part` over the columns of `runs`. Numbers keep all their digits.
std::string list_sql(const solver::ListPart& part) {
  const std::string list = fmt::format("runs.{}", part.list->column);
  if (part.member.empty()) {
    return list;
  }
  const auto index_of = [&](std::string_view member) {
    return std::ranges::find(part.list->members, member) - part.list->members.begin();
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

void add_inputs(std::vector<Column>& columns) {
  const auto add = [&](const solver::ParameterKey& key, std::string place, bool is_stored) {
    const bool is_whole = key.is_allowed(2.0) && !key.is_allowed(2.5);
    const std::string name = column_of_key(key.name);
    columns.push_back({name, std::string(key.unit), "input", std::move(place),
                       fmt::format("{}; {}{}", key.meaning, key.allowed,
                                   name == key.name ? "" : " (E on flags and in study files)"),
                       key.name == "integrator" ? CellKind::kText
                       : is_whole               ? CellKind::kInteger
                                                : CellKind::kReal,
                       is_stored});
  };
  for (const auto& key : solver::point_keys()) {
    add(key, std::string(key.name), true);
  }
  for (const auto& key : solver::model_keys()) {
    const auto* output = solver::find_result_column(key.name);
    add(key, output == nullptr ? std::string() : place_in_json(*output), false);
    if (key.name == "length") {
      columns.push_back(
          {"lengths_m", "m", "input", "", "length of each link, from the pin outwards; each > 0"});
    }
  }
}

void add_outputs(std::vector<Column>& columns) {
  for (const auto& field : solver::result_fields()) {
    if (solver::find_model_key(field.column) != nullptr) {
      continue;
    }
    const auto* part = std::get_if<solver::ListPart>(&field.value);
    columns.push_back({std::string(field.column), std::string(field.unit), "output",
                       place_in_json(field), std::string(field.meaning),
                       std::holds_alternative<solver::Member<double>>(field.value) ? CellKind::kReal
                       : std::holds_alternative<solver::Member<std::int64_t>>(field.value)
                           ? CellKind::kInteger
                           : CellKind::kText,
                       part != nullptr ? !is_remade_by_view(*part->list)
                                       : field.sent_with != solver::SentWith::kWorker,
                       part != nullptr ? list_sql(*part) : std::string()});
  }
  // Adds the lists that `solve --json` prints in another form.
  for (const auto* list : solver::result_lists()) {
    if (solver::find_result_column(list->column) == nullptr) {
      columns.push_back({std::string(list->column), std::string(list->unit), "output", "",
                         std::string(list->meaning), CellKind::kText, !is_remade_by_view(*list)});
    }
  }
}

/// Returns whether a key may have several values over the points of a recipe: it has an axis with
/// several values, an expression or a distribution, or the axes of the key in two blocks differ.
bool varies(const protocol::Recipe& recipe, std::string_view key) {
  std::optional<std::string> first;  // axis of the key in the first block; "" if the block has none
  for (const auto& block : recipe.blocks()) {
    const auto axis = std::ranges::find(block.axes(), key, &protocol::Axis::key);
    const bool has_axis = axis != block.axes().end();
    if (has_axis && (!protocol::has_own_values(*axis) || protocol::axis_size(*axis) > 1)) {
      return true;
    }
    const std::string text = has_axis ? axis->SerializeAsString() : std::string();
    if (first && *first != text) {
      return true;
    }
    first = text;
  }
  return false;
}

}  // namespace

std::string column_of_key(std::string_view key) {
  return key == "E" ? "E_Pa" : std::string(key);
}

void use_stored_inputs(const protocol::Table& row, protocol::TraceReply& inputs) {
  const auto stored = [&row](const std::string& column, double own) {
    const auto at = std::ranges::find(row.columns, column) - row.columns.begin();
    const auto* const value =
        row.rows.empty() || at == std::ssize(row.columns)
            ? nullptr
            : std::get_if<double>(&row.rows[0].at(static_cast<std::size_t>(at)));
    return value != nullptr && protocol::is_close(*value, own) ? *value : own;
  };
  inputs.set_h_m(stored("H", inputs.h_m()));
  inputs.set_mu(stored("mu", inputs.mu()));
  inputs.set_e_star(stored("e", inputs.e_star()));
  auto model = protocol::from_message_unchecked(inputs.model());
  for (const auto& key : solver::model_keys()) {
    if (const double own = key.get(model); stored(column_of_key(key.name), own) != own) {
      key.set(model, stored(column_of_key(key.name), own));
    }
  }
  *inputs.mutable_model() = protocol::to_message(model);
}

const std::vector<Column>& all_columns() {
  static const std::vector<Column> all = [] {
    std::vector<Column> columns;
    add_inputs(columns);
    add_outputs(columns);
    std::ranges::move(row_columns(), std::back_inserter(columns));
    for (Column& column : columns) {
      column.sql = column.sql.empty() ? "runs." + column.name : column.sql;
    }
    return columns;
  }();
  return all;
}

const Column* find_column(std::string_view name) {
  const auto found = std::ranges::find(all_columns(), name, &Column::name);
  return found == all_columns().end() ? nullptr : &*found;
}

std::vector<Column> columns_and_functions() {
  auto columns = all_columns();
  for (const auto* list : solver::result_lists()) {
    const std::string_view member = list->members.back() == "major" ? "fn_N" : list->members.back();
    columns.push_back(
        {fmt::format("{}[0].{}", list->column, member), unit_of_member(member), "element", "",
         fmt::format("{} of the first element; [-1] is the last{}. Members: {}", member,
                     list->column == "peaks" ? "; ripples count too, and major_peak_1_N is the "
                                               "first major peak"
                                             : "",
                     fmt::join(list->members, ", "))});
    columns.push_back(
        {fmt::format("{}.count", list->column), "", "element", "", "number of elements"});
  }
  for (const SqlFunction& function : sql_functions()) {
    if (!function.form.empty()) {
      columns.push_back(
          {std::string(function.form), "", "function", "", std::string(function.meaning)});
    }
  }
  return columns;
}

bool is_list_column(std::string_view name) {
  const auto* field = solver::find_result_column(name);
  return name == "lengths_m" || solver::find_result_list(name) != nullptr ||
         (field != nullptr && std::holds_alternative<solver::ListPart>(field->value));
}

bool is_list_of_numbers(std::string_view name) {
  const auto* field = solver::find_result_column(name);
  const auto* part = field == nullptr ? nullptr : std::get_if<solver::ListPart>(&field->value);
  return name == "lengths_m" || (part != nullptr && !part->member.empty());
}

std::string unit_of_column(std::string_view name) {
  const Column* const column = find_column(name);
  return column == nullptr || column->unit.find(',') != std::string::npos ? "" : column->unit;
}

std::string unit_of_member(std::string_view member) {
  return member.ends_with("_s") ? "s" : member.ends_with("_N") ? "N" : "";
}

CellKind kind_of_values(std::string_view name) {
  const Column* const column = find_column(name);
  return column == nullptr ? CellKind::kNull : column->values;
}

std::vector<std::string> usual_columns(const protocol::Recipe& recipe) {
  std::vector<std::string> columns{"point"};
  for (const auto keys : {solver::point_keys(), solver::model_keys()}) {
    for (const auto& key : keys) {
      const bool is_of_point = keys.data() == solver::point_keys().data();
      if (varies(recipe, key.name) || (recipe.blocks().empty() && is_of_point)) {
        columns.push_back(column_of_key(key.name));
      }
    }
  }
  const auto has_single_length = [&](const protocol::Block& block) {
    return std::ranges::any_of(block.axes(), [&](const protocol::Axis& axis) {
      return protocol::link_of_key(protocol::key_number(axis.key())) && varies(recipe, axis.key());
    });
  };
  if (std::ranges::any_of(recipe.blocks(), has_single_length)) {
    columns.emplace_back("lengths_m");
  }
  for (const char* output : {"status", "fn_peak_N", "ft_peak_N", "duration_s", "slide_m",
                             "stick_total_s", "major_mode"}) {
    columns.emplace_back(output);
  }
  return columns;
}

}  // namespace oblique::server
