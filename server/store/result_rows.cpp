#include "server/store/result_rows.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

constexpr std::array<std::string_view, 7> kInputs{"study_id", "point", "model_id", "H",
                                                  "mu",       "e",     "error"};
constexpr std::array<std::string_view, 4> kOrigin{"worker_id", "attempt", "solved_at",
                                                  "reused_from"};

struct Columns {
  std::vector<std::string_view> all;
  std::vector<std::string_view> outputs;
  std::vector<std::string_view> required_outputs;
};

Columns make_columns() {
  Columns columns;
  const auto add = [&](std::string_view column, bool may_be_absent) {
    columns.outputs.push_back(column);
    if (!may_be_absent) {
      columns.required_outputs.push_back(column);
    }
  };
  const auto add_field = [&](const solver::ResultField& field, const auto& member) {
    add(field.column, member.may_be_absent);
  };
  solver::for_each_stored<double>(add_field);
  solver::for_each_stored<std::int64_t>(add_field);
  solver::for_each_stored<std::string>(add_field);
  for (const solver::ResultList* list : solver::result_lists()) {
    add(list->column, list->column != "peaks" && list->column != "stick_intervals");
  }
  columns.all.assign(kInputs.begin(), kInputs.end());
  columns.all.insert(columns.all.end(), columns.outputs.begin(), columns.outputs.end());
  columns.all.insert(columns.all.end(), kOrigin.begin(), kOrigin.end());
  return columns;
}

const Columns& columns() {
  static const Columns kColumns = make_columns();
  return kColumns;
}

/// Appends a number with 8 significant digits.
void append(std::string& text, double value) {
  constexpr int kDigits = 8;
  std::array<char, 32> digits;  // the longest: -1.2345678e-308
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                 std::chars_format::general, kDigits)
                       .ptr;
  text.append(digits.data(), end);
}

/// Writes a JSON array with an array of numbers for each element of the list.
template <class List, class Numbers>
void write_json(std::string& text, const List& list, const Numbers& numbers_of) {
  text = "[";
  for (const auto& element : list) {
    text += text.size() > 1 ? ",[" : "[";
    bool is_first = true;
    for (const double number : numbers_of(element)) {
      text += is_first ? "" : ",";
      append(text, number);
      is_first = false;
    }
    text += ']';
  }
  text += ']';
}

bool ft_peaks_equal_those_of_peaks(const solver::CaseResult& result) {
  return std::equal(result.peaks.begin(), result.peaks.end(), result.ft_peaks.begin(),
                    result.ft_peaks.end(), [](const auto& peak, const auto& ft_peak) {
                      return peak.t_s == ft_peak.t_s && peak.ft_N == ft_peak.ft_N;
                    });
}

}  // namespace

std::span<const std::string_view> result_columns() {
  return columns().all;
}

std::span<const std::string_view> output_columns() {
  return columns().outputs;
}

std::span<const std::string_view> required_outputs() {
  return columns().required_outputs;
}

std::string result_checksum_sql() {
  return fmt::format("row_checksum({})", fmt::join(result_columns(), ", "));
}

std::string study_checksum_sql() {
  return "row_checksum(study_id, name, recipe, points, created_at)";
}

ResultInsert::ResultInsert(sqlite3* database)
    : database_(database), insert_(database, [] {
        std::string marks = "?";  // the checksum
        for (std::size_t i = 0; i < result_columns().size(); ++i) {
          marks += ", ?";
        }
        // A point that has a row keeps it; any other conflict is an error.
        return fmt::format(
            "INSERT INTO results ({}, checksum) VALUES ({})"
            " ON CONFLICT (study_id, point) DO NOTHING",
            fmt::join(result_columns(), ", "), marks);
      }()) {}

void ResultInsert::put(std::string_view text) {
  insert_.bind_lasting(next_++, text);
  checksum_.add(text);
}

template <class Number>
requires std::is_arithmetic_v<Number>
void ResultInsert::put(Number value) {
  insert_.bind(next_++, value);
  checksum_.add(value);
}

