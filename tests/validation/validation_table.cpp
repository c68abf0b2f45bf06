#include "tests/validation/validation_table.h"

#include <gtest/gtest.h>

#include <iomanip>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace oblique::validation {
namespace {

constexpr const char* kKeyPrefix = "check_";

std::string three_digits(double value) {
  std::ostringstream text;
  text << std::setprecision(3) << value;
  return text.str();
}

/// Adds the line to the properties of the running test, where ValidationTable finds it.
void record(const Check& check, const char* relation) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  std::ostringstream key;
  key << kKeyPrefix << std::setw(3) << std::setfill('0') << test->result()->test_property_count();
  std::ostringstream line;
  line << "| " << check.what << " | " << check.reference << " | " << three_digits(check.measured)
       << " | " << relation << ' ' << three_digits(check.bound) << " | " << check.reason << " |";
  testing::Test::RecordProperty(key.str(), line.str());
}

/// Collects the lines of all tests and prints them as one Markdown table at the end of the program.
/// The lines are properties of their tests, so XML reports contain them, too.
class ValidationTable : public testing::EmptyTestEventListener {
 public:
  void OnTestEnd(const testing::TestInfo& test) override {
    for (int i = 0; i < test.result()->test_property_count(); ++i) {
      const testing::TestProperty& property = test.result()->GetTestProperty(i);
      if (std::string(property.key()).starts_with(kKeyPrefix)) {
        rows_.emplace_back(property.value());
      }
    }
  }
  void OnTestProgramEnd(const testing::UnitTest&) override {
    std::cout << "| check | reference | measured | bound | reason for the bound |\n"
                 "|---|---|--:|--:|---|\n";
    for (const std::string& row : rows_) {
      std::cout << row << '\n';
    }
  }

 private:
  std::vector<std::string> rows_;
};

}  // namespace

void expect_at_most(const Check& check) {
  EXPECT_LE(check.measured, check.bound) << check.what;
  record(check, "<=");
}

void expect_at_least(const Check& check) {
  EXPECT_GE(check.measured, check.bound) << check.what;
  record(check, ">=");
}

}  // namespace oblique::validation

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  // GoogleTest takes ownership of its listeners.
  testing::UnitTest::GetInstance()->listeners().Append(
      std::make_unique<oblique::validation::ValidationTable>().release());
  return RUN_ALL_TESTS();
}
