#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "client/study/csv_file.h"

namespace oblique::client {

/// One measured output.
struct MeasuredNumber {
  std::size_t row;     ///< number of its row of values, from 0
  std::size_t output;  ///< its place in Measurements::outputs
  double value;
  double sd;
  std::string name;  ///< for messages: "measured.csv:3: fn_peak_N"
};

/// Measured outputs with the conditions under which they were measured. Each row is an impact.
struct Measurements {
  std::size_t rows = 0;
  /// H, mu, e and model keys that have a column, with a value for each row.
  std::vector<std::pair<std::string, std::vector<double>>> conditions;
  std::vector<std::string> outputs;  ///< columns of the view `runs`
  std::vector<MeasuredNumber> numbers;
};

/// Reads a table of measurements. Its columns are called as keys of points and models, as outputs
/// (`oblique columns`), and `<output>_sd` for their standard deviations. An empty field of an
/// output was not measured. `deviations` are the texts of --sd, for numbers without one in the
/// file: "1%" of the value for all, "fn_peak_N=50" in the unit of the output, "duration_s=2%".
/// Throws solver::InputError for other columns and texts, a number without deviation, and a
/// deviation that is not positive.
Measurements read_measurements(const CsvFile& file, const std::vector<std::string>& deviations);

}  // namespace oblique::client
