#include "server/store/result_row.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

using protocol::PointResult;

struct RealColumn {
  std::string_view name;
  double (PointResult::*get)() const;
};

constexpr std::array<RealColumn, 23> kRealColumns{{
    {"fall_time_s", &PointResult::fall_time_s},
    {"impact_x_m", &PointResult::impact_x_m},
    {"vt_in_m_s", &PointResult::vt_in_m_s},
    {"vn_in_m_s", &PointResult::vn_in_m_s},
    {"duration_s", &PointResult::duration_s},
    {"fn_peak_N", &PointResult::fn_peak_n},
    {"ft_peak_N", &PointResult::ft_peak_n},
    {"impulse_n_Ns", &PointResult::impulse_n_ns},
    {"impulse_t_Ns", &PointResult::impulse_t_ns},
    {"slide_m", &PointResult::slide_m},
    {"vt_out_m_s", &PointResult::vt_out_m_s},
    {"vn_out_m_s", &PointResult::vn_out_m_s},
    {"stick_total_s", &PointResult::stick_total_s},
    {"kinetic_in_J", &PointResult::kinetic_in_j},
    {"friction_J", &PointResult::friction_j},
    {"restitution_J", &PointResult::restitution_j},
    {"kinetic_change_J", &PointResult::kinetic_change_j},
    {"strain_change_J", &PointResult::strain_change_j},
    {"gravity_change_J", &PointResult::gravity_change_j},
    {"exchanged_J", &PointResult::exchanged_j},
    {"closure", &PointResult::closure},
    {"dt_s", &PointResult::dt_s},
    {"wall_s", &PointResult::wall_s},
}};

/// Columns before and after the real ones, in the order of the bindings.
constexpr std::array<std::string_view, 8> kHeadColumns{"study_id", "point", "model_id", "H",
                                                       "mu",       "e",     "status",   "error"};
constexpr std::array<std::string_view, 13> kTailColumns{
    "steps",    "mode",           "major_mode",      "peaks",
    "ft_peaks", "phases",         "stick_intervals", "reaction_peaks",
    "worker",   "solver_version", "instruction_set", "attempt",
    "solved_at"};

constexpr std::size_t kLongestText = 65536;

using Values = google::protobuf::RepeatedField<double>;

bool all_finite(const Values& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

/// [[a, b], ...] from a flat list.
std::string pairs_json(const Values& values) {
  std::string text = "[";
  for (int i = 0; i + 1 < values.size(); i += 2) {
    text += i == 0 ? "[" : ",[";
    text += solver::exact_real(values[i]);
    text += ',';
    text += solver::exact_real(values[i + 1]);
    text += ']';
  }
  return text + "]";
}

/// As lists for SQL; ?1 is the parameter of the first column.
struct ColumnsAndMarks {
  std::string names;
  std::string marks;
};
ColumnsAndMarks columns_and_marks() {
  ColumnsAndMarks lists;
  int count = 0;
  const auto add = [&](std::string_view name) {
    const std::string separator = ++count == 1 ? "" : ", ";
    lists.names += separator + std::string(name);
    lists.marks += separator + "?" + std::to_string(count);
  };
  std::for_each(kHeadColumns.begin(), kHeadColumns.end(), add);
  for (const auto& column : kRealColumns) {
    add(column.name);
  }
  std::for_each(kTailColumns.begin(), kTailColumns.end(), add);
  return lists;
}

}  // namespace

std::string fault_of(const PointResult& result) {
  for (const auto& column : kRealColumns) {
    if (!std::isfinite((result.*column.get)())) {
      return "the worker sent a " + std::string(column.name) + " that is not a finite number";
    }
  }
  for (const Values* values : {&result.peaks(), &result.ft_peaks(), &result.phase_ends_s(),
                               &result.stick_intervals(), &result.reaction_peaks()}) {
    if (!all_finite(*values)) {
      return "the worker sent a list with a number that is not finite";
    }
  }
  if (result.peaks_size() % 3 != 0 || result.ft_peaks_size() % 2 != 0 ||
      result.stick_intervals_size() % 2 != 0 || result.reaction_peaks_size() % 2 != 0) {
    return "the worker sent a list of the wrong length";
  }
  if (std::any_of(result.major_peaks().begin(), result.major_peaks().end(),
                  [&](std::uint32_t number) {
                    return number >= static_cast<std::uint32_t>(result.peaks_size() / 3);
                  })) {
    return "the worker sent the number of a major peak that is not there";
  }
  if (result.steps() > static_cast<std::uint64_t>(INT64_MAX)) {
    return "the worker sent steps = " + std::to_string(result.steps()) +
           ", more than the database can hold";
  }
  if (std::max({result.mode().size(), result.major_mode().size(), result.error().size()}) >
      kLongestText) {
    return "the worker sent a text that is too long";
  }
  return {};
}

