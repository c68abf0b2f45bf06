#include "client/commands/command_line.h"

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

TEST(HelpText, GoesOnBelowAMeaning) {
  EXPECT_EQ(fitted_help("  --at N    one two three four\n  --b       five\n", 20, 12),
            "  --at N    one two\n"
            "            three\n"
            "            four\n"
            "  --b       five\n");
}

TEST(HelpText, MovesTheRestOfASentenceToTheNextLine) {
  EXPECT_EQ(fitted_help("one two three\nfour five\n\nsix seven eight\n", 10, 12),
            "one two\nthree four\nfive\n\nsix seven\neight\n");
}

TEST(HelpText, LeavesCommandsAndLongWordsWhole) {
  const std::string help = "Examples:\n  oblique run a.toml   a study here\nabcdefghijklmnop\n";
  EXPECT_EQ(fitted_help(help, 12, 20), help);
}

}  // namespace
}  // namespace oblique::client
