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

/// A table of numbers with column names, as exported by spreadsheets (RFC 4180). Commas separate
/// fields. Fields that contain commas, quotes (doubled) or line breaks are quoted. A byte order
/// mark, empty lines and spaces around a field are ignored.
class CsvFile {
 public:
  /// Throws solver::InputError for text that is not UTF-8, an unclosed quote, rows of different
  /// lengths, no rows, and a column name that is missing or duplicate. The errors of this class
  /// begin with `name` and the line.
  CsvFile(std::string_view text, std::string name);

  const std::vector<std::string>& columns() const { return rows_.front().fields; }

  /// Returns the values of a column for an axis. Throws InputError for an unknown column, with the
  /// nearest known one, and for a field that is not a number or not allowed for the key.
  std::vector<double> values(std::string_view column, const solver::ParameterKey& key) const;

  /// Returns the numbers of a column; nothing for an empty field. Throws InputError for an unknown
  /// column and for a field that is not a finite number.
  std::vector<std::optional<double>> numbers(std::string_view column) const;

  /// Returns the file and line of a row: "measured.csv:3".
  std::string place_of_row(std::size_t row) const;

 private:
  struct Row {
    std::size_t line;  ///< line where the row begins, counted from 1
    std::vector<std::string> fields;
  };
  void read_rows(std::string_view text);
  void check_names() const;
  /// Calls `read` with each field of a column. Adds the field's place to InputErrors from `read`.
  void read_column(std::string_view column,
                   const std::function<void(std::string_view field)>& read) const;
  [[noreturn]] void fail(std::size_t line, std::string_view message) const;

  std::string name_;
  std::vector<Row> rows_;  ///< the first row contains the column names
};

/// The CSV files of one study, each read once.
class CsvFiles {
 public:
  /// Relative paths start at `folder`.
  explicit CsvFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}
  /// Throws InputError as CsvFile does, and if `path` is not a regular file of at most 64 MiB.
  const CsvFile& at(const std::string& path);

 private:
  std::filesystem::path folder_;
  std::map<std::string, CsvFile> files_;
};

}  // namespace oblique::client
