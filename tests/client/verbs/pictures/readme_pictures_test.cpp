// The pictures of READMEs are what the programs draw. deploy/pictures/make draws them anew.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/programs.h"

namespace oblique::client {
namespace {

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string kept_picture(const std::string& name) {
  return text_of_file(std::filesystem::path(OBLIQUE_SOURCE_DIR) / "deploy/pictures" / name);
}

/// The picture with ids that say nothing of its numbers.
std::string without_ids(const std::string& svg) {
  return std::regex_replace(svg, std::regex("p[0-9a-f]{8}-"), "own-");
}

/// The picture without the file of its cells, whose bytes are zlib's.
std::string without_cells(std::string svg) {
  const std::string mark = "data:image/png;base64,";
  if (const auto begin = svg.find(mark); begin != std::string::npos) {
    svg.erase(begin, svg.find('"', begin) - begin);
  }
  return svg;
}

/// Where two pictures part, with numbers that differ by less than is seen taken as the same:
/// another instruction set rounds otherwise. Empty: nowhere.
std::string first_difference(const std::string& kept_svg, const std::string& drawn_svg) {
  constexpr double kUnseen = 0.05;  // pixels
  const std::string kept = without_ids(kept_svg);
  const std::string drawn = without_ids(drawn_svg);
  const char* a = kept.c_str();
  const char* b = drawn.c_str();
  const auto is_number = [](const char* at) {
    return (*at >= '0' && *at <= '9') || *at == '-' || *at == '.';
  };
  while (*a != '\0' || *b != '\0') {
    if (is_number(a) && is_number(b)) {
      char* end_a = nullptr;
      char* end_b = nullptr;
      const double difference = std::strtod(a, &end_a) - std::strtod(b, &end_b);
      if (end_a != a && end_b != b && std::abs(difference) <= kUnseen) {
        a = end_a;
        b = end_b;
        continue;
      }
    }
    if (*a != *b) {
      return std::string(a).substr(0, 60) + " <> " + std::string(b).substr(0, 60);
    }
    ++a;
    ++b;
  }
  return {};
}

TEST(ReadmePictures, TheMapOfModesIsThatOfItsStudy) {
  const test::TemporaryFolder folder;
  const std::string study = OBLIQUE_SOURCE_DIR "/deploy/pictures/modes.toml";
  ASSERT_EQ(test::run_oblique(folder, {"run", study, "--db", "modes.db"}).exit_code, 0);
  const auto drawn = test::run_oblique(
      folder, {"plot", "modes", "--db", "modes.db", "--map", "major_mode", "--format", "svg"});
  ASSERT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_EQ(first_difference(without_cells(kept_picture("modes.svg")), without_cells(drawn.out)),
            "");
}

TEST(ReadmePictures, TheImpactIsThatOfItsPoint) {
  const auto drawn =
      test::run_oblique({"plot", "--H", "1", "--mu", "1.2", "--e", "0.8", "--format", "svg"});
  ASSERT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_EQ(first_difference(kept_picture("impact.svg"), drawn.out), "");
}

TEST(ReadmePictures, TheForcesAreThePapersFigure) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(test::run_oblique(folder, {"paper", "--figures", "."}).exit_code, 0);
  EXPECT_EQ(
      first_difference(kept_picture("forces.svg"), text_of_file(folder.path() / "fig4_forces.svg")),
      "");
}

TEST(ReadmePictures, AreShownThere) {
  const std::filesystem::path tree(OBLIQUE_SOURCE_DIR);
  EXPECT_NE(text_of_file(tree / "README.md").find("(deploy/pictures/modes.svg)"),
            std::string::npos);
  const auto readme = text_of_file(tree / "deploy/pictures/README.md");
  for (const std::string name : {"modes.svg", "impact.svg", "forces.svg"}) {
    EXPECT_NE(readme.find("](" + name + ")"), std::string::npos);
    EXPECT_FALSE(kept_picture(name).empty());
  }
}

}  // namespace
}  // namespace oblique::client
