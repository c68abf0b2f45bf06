#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "client/study/csv_file.h"

namespace oblique::client {

/// One measured output.
struct MeasuredNumber {
  std::size_t row;     ///< from 0
  std::size_t output;  ///< index in Measurements::outputs
  double value;
  double sd;
  std::string name;  ///< for messages: "measured.csv:3: fn_peak_N"
};

/// Measured outputs with their conditions. Each row is an impact.
struct Measurements {
  std::size_t rows = 0;
  /// H, mu, e and model keys that have a column, with a value for each row.
  std::vector<std::pair<std::string, std::vector<double>>> conditions;
  std::vector<std::string> outputs;  ///< columns of results
  std::vector<MeasuredNumber> numbers;
};

/// Reads a table of measurements. Its columns are keys of points and models, outputs
/// (`oblique columns`), and `<output>_sd` for their standard deviations. An empty field of an
/// output was not measured. A number without a deviation in the file has `relative_sd` times its
/// value; 0: none. Throws solver::InputError for other columns, and for a number without a positive
/// deviation.
Measurements read_measurements(const CsvFile& file, double relative_sd);

}  // namespace oblique::client
