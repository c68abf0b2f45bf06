// The pictures of READMEs are there. deploy/pictures/make draws them anew.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

namespace oblique::client {
namespace {

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(ReadmePictures, AreShownThere) {
  const std::filesystem::path tree(OBLIQUE_SOURCE_DIR);
  EXPECT_NE(text_of_file(tree / "README.md").find("(deploy/pictures/modes.svg)"),
            std::string::npos);
  const auto readme = text_of_file(tree / "deploy/pictures/README.md");
  for (const std::string name : {"modes.svg", "impact.svg", "forces.svg"}) {
    EXPECT_NE(readme.find("](" + name + ")"), std::string::npos);
    EXPECT_TRUE(text_of_file(tree / "deploy/pictures" / name).starts_with("<?xml"));
  }
}

}  // namespace
}  // namespace oblique::client
