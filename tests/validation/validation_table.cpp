#include "tests/validation/validation_table.h"

#include <algorithm>
#include <cstddef>
#include <iomanip>
#include <sstream>

namespace oblique::validation {
namespace {

constexpr const char* kKeyPrefix = "check_";
constexpr char kSeparator = '|';

std::vector<std::string> header() {
  return {"check", "reference", "measured", "bound", "where the bound comes from"};
}

std::string three_digits(double value) {
  std::ostringstream text;
  text << std::setprecision(3) << value;
  return text.str();
}

/// Adds the line to the running test's properties, from which ValidationTable reads it.
void record(const Check& check, const char* relation) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  std::ostringstream key;
  key << kKeyPrefix << std::setw(3) << std::setfill('0') << test->result()->test_property_count();
  std::ostringstream line;
  line << check.what << kSeparator << check.reference << kSeparator << three_digits(check.measured)
       << kSeparator << relation << ' ' << three_digits(check.bound) << kSeparator << check.reason;
  testing::Test::RecordProperty(key.str(), line.str());
}

std::vector<std::string> columns_of(const std::string& line) {
  std::vector<std::string> columns;
  std::istringstream rest(line);
  for (std::string column; std::getline(rest, column, kSeparator);) {
    columns.push_back(column);
  }
  return columns;
}

}  // namespace

void expect_at_most(const Check& check) {
  EXPECT_LE(check.measured, check.bound) << check.what;
  record(check, "<=");
}

void expect_at_least(const Check& check) {
  EXPECT_GE(check.measured, check.bound) << check.what;
  record(check, ">=");
}

void ValidationTable::OnTestEnd(const testing::TestInfo& test) {
  for (int i = 0; i < test.result()->test_property_count(); ++i) {
    const testing::TestProperty& property = test.result()->GetTestProperty(i);
    if (std::string(property.key()).rfind(kKeyPrefix, 0) == 0) {
      rows_.push_back(columns_of(property.value()));
    }
  }
}

void ValidationTable::OnTestProgramEnd(const testing::UnitTest&) {
  if (rows_.empty()) {
    return;
  }
  if (format_ == TableFormat::kMarkdown) {
    print_markdown();
  } else {
    print_text();
  }
}

void ValidationTable::print_markdown() const {
  const auto print = [this](const Row& row) {
    for (const std::string& column : row) {
      out_ << "| " << column << ' ';
    }
    out_ << "|\n";
  };
  print(header());
  out_ << "|---|---|--:|--:|---|\n";
  for (const Row& row : rows_) {
    print(row);
  }
  out_.flush();
}

void ValidationTable::print_text() const {
  std::vector<Row> lines{header()};
  lines.insert(lines.end(), rows_.begin(), rows_.end());
  std::vector<std::size_t> width(lines.front().size(), 0);
  for (const Row& line : lines) {
    for (std::size_t i = 0; i < width.size(); ++i) {
      width[i] = std::max(width[i], line[i].size());
    }
  }
  out_ << '\n';
  for (const Row& line : lines) {
    for (std::size_t i = 0; i + 1 < width.size(); ++i) {
      out_ << std::left << std::setw(static_cast<int>(width[i]) + 2) << line[i];
    }
    out_ << line.back() << '\n';
  }
  out_.flush();
}

void FailurePrinter::OnTestPartResult(const testing::TestPartResult& result) {
  if (result.failed()) {
    out_ << (result.file_name() != nullptr ? result.file_name() : "") << ':' << result.line_number()
         << ": " << result.message() << std::endl;
  }
}

}  // namespace oblique::validation
