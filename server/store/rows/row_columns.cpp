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
constexpr std::array<std::string_view, 8> kHeadColumns{"study_id", "point", "model_id", "H",
                                                       "mu",       "e",     "status",   "error"};
constexpr std::array<std::string_view, 5> kTailColumns{"worker", "solver_version",
                                                       "instruction_set", "attempt", "solved_at"};
constexpr std::array<std::string_view, 7> kPackedHead{"study_id", "point", "model_id", "H",
                                                      "mu",       "e",     "error"};
constexpr std::array<std::string_view, 4> kPackedTail{"worker", "attempt", "solved_at",
                                                      "taken_from"};

/// Calls `take` with the column of each output that schemas from `first` to `last` brought.
template <class Take>
void for_each_output(int first, int last, const Take& take) {
  const auto take_one = [&](const auto& output) {
    if (output.since_schema >= first && output.since_schema <= last) {
      take(output.column);
    }
  };
  const auto take_field = [&](const solver::ResultField& field, const auto&) { take_one(field); };
  solver::for_each_sent<double>(take_field);
  solver::for_each_sent<std::int64_t>(take_field);
  solver::for_each_sent<std::string>(take_field);
  for (const solver::ResultList* list : solver::result_lists()) {
    take_one(*list);
  }
}

struct PackedColumns {
  std::vector<std::string_view> all;
  std::vector<std::string_view> outputs;
};

PackedColumns make_packed_columns() {
  PackedColumns columns;
  for (const StoredUnit& unit : stored_units()) {
    columns.outputs.push_back(unit.stored);
  }
  const auto add = [&](const solver::ResultField& field, const auto&) {
    columns.outputs.push_back(field.column);
  };
  solver::for_each_sent<std::int64_t>(add);
  solver::for_each_sent<std::string>(add);
  for (const solver::ResultList* list : solver::result_lists()) {
    columns.outputs.push_back(list->column);
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

int packed_column(std::string_view name) {
  const auto names = packed_columns();
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

std::vector<std::string_view> result_columns(int schema) {
  std::vector<std::string_view> names(kHeadColumns.begin(), kHeadColumns.end());
  const auto add = [&](std::string_view column) { names.push_back(column); };
  for_each_output(1, std::min(schema, kFirstWithChecksums), add);
  names.insert(names.end(), kTailColumns.begin(), kTailColumns.end());
  for (int brought = kFirstWithChecksums + 1; brought <= schema; ++brought) {
    for_each_output(brought, brought, add);
  }
  return names;
}

std::string result_checksum_sql(int schema) {
  return schema >= kFirstPacked
             ? fmt::format("row_checksum({})", fmt::join(packed_columns(), ", "))
             : fmt::format("row_checksum({})", fmt::join(result_columns(schema), ", "));
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

std::vector<std::string> output_columns(int schema) {
  if (schema >= kFirstPacked) {
    return {packed_outputs().begin(), packed_outputs().end()};
  }
  std::vector<std::string> names;
  for_each_output(1, schema, [&](std::string_view column) { names.emplace_back(column); });
  return names;
}

std::vector<std::string> certain_columns(int schema) {
  if (schema < kFirstPacked) {
    return output_columns(1);
  }
  std::vector<std::string> names{"peaks", "stick_intervals"};
  const auto add = [&](const solver::ResultField& field, const auto& member) {
    if (field.since_schema == 1 && !member.may_be_absent) {
      const auto units = stored_units();
      const auto unit = std::find_if(units.begin(), units.end(), [&](const StoredUnit& one) {
        return one.column == field.column;
      });
      names.emplace_back(unit == units.end() ? field.column : unit->stored);
    }
  };
  solver::for_each_sent<double>(add);
  solver::for_each_sent<std::int64_t>(add);
  solver::for_each_sent<std::string>(add);
  return names;
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