void ResultInsert::put_null() {
  ++next_;
  checksum_.add_null();
}

bool ResultInsert::run(const ResultRow& row) {
  insert_.reset();
  checksum_.clear();
  next_ = 1;
  put(static_cast<std::int64_t>(row.study_id));
  put(static_cast<std::int64_t>(row.point));
  put(row.model_id);
  put(row.inputs.H_m);
  put(row.inputs.mu);
  put(row.inputs.e_star);
  if (row.result != nullptr) {
    put_null();
    put_fields<double>(*row.result);
    put_fields<std::int64_t>(*row.result);
    put_fields<std::string>(*row.result);
    put_lists(*row.result);
  } else {
    put(row.error);
    std::ranges::for_each(output_columns(), [this](std::string_view) { put_null(); });
  }
  row.worker_id != 0 ? put(static_cast<std::int64_t>(row.worker_id)) : put_null();
  put(std::int64_t{row.attempt});
  put(row.solved_at);
  put_null();  // reused_from
  insert_.bind(next_, std::int64_t{checksum_.sum()});
  insert_.run();
  return sqlite3_changes(database_) > 0;
}

template <class T>
void ResultInsert::put_fields(const solver::CaseResult& result) {
  solver::for_each_stored<T>([&](const solver::ResultField&, const solver::Member<T>& member) {
    const T* const value = member.of(result);
    value != nullptr ? put(*value) : put_null();
  });
}

void ResultInsert::put_lists(const solver::CaseResult& result) {
  auto& [peaks, ft_peaks, phases, stick_intervals, reaction_peaks] = lists_;
  write_json(peaks, result.peaks, [](const solver::Peak& peak) {
    return std::array{peak.t_s, peak.fn_N, peak.ft_N, peak.major ? 1.0 : 0.0};
  });
  put(peaks);
  if (ft_peaks_equal_those_of_peaks(result)) {
    put_null();
  } else {
    write_json(ft_peaks, result.ft_peaks, [](const solver::TangentialPeak& peak) {
      return std::array{peak.t_s, peak.ft_N};
    });
    put(ft_peaks);
  }
  phases = "[";
  for (const solver::Phase& phase : result.phases) {
    phases += phases.size() > 1 ? "," : "";
    append(phases, phase.t1_s);
  }
  phases += ']';
  put(phases);
  write_json(stick_intervals, result.stick_intervals, [](const solver::StickInterval& interval) {
    return std::array{interval.t0_s, interval.t1_s};
  });
  put(stick_intervals);
  if (result.reaction_peaks.empty()) {
    put_null();
  } else {
    write_json(reaction_peaks, result.reaction_peaks, [](const solver::ReactionPeak& peak) {
      return std::array{peak.t_s, peak.force_N};
    });
    put(reaction_peaks);
  }
}

std::string insert_model_sql() {
  // The other columns are called as the model keys.
  std::string names = "definition, lengths_m";
  std::string marks = "?, ?";
  for (const auto& key : solver::model_keys()) {
    names += ", " + std::string(key.name);
    marks += ", ?";
  }
  return "INSERT INTO models (" + names + ") VALUES (" + marks +
         ") ON CONFLICT (definition) DO NOTHING";
}

void bind_model(Statement& insert, const solver::ModelParameters& model,
                std::string_view definition) {
  insert.reset();
  insert.bind(1, definition);
  insert.bind(2, nlohmann::json(model.lengths_m).dump());
  int index = 3;
  for (const auto& key : solver::model_keys()) {
    const double value = key.get(model);
    const bool whole = key.name == "links" || key.name == "elements_per_link";
    if (key.name == "integrator") {
      insert.bind(index, solver::integrator_name(model.integrator));
    } else if (whole) {
      insert.bind(index, static_cast<std::int64_t>(value));
    } else if (key.name != "length" ||
               std::count(model.lengths_m.begin(), model.lengths_m.end(), value) ==
                   static_cast<std::ptrdiff_t>(model.lengths_m.size())) {
      insert.bind(index, value);
    }
    ++index;
  }
}

}  // namespace oblique::server
