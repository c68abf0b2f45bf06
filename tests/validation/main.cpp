#include <gtest/gtest.h>

#include <iostream>
#include <memory>
#include <string_view>

#include "tests/validation/validation_table.h"

namespace {

constexpr std::string_view kHelp =
    "Usage: oblique-validation [--markdown] [GoogleTest flags]\n"
    "Runs the validation suite of the solver and prints a table of its checks.\n"
    "  --markdown   nothing but the table on standard output, as Markdown\n"
    "  --gtest_help the flags of GoogleTest, as --gtest_filter=FreeFall.*\n";

}  // namespace

int main(int argc, char** argv) {
  using oblique::validation::TableFormat;
  // GoogleTest would answer --help itself.
  if (argc == 2 && std::string_view(argv[1]) == "--help") {
    std::cout << kHelp;
    return 0;
  }
  testing::InitGoogleTest(&argc, argv);
  TableFormat format = TableFormat::kText;
  for (int i = 1; i < argc; ++i) {
    if (std::string_view(argv[i]) != "--markdown") {
      std::cerr << argv[i] << " is no flag of this program\n" << kHelp;
      return 2;
    }
    format = TableFormat::kMarkdown;
  }
  // The unit test owns its listeners.
  testing::TestEventListeners& listeners = testing::UnitTest::GetInstance()->listeners();
  if (format == TableFormat::kMarkdown) {
    delete listeners.Release(listeners.default_result_printer());
    listeners.Append(std::make_unique<oblique::validation::FailurePrinter>(std::cerr).release());
  }
  listeners.Append(
      std::make_unique<oblique::validation::ValidationTable>(format, std::cout).release());
  return RUN_ALL_TESTS();
}
