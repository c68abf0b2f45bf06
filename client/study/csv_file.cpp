#include "client/study/csv_file.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/small_file.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

using solver::InputError;

constexpr std::string_view kBlank = " \t";

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(kBlank);
  return first == std::string_view::npos
             ? ""
             : std::string(text.substr(first, text.find_last_not_of(kBlank) - first + 1));
}

double parsed_number(std::string_view field) {
  const auto value = solver::number_of(field.starts_with('+') ? field.substr(1) : field);
  if (!value) {
    throw InputError(field.empty() ? "the field is empty: it must be a number"
                                   : fmt::format("{:?} is not a number{}", field.substr(0, 80),
                                                 solver::why_no_number(field)));
  }
  return *value + 0.0;  // never -0
}

double number_of_field(std::string_view field, const solver::ParameterKey& key) {
  if (key.name == "integrator") {
    return static_cast<double>(solver::integrator_named(field));
  }
  const double value = parsed_number(field);
  solver::check_value(key, value);
  return value;
}

}  // namespace

CsvFile::CsvFile(std::string_view text, std::string name) : name_(std::move(name)) {
  if (!protocol::is_utf8(text)) {
    throw InputError(name_ + ": it is not UTF-8: save it as CSV in UTF-8");
  }
  read_rows(text);
  if (rows_.size() < 2) {
    throw InputError(name_ + ": it needs a line with column names, and lines with values");
  }
  check_names();
  for (const Row& row : rows_) {
    if (row.fields.size() != columns().size()) {
      fail(row.line, fmt::format("the line has {} fields, but the first line has {} column names",
                                 row.fields.size(), columns().size()));
    }
  }
}

void CsvFile::fail(std::size_t line, std::string_view message) const {
  throw InputError(fmt::format("{}:{}: {}", name_, line, message));
}

void CsvFile::read_rows(std::string_view text) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  text.remove_prefix(text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0);
  std::size_t line = 1;
  Row row{line, {}};
  std::string field;
  bool is_quoted = false;      // inside quotes
  bool follows_quote = false;  // true after the closing quote
  const auto end_field = [&] {
    row.fields.push_back(trimmed(field));
    field.clear();
    follows_quote = false;
  };
  const auto end_row = [&] {
    end_field();
    if (row.fields.size() > 1 || !row.fields.front().empty()) {
      rows_.push_back(std::move(row));
    }
    row = {line, {}};
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char next = i + 1 < text.size() ? text[i + 1] : '\n';
    const bool ends_line = text[i] == '\n' || (text[i] == '\r' && next != '\n');
    line += ends_line ? std::size_t{1} : 0;
    if (is_quoted && text[i] == '"' && next != '"') {
      is_quoted = false;
      follows_quote = true;
    } else if (is_quoted) {
      field += text[i];
      i += text[i] == '"' ? std::size_t{1} : 0;  // a quote inside a field is doubled
    } else if (text[i] == '"' && field.find_first_not_of(kBlank) == field.npos && !follows_quote) {
      is_quoted = true;
    } else if (text[i] == ',') {
      end_field();
    } else if (ends_line) {
      end_row();
    } else if (follows_quote && kBlank.find(text[i]) == std::string_view::npos && text[i] != '\r') {
      fail(line,
           "text follows a quoted field: write a comma or the end of the line after it, and double "
           "a quote inside a field");
    } else if (text[i] != '\r') {
      field += text[i];
    }
  }
  if (is_quoted) {
    fail(row.line, "a quote is not closed");
  }
  end_row();
}

void CsvFile::check_names() const {
  const std::size_t line = rows_.front().line;
  const auto& names = columns();
  const auto other = names.front().find_first_of(";\t");
  if (names.size() == 1 && other != std::string::npos) {
    fail(line, fmt::format("columns are separated by {}: use commas",
                           names.front()[other] == ';' ? "semicolons" : "tabs"));
  }
  if (std::all_of(names.begin(), names.end(),
                  [](const auto& name) { return solver::number_of(name).has_value(); })) {
    fail(line, "the first line contains numbers: it must name the columns");
  }
  std::set<std::string_view> earlier;
  for (const std::string& name : names) {
    if (name.empty()) {
      fail(line, fmt::format("column {} has no name", earlier.size() + 1));
    }
    if (!earlier.insert(name).second) {
      fail(line, fmt::format("two columns are called `{}`", protocol::excerpt(name)));
    }
  }
}

void CsvFile::read_column(std::string_view column,
                          const std::function<void(std::string_view field)>& read) const {
  const auto found = std::find(columns().begin(), columns().end(), column);
  if (found == columns().end()) {
    const std::vector<std::string_view> known(columns().begin(), columns().end());
    throw InputError(fmt::format("{} has no column `{}`{}: its columns are {}", name_,
                                 protocol::excerpt(column), protocol::did_you_mean(column, known),
                                 protocol::excerpt(protocol::joined(known), 1000)));
  }
  for (auto row = rows_.begin() + 1; row != rows_.end(); ++row) {
    try {
      read(row->fields[static_cast<std::size_t>(found - columns().begin())]);
    } catch (const InputError& error) {
      fail(row->line, fmt::format("column `{}`: {}", protocol::excerpt(column), error.what()));
    }
  }
}

std::vector<double> CsvFile::values(std::string_view column,
                                    const solver::ParameterKey& key) const {
  std::vector<double> values;
  read_column(column,
              [&](std::string_view field) { values.push_back(number_of_field(field, key)); });
  return values;
}

std::vector<std::optional<double>> CsvFile::numbers(std::string_view column) const {
  std::vector<std::optional<double>> numbers;
  read_column(column, [&](std::string_view field) {
    auto& number = numbers.emplace_back();
    if (!field.empty()) {
      number = parsed_number(field);
      if (!std::isfinite(*number)) {
        throw InputError(fmt::format("{} is not finite", field));
      }
    }
  });
  return numbers;
}

std::string CsvFile::place_of_row(std::size_t row) const {
  return fmt::format("{}:{}", name_, rows_.at(row + 1).line);
}

const CsvFile& CsvFiles::at(const std::string& path) {
  constexpr std::size_t kMaxBytes = std::size_t{64} << 20U;
  const auto known = files_.find(path);
  if (known != files_.end()) {
    return known->second;
  }
  const std::string whole = (folder_ / path).string();
  const std::string text = protocol::read_small_file(whole, "the CSV file", kMaxBytes);
  return files_.emplace(path, CsvFile(text, whole)).first->second;
}

}  // namespace oblique::client
