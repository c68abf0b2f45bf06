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
  /// The keys of points and models that have a column, each with a value for every row.
  std::vector<std::pair<std::string, std::vector<double>>> conditions;
  std::vector<std::string> outputs;  ///< columns of results
  std::vector<MeasuredNumber> numbers;
};

/// Reads a table of measurements. Its columns are keys of points and models, outputs (`oblique
/// columns`), and `<output>_sd` for their standard deviations. An empty field of an output was not
/// measured. The standard deviation of a number without one in the file is `relative_sd` times the
/// number. Throws solver::InputError for other columns, and for a standard deviation that is not
/// positive.
Measurements read_measurements(const CsvFile& file, double relative_sd);

}  // namespace oblique::client
