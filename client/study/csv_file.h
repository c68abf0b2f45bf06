#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "worker/solver/model/parameters.h"

namespace oblique::client {

/// A table of numbers with names above its columns, as spreadsheets export it (RFC 4180): fields
/// with commas between them, in quotes where they hold commas, quotes (doubled) or line breaks;
/// lines end with LF, CRLF or CR; a byte order mark and empty lines are passed over, as are spaces
/// around a field.
class CsvFile {
 public:
  /// Throws solver::InputError, with the line where there is one, for what is no regular file of at
  /// most `kMostBytes`, not UTF-8, a quote that is not closed, rows of different lengths or more
  /// than `kMostColumns` fields, a missing row of names, a name that is missing or there twice.
  static CsvFile read(const std::filesystem::path& path);
  /// The same of a text; `name` is what errors call it.
  static CsvFile parse(std::string_view text, std::string name);

  static constexpr std::size_t kMostBytes = std::size_t{64} << 20;
  static constexpr std::size_t kMostColumns = 4096;

  const std::string& name() const { return name_; }
  const std::vector<std::string>& columns() const { return columns_; }
  std::size_t rows() const { return lines_.size(); }

  /// The values of a column for an axis. Throws InputError naming file, line and column for what is
  /// no number, or none that the key allows; and for a column that there is not, with the nearest.
  std::vector<double> values(std::string_view column, const solver::ParameterKey& key) const;

 private:
  void add_row(std::vector<std::string> fields, std::size_t line);
  void check_columns(std::size_t line) const;
  std::size_t column_number(std::string_view column) const;
  std::string place(std::size_t line) const;

  std::string name_;
  std::vector<std::string> columns_;
  std::vector<std::string> fields_;  ///< row after row
  std::vector<std::size_t> lines_;   ///< where each row begins, from 1
};

/// The CSV files of one study, each read once.
class CsvFiles {
 public:
  /// Relative paths begin at `folder`.
  explicit CsvFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}
  /// Throws as CsvFile::read does.
  const CsvFile& at(const std::string& path);

 private:
  std::filesystem::path folder_;
  std::map<std::string, CsvFile> files_;
};

}  // namespace oblique::client
