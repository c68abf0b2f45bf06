#include "server/store/result_rows.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "proto/recipe/model_message.h"
#include "proto/result_message.h"
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
  std::vector<std::string_view> model{"definition", "lengths_m"};
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
  for (const solver::ParameterKey& key : solver::model_keys()) {
    columns.model.push_back(key.name);
  }
  return columns;
}

const Columns& columns() {
  static const Columns kColumns = make_columns();
  return kColumns;
}

void append(std::string& text, double value) {
  constexpr int kDigits = 8;
  std::array<char, 32> digits;  // enough for the longest number, such as -1.2345678e-308
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value,
                                 std::chars_format::general, kDigits)
                       .ptr;
  text.append(digits.data(), end);
}

/// Writes `list` as a JSON array that contains one array of numbers per element of the list.
template <class List, class Numbers>
void write_json(std::string& text, const List& list, const Numbers& numbers_of) {
  text = "[";
  for (const auto& element : list) {
    text += text.size() > 1 ? ",[" : "[";
    for (const double number : numbers_of(element)) {
      text += text.back() == '[' ? "" : ",";
      append(text, number);
    }
    text += ']';
  }
  text += ']';
}

/// Returns an INSERT statement that has a parameter for each column and computes the checksum. The
/// statement does nothing if a row with this key exists.
std::string insert_sql(std::string_view table, std::span<const std::string_view> columns,
                       std::string_view key) {
  std::string marks;
  for (std::size_t i = 1; i <= columns.size(); ++i) {
    marks += fmt::format("{}?{}", i == 1 ? "" : ", ", i);
  }
  return fmt::format(
      "INSERT INTO {0} ({1}, checksum) VALUES ({2}, row_checksum({2}))"
      " ON CONFLICT ({3}) DO NOTHING",
      table, fmt::join(columns, ", "), marks, key);
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

std::span<const std::string_view> model_columns() {
  return columns().model;
}

std::string result_checksum_sql() {
  return fmt::format("row_checksum({})", fmt::join(result_columns(), ", "));
}

std::string model_checksum_sql() {
  return fmt::format("row_checksum({})", fmt::join(model_columns(), ", "));
}

ResultInsert::ResultInsert(sqlite3* database)
    // The statement does nothing for a point that has a row. Other conflicts are errors.
    : insert_(database, insert_sql("results", result_columns(), "study_id, point")) {}

void ResultInsert::run(const AddResults& change, const protocol::PointResult& result,
                       const protocol::Point& inputs, std::int64_t model_id) {
  insert_.reset();
  insert_.bind_all(change.study_id, result.point(), model_id, inputs.H_m, inputs.mu, inputs.e_star);
  next_ = 7;
  if (result.error().empty()) {
    outputs_ = protocol::from_message(result);
    ++next_;  // no error
    put_outputs(outputs_);
    put_lists(outputs_);
  } else {
    put(result.error());
    next_ += static_cast<int>(output_columns().size());
  }
  if (change.worker_id != 0) {
    put(change.worker_id);
  } else {
    ++next_;
  }
  put(change.attempt);
  put(change.solved_at);
  insert_.run();  // parameters that were not bound are NULL
}

void ResultInsert::put_outputs(const solver::CaseResult& result) {
  const auto put_field = [&](const solver::ResultField&, const auto& member) {
    if (const auto* const value = member.of(result); value != nullptr) {
      put(*value);
    } else {
      ++next_;
    }
  };
  solver::for_each_stored<double>(put_field);
  solver::for_each_stored<std::int64_t>(put_field);
  solver::for_each_stored<std::string>(put_field);
}

void ResultInsert::put_lists(const solver::CaseResult& result) {
  auto& [peaks, ft_peaks, phases, stick_intervals, reaction_peaks] = lists_;
  write_json(peaks, result.peaks, [](const solver::Peak& peak) {
    return std::array{peak.t_s, peak.fn_N, peak.ft_N, peak.major ? 1.0 : 0.0};
  });
  put(peaks);
  if (ft_peaks_equal_those_of_peaks(result)) {
    ++next_;
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
    ++next_;
  } else {
    write_json(reaction_peaks, result.reaction_peaks, [](const solver::ReactionPeak& peak) {
      return std::array{peak.t_s, peak.force_N};
    });
    put(reaction_peaks);
  }
}

ModelRows::ModelRows(sqlite3* database)
    : find_(database,
            fmt::format("SELECT model_id, checksum <> {} FROM models WHERE definition = ?",
                        model_checksum_sql())),
      insert_(database, insert_sql("models", model_columns(), "definition")) {}

std::int64_t ModelRows::find(const solver::ModelParameters& model) {
  return find(protocol::canonical_model(model));
}

std::int64_t ModelRows::find(std::string_view definition) {
  find_.bind_all(definition);
  const std::int64_t model_id = find_.step() ? find_.integer(0) : 0;
  const bool is_damaged = model_id != 0 && find_.integer(1) != 0;
  find_.reset();
  if (is_damaged) {
    throw StorageGone(
        fmt::format("model {} was changed after it was stored, and no result may refer "
                    "to it{}",
                    model_id, kWayOut));
  }
  return model_id;
}

std::int64_t ModelRows::find_or_insert(const solver::ModelParameters& model) {
  const std::string definition = protocol::canonical_model(model);
  insert_.reset();
  insert_.bind_all(definition, nlohmann::json(model.lengths_m).dump());
  int index = 3;
  for (const solver::ParameterKey& key : solver::model_keys()) {
    const double value = key.get(model);
    if (key.name == "integrator") {
      insert_.bind(index, solver::integrator_name(model.integrator));
    } else if (key.name == "links" || key.name == "elements_per_link") {
      insert_.bind(index, static_cast<std::int64_t>(value));
    } else if (key.name != "length" ||
               std::ranges::count(model.lengths_m, value) == std::ssize(model.lengths_m)) {
      insert_.bind(index, value);
    }
    ++index;
  }
  insert_.run();
  return find(definition);
}

}  // namespace oblique::server