std::string insert_result_sql() {
  const auto [names, marks] = columns_and_marks();
  // Only a point that is there already is passed over; any other conflict is an error.
  return "INSERT INTO results (" + names + ", checksum) VALUES (" + marks + ", row_checksum(" +
         marks + ")) ON CONFLICT (study_id, point) DO NOTHING";
}

std::string result_checksum_sql() {
  return "row_checksum(" + columns_and_marks().names + ")";
}

std::string study_checksum_sql() {
  return "row_checksum(study_id, name, recipe, points, created_at)";
}

std::vector<std::string> output_columns() {
  std::vector<std::string> names{"steps",    "mode",   "major_mode",     "peaks",
                                 "ft_peaks", "phases", "stick_intervals"};
  for (const auto& column : kRealColumns) {
    names.emplace_back(column.name);
  }
  return names;
}

void bind_result(Statement& insert, const RowContext& context, const PointResult& result) {
  const bool solved = result.error().empty();
  insert.reset();
  insert.bind(1, context.study_id);
  insert.bind(2, result.point());
  insert.bind(3, context.model_id);
  insert.bind(4, context.point.H_m);
  insert.bind(5, context.point.mu);
  insert.bind(6, context.point.e_star);
  insert.bind(7, solved ? std::string_view("solved") : std::string_view("failed"));
  int index = 8;
  if (solved) {
    ++index;  // no error
    for (const auto& column : kRealColumns) {
      insert.bind(index++, (result.*column.get)());
    }
    insert.bind(index++, result.steps());
    insert.bind(index++, result.mode());
    insert.bind(index++, result.major_mode());
    insert.bind(index++, peaks_json(result));
    insert.bind(index++, ft_peaks_json(result));
    insert.bind(index++, phases_json(result));
    insert.bind(index++, stick_intervals_json(result));
    if (!result.reaction_peaks().empty()) {
      insert.bind(index, reaction_peaks_json(result));
    }
    ++index;
  } else {
    // The outputs stay unbound, and so NULL.
    insert.bind(index, result.error());
    index += 1 + static_cast<int>(kRealColumns.size()) + 8;
  }
  if (context.worker_id != 0) {
    insert.bind(index, context.worker_id);
    insert.bind(index + 1, context.solver_version);
    insert.bind(index + 2, context.instruction_set);
  }
  insert.bind(index + 3, std::uint64_t{context.attempt});
  insert.bind(index + 4, context.solved_at);
}

std::string peaks_json(const PointResult& result) {
  std::vector<bool> is_major(static_cast<std::size_t>(result.peaks_size() / 3), false);
  for (const std::uint32_t number : result.major_peaks()) {
    if (number < is_major.size()) {
      is_major[number] = true;
    }
  }
  std::string text = "[";
  for (int i = 0; i + 2 < result.peaks_size(); i += 3) {
    text += i == 0 ? "[" : ",[";
    for (int j = 0; j < 3; ++j) {
      text += solver::exact_real(result.peaks(i + j));
      text += ',';
    }
    text += is_major[static_cast<std::size_t>(i / 3)] ? "1]" : "0]";
  }
  return text + "]";
}

std::string ft_peaks_json(const PointResult& result) {
  return pairs_json(result.ft_peaks());
}

std::string phases_json(const PointResult& result) {
  std::string text = "[";
  double begin_s = 0.0;
  for (int i = 0; i < result.phase_ends_s_size(); ++i) {
    text += i == 0 ? "[" : ",[";
    text += i % 2 == 0 ? "\"compression\"," : "\"restitution\",";
    text += solver::exact_real(begin_s);
    text += ',';
    begin_s = result.phase_ends_s(i);
    text += solver::exact_real(begin_s);
    text += ']';
  }
  return text + "]";
}

std::string stick_intervals_json(const PointResult& result) {
  return pairs_json(result.stick_intervals());
}

std::string reaction_peaks_json(const PointResult& result) {
  return pairs_json(result.reaction_peaks());
}

}  // namespace oblique::server
