// The bytes of a point's picture. OBLIQUE_WRITE_GOLDEN=1 writes the file anew: look at it before it
// is committed.
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "client/plot/point/panels.h"
#include "tests/client/plot/point/history_of_tests.h"

namespace oblique::client::plot {
namespace {

TEST(PointGolden, AllPanels) {
  const std::string path = OBLIQUE_SOURCE_DIR "/tests/client/plot/golden/point.svg";
  const std::string drawn = svg_of(sheet_of(test::small_history(), {}), {1000.0, 1000.0});
  if (std::getenv("OBLIQUE_WRITE_GOLDEN") != nullptr) {
    std::ofstream(path, std::ios::binary) << drawn;
  }
  std::ifstream file(path, std::ios::binary);
  const std::string golden{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  EXPECT_TRUE(drawn == golden) << "drawn otherwise than " << path;
}

}  // namespace
}  // namespace oblique::client::plot
