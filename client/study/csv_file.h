#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// A table of numbers with names above its columns, as spreadsheets export it (RFC 4180): commas
/// between fields, quotes around fields with commas, quotes (doubled) or line breaks. A byte order
/// mark, empty lines and spaces around a field are ignored.
class CsvFile {
 public:
  /// Throws solver::InputError for a text that is not UTF-8, a quote that is not closed, rows of
  /// different lengths, no row of values, and a column name that is missing or appears twice. It
  /// begins with `name` and the line, like all errors below.
  CsvFile(std::string_view text, std::string name);

  const std::vector<std::string>& columns() const { return rows_.front().fields; }

  /// The values of a column for an axis. Throws InputError for an unknown column, with the nearest,
  /// and for a field that is no number or not allowed for the key.
  std::vector<double> values(std::string_view column, const solver::ParameterKey& key) const;

  /// The numbers of a column; nothing for an empty field. Throws InputError for an unknown column
  /// and for a field that is no finite number.
  std::vector<std::optional<double>> numbers(std::string_view column) const;

  /// Where a row of values is: "measured.csv:3".
  std::string place_of_row(std::size_t row) const;

 private:
  struct Row {
    std::size_t line;  ///< where it begins, from 1
    std::vector<std::string> fields;
  };
  void read_rows(std::string_view text);
  void check_names() const;
  /// Calls `read` with each field of a column; its InputErrors get the place.
  void read_column(std::string_view column,
                   const std::function<void(std::string_view field)>& read) const;
  [[noreturn]] void fail(std::size_t line, std::string_view message) const;

  std::string name_;
  std::vector<Row> rows_;  ///< the first has the names of the columns
};

/// The CSV files of one study, each read once.
class CsvFiles {
 public:
  /// Relative paths begin at `folder`.
  explicit CsvFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}
  /// Throws InputError as CsvFile does, and unless it is a regular file of at most 64 MiB.
  const CsvFile& at(const std::string& path);

 private:
  std::filesystem::path folder_;
  std::map<std::string, CsvFile> files_;
};

}  // namespace oblique::client
