#include "server/store/result_row.h"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include <spdlog/fmt/fmt.h>

#include "proto/result_message.h"
#include "server/store/packed_arrays.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

using protocol::PointResult;
using solver::CaseResult;

/// Columns before and after the outputs, in the order of the bindings.
constexpr std::array<std::string_view, 8> kHeadColumns{"study_id", "point", "model_id", "H",
                                                       "mu",       "e",     "status",   "error"};
constexpr std::array<std::string_view, 5> kTailColumns{"worker", "solver_version",
                                                       "instruction_set", "attempt", "solved_at"};

/// Calls `take(column, since_schema, value)` with the outputs that schemas from `first` to `last`
/// brought, by type, each in the order of the solver's tables. `value(result)` points to what is
/// stored, or to nothing.
template <class Take>
void for_each_output(int first, int last, const Take& take) {
  const auto take_one = [&](const auto& output, const auto& value) {
    if (output.since_schema >= first && output.since_schema <= last) {
      take(output.column, output.since_schema, value);
    }
  };
  const auto take_field = [&](const solver::ResultField& field, const auto& member) {
    take_one(field, member.of);
  };
  solver::for_each_sent<double>(take_field);
  solver::for_each_sent<std::int64_t>(take_field);
  solver::for_each_sent<std::string>(take_field);
  for (const solver::ResultList* list : solver::result_lists()) {
    take_one(*list, [list](const CaseResult& result) {
      std::optional<std::string> text = packed(*list, result);
      // Rows may lack a list that a later schema brought, and so may results.
      if (list->since_schema > 1 && *text == "[]") {
        text.reset();
      }
      return text;
    });
  }
}

/// The same with those that came after checksums, schema by schema: what a later one brings counts
/// in checksums behind what earlier rows have.
template <class Take>
void for_each_later_output(int last, const Take& take) {
  for (int schema = kFirstWithChecksums + 1; schema <= last; ++schema) {
    for_each_output(schema, schema, take);
  }
}

/// Binds outputs to the parameters from `index` on. Those that are absent stay unbound, and so
/// NULL.
class OutputBinding {
 public:
  OutputBinding(Statement& insert, int index, const CaseResult* result)
      : insert_(insert), index_(index), result_(result) {}

  void operator()(std::string_view /*column*/, int /*since_schema*/, const auto& value) {
    if (result_ != nullptr) {
      if (const auto& stored = value(*result_)) {
        insert_.bind(index_, *stored);
      }
    }
    ++index_;
  }
  /// The parameter behind them.
  int index() const { return index_; }

 private:
  Statement& insert_;
  int index_;
  const CaseResult* result_;
};

}  // namespace

std::vector<std::string_view> result_columns(int schema) {
  std::vector<std::string_view> names(kHeadColumns.begin(), kHeadColumns.end());
  const auto add = [&](std::string_view column, int, const auto&) { names.push_back(column); };
  for_each_output(1, kFirstWithChecksums, add);
  names.insert(names.end(), kTailColumns.begin(), kTailColumns.end());
  for_each_later_output(schema, add);
  return names;
}

std::string insert_result_sql() {
  const auto names = result_columns(kSchemaVersion);
  std::string marks;
  for (std::size_t i = 1; i <= names.size(); ++i) {
    marks += fmt::format("{}?{}", i == 1 ? "" : ", ", i);
  }
  // Only a point that is there already is passed over; any other conflict is an error.
  return fmt::format(
      "INSERT INTO results ({}, checksum) VALUES ({}, row_checksum({}))"
      " ON CONFLICT (study_id, point) DO NOTHING",
      fmt::join(names, ", "), marks, marks);
}

std::string result_checksum_sql(int schema) {
  return fmt::format("row_checksum({})", fmt::join(result_columns(schema), ", "));
}

std::string study_checksum_sql() {
  return "row_checksum(study_id, name, recipe, points, created_at)";
}

std::vector<std::string> output_columns(int schema) {
  std::vector<std::string> names;
  for_each_output(1, schema,
                  [&](std::string_view column, int, const auto&) { names.emplace_back(column); });
  return names;
}

void bind_result(Statement& insert, const RowContext& context, const PointResult& result) {
  insert.reset();
  insert.bind(1, context.study_id);
  insert.bind(2, result.point());
  insert.bind(3, context.model_id);
  insert.bind(4, context.point.H_m);
  insert.bind(5, context.point.mu);
  insert.bind(6, context.point.e_star);
  std::optional<CaseResult> outputs;
  if (result.error().empty()) {
    insert.bind(7, std::string_view("solved"));
    outputs = protocol::from_message(result);
  } else {
    insert.bind(7, std::string_view("failed"));
    insert.bind(8, result.error());
  }
  const CaseResult* const bound = outputs ? &*outputs : nullptr;
  OutputBinding early(insert, static_cast<int>(kHeadColumns.size()) + 1, bound);
  for_each_output(1, kFirstWithChecksums, std::ref(early));
  const int index = early.index();
  if (context.worker_id != 0) {
    insert.bind(index, context.worker_id);
    insert.bind(index + 1, context.solver_version);
    insert.bind(index + 2, context.instruction_set);
  }
  insert.bind(index + 3, std::uint64_t{context.attempt});
  insert.bind(index + 4, context.solved_at);
  OutputBinding late(insert, index + static_cast<int>(kTailColumns.size()), bound);
  for_each_later_output(kSchemaVersion, std::ref(late));
}

}  // namespace oblique::server
