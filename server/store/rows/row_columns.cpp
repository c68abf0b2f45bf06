#include "server/store/rows/row_columns.h"

#include <algorithm>
#include <array>

#include <spdlog/fmt/fmt.h>

#include "proto/result_message.h"
#include "server/store/rows/stored_units.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

/// Columns before and after the outputs.
constexpr std::array<std::string_view, 7> kPackedHead{"study_id", "point", "model_id", "H",
                                                      "mu",       "e",     "error"};
constexpr std::array<std::string_view, 4> kPackedTail{"worker", "attempt", "solved_at",
                                                      "taken_from"};

struct PackedColumns {
  std::vector<std::string_view> all;
  std::vector<std::string_view> outputs;
  std::vector<std::string_view> certain_outputs;
};

PackedColumns make_packed_columns() {
  PackedColumns columns;
  const auto add = [&](std::string_view column, bool may_be_absent) {
    columns.outputs.push_back(column);
    if (!may_be_absent) {
      columns.certain_outputs.push_back(column);
    }
  };
  const StoredUnit* unit = stored_units().data();  // they are in the order of the fields
  solver::for_each_stored<double>(
      [&](const auto&, const auto& member) { add((unit++)->stored, member.may_be_absent); });
  const auto add_field = [&](const solver::ResultField& field, const auto& member) {
    add(field.column, member.may_be_absent);
  };
  solver::for_each_stored<std::int64_t>(add_field);
  solver::for_each_stored<std::string>(add_field);
  for (const solver::ResultList* list : solver::result_lists()) {
    add(list->column, list->column != "peaks" && list->column != "stick_intervals");
  }
  columns.all.assign(kPackedHead.begin(), kPackedHead.end());
  columns.all.insert(columns.all.end(), columns.outputs.begin(), columns.outputs.end());
  columns.all.insert(columns.all.end(), kPackedTail.begin(), kPackedTail.end());
  return columns;
}

const PackedColumns& all_packed_columns() {
  static const PackedColumns columns = make_packed_columns();
  return columns;
}

}  // namespace

std::span<const std::string_view> packed_columns() {
  return all_packed_columns().all;
}

std::span<const std::string_view> packed_outputs() {
  return all_packed_columns().outputs;
}

std::span<const std::string_view> certain_outputs() {
  return all_packed_columns().certain_outputs;
}

int packed_column(std::string_view name) {
  const auto names = packed_columns();
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

std::string result_checksum_sql() {
  return fmt::format("row_checksum({})", fmt::join(packed_columns(), ", "));
}

std::string study_checksum_sql() {
  return "row_checksum(study_id, name, recipe, points, created_at)";
}

std::string text_checksum_sql() {
  return "row_checksum(text_id, text)";
}

std::string worker_checksum_sql() {
  return "row_checksum(worker_id, name, threads, solver_version, instruction_set, joined_at)";
}

std::string lists_are_sound_sql() {
  std::string condition = "(1";
  for (const solver::ResultList* list : solver::result_lists()) {
    const int per_element = list->column == "peaks" ? 3 : list->column == "phases" ? 1 : 2;
    condition += fmt::format(
        " AND CASE WHEN {0} IS NULL THEN 1 WHEN json_valid({0}) THEN json_array_length({0}) <= {1}"
        " ELSE 0 END",
        list->column, per_element * protocol::kMostListElements);
  }
  return condition + ")";
}

std::string last_study_id_sql() {
  std::string numbers = "SELECT 0 AS number UNION ALL SELECT last_study_id FROM about";
  for (const std::string_view table :
       {"studies", "packed_results", "settled_points", "retries", "deletions", "taken_points"}) {
    numbers += fmt::format(" UNION ALL SELECT max(study_id) FROM {}", table);
  }
  return "(SELECT max(number) FROM (" + numbers + " UNION ALL SELECT max(origin_id) FROM origins))";
}

std::string_view shown_name(std::string_view packed_column) {
  const auto units = stored_units();
  const auto unit = std::find_if(units.begin(), units.end(), [&](const StoredUnit& one) {
    return one.stored == packed_column;
  });
  return unit == units.end() ? packed_column : unit->column;
}

}  // namespace oblique::server
