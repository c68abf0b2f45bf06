#include "client/io/console.h"

#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

/// Writes a message of each kind and returns those that appear at this verbosity.
std::string written_at(Verbosity verbosity) {
  std::ostringstream out;
  std::ostringstream err;
  Console console(out, err);
  console.set_verbosity(verbosity);
  console.out() << "data\n";
  console.notes() << "progress\n";
  console.note("note");
  console.detail("detail");
  console.error("oblique query", "wrong");
  EXPECT_EQ(out.str(), "data\n");
  return err.str();
}

TEST(Console, WritesWhatTheVerbosityAllows) {
  EXPECT_EQ(written_at(Verbosity::kQuiet), "oblique query: wrong\n");
  EXPECT_EQ(written_at(Verbosity::kNormal), "progress\nnote\noblique query: wrong\n");
  EXPECT_EQ(written_at(Verbosity::kVerbose), "progress\nnote\ndetail\noblique query: wrong\n");
}

TEST(Console, MakesControlCharactersVisibleAndColoursErrorsOnlyIfAllowed) {
  std::ostringstream out;
  std::ostringstream err;
  Console console(out, err, {.is_terminal = true, .has_colours = true});
  console.note("a\x1b[2J\nb");
  console.error("oblique", "c\x1b\nd");
  EXPECT_EQ(err.str(), "a\\x1b[2J\\nb\n\x1b[1;31moblique:\x1b[0m c\\x1b\nd\n");
}

TEST(Units, AreChosenSoThatNumbersAreReadable) {
  EXPECT_EQ(format_duration(0.42), "0.4 s");
  EXPECT_EQ(format_duration(185), "3 min 05 s");
  EXPECT_EQ(format_duration(7800), "2 h 10 min");
  EXPECT_EQ(format_duration(273600), "3 d 04 h");
  EXPECT_EQ(format_bytes(1'300'000), "1.3 MB");
  EXPECT_EQ(format_rate(14'345), "14,300");
  EXPECT_EQ(counted(1, "point", "points"), "1 point");
}

}  // namespace
}  // namespace oblique::client
