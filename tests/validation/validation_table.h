#pragma once

#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

namespace oblique::validation {

/// One line of the table.
struct Check {
  std::string what;       ///< what is measured
  std::string reference;  ///< where the right answer comes from
  double measured;
  double bound;
  std::string reason;  ///< where the bound comes from
};

/// Fails the running test unless measured <= bound, and adds a line to the table. Texts must not
/// hold '|', which separates the columns.
void expect_at_most(const Check& check);
/// The same for measured >= bound.
void expect_at_least(const Check& check);

enum class TableFormat { kText, kMarkdown };

/// Gathers the lines of all tests that run and prints them as one table when the program ends.
/// Lines travel as properties of their test, so reports in XML hold them too.
class ValidationTable : public testing::EmptyTestEventListener {
 public:
  /// `out` must outlive this.
  ValidationTable(TableFormat format, std::ostream& out) : format_(format), out_(out) {}

  void OnTestEnd(const testing::TestInfo& test) override;
  void OnTestProgramEnd(const testing::UnitTest& program) override;

 private:
  using Row = std::vector<std::string>;
  void print_text() const;
  void print_markdown() const;

  TableFormat format_;
  std::ostream& out_;
  std::vector<Row> rows_;
};

/// Prints failures alone, for when standard output belongs to the table.
class FailurePrinter : public testing::EmptyTestEventListener {
 public:
  /// `out` must outlive this.
  explicit FailurePrinter(std::ostream& out) : out_(out) {}
  void OnTestPartResult(const testing::TestPartResult& result) override;

 private:
  std::ostream& out_;
};

}  // namespace oblique::validation
