#include "client/study/csv_file.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/small_file.h"
#include "proto/text.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::InputError;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t";
  const auto first = text.find_first_not_of(kBlank);
  return first == std::string_view::npos
             ? std::string_view()
             : text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

/// Takes rows from the front of a text.
class Rows {
 public:
  Rows(std::string_view text, std::string_view name) : rest_(text), name_(name) {
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    if (rest_.starts_with(kByteOrderMark)) {
      rest_.remove_prefix(kByteOrderMark.size());
    }
  }

  /// The fields of the next row that has any, and the line on which it begins; false behind the
  /// last one.
  bool next(std::vector<std::string>& fields, std::size_t& line) {
    while (!rest_.empty()) {
      line = line_;
      fields.clear();
      do {
        if (fields.size() == CsvFile::kMostColumns) {
          throw InputError(fmt::format("{}:{}: the line has more than {} fields", name_, line_,
                                       CsvFile::kMostColumns));
        }
        fields.push_back(field());
      } while (take(','));
      const bool is_ended = take('\r');
      if (take('\n') || is_ended) {
        ++line_;
      } else if (!rest_.empty()) {
        throw InputError(
            fmt::format("{}:{}: text follows a field in quotes: a comma or the end of "
                        "the line must, and a quote inside a field is written twice",
                        name_, line_));
      }
      if (fields.size() > 1 || !fields.front().empty()) {
        return true;
      }
    }
    return false;
  }

 private:
  bool take(char wanted) {
    if (rest_.empty() || rest_.front() != wanted) {
      return false;
    }
    rest_.remove_prefix(1);
    return true;
  }

  std::string field() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t"), rest_.size()));
    if (take('"')) {
      return quoted();
    }
    const auto length = std::min(rest_.find_first_of(",\r\n"), rest_.size());
    const std::string text(trimmed(rest_.substr(0, length)));
    rest_.remove_prefix(length);
    return text;
  }

  std::string quoted() {
    const std::size_t begins = line_;
    std::string text;
    while (true) {
      const auto length = rest_.find('"');
      if (length == std::string_view::npos) {
        throw InputError(fmt::format("{}:{}: a quote is opened and never closed", name_, begins));
      }
      text += rest_.substr(0, length);
      line_ += static_cast<std::size_t>(
          std::count(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(length), '\n'));
      rest_.remove_prefix(length + 1);
      if (!take('"')) {
        break;
      }
      text += '"';
    }
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t"), rest_.size()));
    return std::string(trimmed(text));
  }

  std::string_view rest_;
  std::string_view name_;
  std::size_t line_ = 1;
};

double number_of_field(std::string_view field, const solver::ParameterKey& key) {
  if (key.name == "integrator") {
    return static_cast<double>(solver::integrator_named(field));
  }
  const auto value = solver::number_of(field.starts_with('+') ? field.substr(1) : field);
  if (!value) {
    throw InputError(field.empty()
                         ? "the field is empty: a number must stand there"
                         : fmt::format("\"{}\" is not a number", protocol::excerpt(field)));
  }
  solver::check_value(key, *value);
  return *value;
}

}  // namespace

CsvFile CsvFile::read(const std::filesystem::path& path) {
  return parse(protocol::read_small_file(path.string(), "the CSV file", kMostBytes), path.string());
}

CsvFile CsvFile::parse(std::string_view text, std::string name) {
  CsvFile file;
  file.name_ = std::move(name);
  if (!protocol::is_utf8(text)) {
    throw InputError(file.name_ + ": it is not UTF-8: save it as CSV in UTF-8");
  }
  Rows rows(text, file.name_);
  std::size_t line = 0;
  if (!rows.next(file.columns_, line)) {
    throw InputError(file.name_ +
                     ": it is empty: a line with the names of columns, and lines with "
                     "their values, are needed");
  }
  file.check_columns(line);
  for (std::vector<std::string> fields; rows.next(fields, line);) {
    file.add_row(std::move(fields), line);
  }
  if (file.lines_.empty()) {
    throw InputError(file.name_ + ": it has names of columns and no line with values");
  }
  return file;
}

std::string CsvFile::place(std::size_t line) const {
  return fmt::format("{}:{}: ", name_, line);
}

void CsvFile::check_columns(std::size_t line) const {
  if (columns_.size() == 1 && columns_.front().find(';') != std::string::npos) {
    throw InputError(place(line) + "there are semicolons between the columns: commas are needed");
  }
  if (std::all_of(columns_.begin(), columns_.end(),
                  [](const auto& name) { return solver::number_of(name).has_value(); })) {
    throw InputError(place(line) + "the first line has numbers: it must name the columns");
  }
  for (auto name = columns_.begin(); name != columns_.end(); ++name) {
    if (name->empty()) {
      throw InputError(
          fmt::format("{}column {} has no name", place(line), name - columns_.begin() + 1));
    }
    if (std::find(columns_.begin(), name, *name) != name) {
      throw InputError(
          fmt::format("{}two columns are called `{}`", place(line), protocol::excerpt(*name)));
    }
  }
}

void CsvFile::add_row(std::vector<std::string> fields, std::size_t line) {
  if (fields.size() != columns_.size()) {
    throw InputError(fmt::format("{}the line has {} fields, and the first line names {} columns",
                                 place(line), fields.size(), columns_.size()));
  }
  std::move(fields.begin(), fields.end(), std::back_inserter(fields_));
  lines_.push_back(line);
}

std::size_t CsvFile::column_number(std::string_view column) const {
  const auto found = std::find(columns_.begin(), columns_.end(), column);
  if (found == columns_.end()) {
    std::vector<std::string> names;
    for (const auto& name : columns_) {
      names.push_back(protocol::excerpt(name, 40));
    }
    const std::vector<std::string_view> known(names.begin(), names.end());
    throw InputError(fmt::format("{} has no column `{}`{}: its columns are {}", name_,
                                 protocol::excerpt(column), protocol::did_you_mean(column, known),
                                 protocol::joined(known)));
  }
  return static_cast<std::size_t>(found - columns_.begin());
}

std::vector<double> CsvFile::values(std::string_view column,
                                    const solver::ParameterKey& key) const {
  const std::size_t number = column_number(column);
  std::vector<double> values;
  values.reserve(rows());
  for (std::size_t row = 0; row < rows(); ++row) {
    try {
      values.push_back(number_of_field(fields_[row * columns_.size() + number], key));
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}column `{}`: {}", place(lines_[row]),
                                   protocol::excerpt(column), error.what()));
    }
  }
  return values;
}

const CsvFile& CsvFiles::at(const std::string& path) {
  const auto known = files_.find(path);
  return known != files_.end()
             ? known->second
             : files_.emplace(path, CsvFile::read(folder_ / std::filesystem::path(path)))
                   .first->second;
}

}  // namespace oblique::client
