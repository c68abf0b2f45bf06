// Maps that no hatching and no compression helps: they stay small, and lose nothing unsaid.
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/figures/svg_figure.h"
#include "tests/client/plot/figures_of_tests.h"

namespace oblique::client::plot {
namespace {

constexpr std::size_t kSide = 256;
constexpr std::size_t kCells = kSide * kSide;
constexpr std::size_t kMostBytes = 200'000;

/// Which of so many, the same on each machine.
std::vector<std::uint32_t> noise(std::size_t count, std::uint32_t kinds) {
  std::mt19937 random(7);
  std::vector<std::uint32_t> numbers;
  for (std::size_t i = 0; i < count; ++i) {
    numbers.push_back(static_cast<std::uint32_t>(random() % kinds));
  }
  return numbers;
}

Cells noisy_cells() {
  Cells cells = test::counted_cells(kSide, kSide);
  const auto values = noise(kCells, 1'000'000);
  cells.values.assign(values.begin(), values.end());
  return cells;
}

void scatter_states(Cells& cells, const std::vector<CellState>& states) {
  std::mt19937 random(11);
  for (std::size_t i = 0; i < cells.states.size(); ++i) {
    cells.states[i] = states[random() % states.size()];
    if (cells.states[i] != CellState::kSolved) {
      cells.values[i] = std::nan("");
    }
  }
}

std::vector<std::string> names_of(const std::vector<std::uint32_t>& kinds) {
  std::vector<std::string> names;
  for (const std::uint32_t kind : kinds) {
    names.push_back("mode " + std::to_string(kind));
  }
  return names;
}

Figure heat_of(Cells cells) {
  return heat_map(test::usual_axes(), quantity_of("fn_peak_N", "N"), std::move(cells));
}

TEST(HostileMap, OfNoiseStaysSmall) {
  EXPECT_LT(svg_of(heat_of(noisy_cells())).size(), kMostBytes);
}

TEST(HostileMap, OfNoiseInCellsOfUnequalSizeStaysSmall) {
  Cells cells = noisy_cells();
  for (auto* edges : {&cells.x_edges, &cells.y_edges}) {
    for (double& edge : *edges) {
      edge = edge * edge;
    }
  }
  EXPECT_LT(svg_of(heat_of(cells)).size(), kMostBytes);
}

TEST(HostileMap, WithHalfOfItsCellsMissingAtRandomStaysSmall) {
  Cells cells = noisy_cells();
  scatter_states(cells, {CellState::kSolved, CellState::kNoResult});
  EXPECT_LT(svg_of(heat_of(cells)).size(), kMostBytes);
}

TEST(HostileMap, OfCellsInEveryStateAtRandomStaysSmall) {
  Cells cells = noisy_cells();
  scatter_states(cells, {CellState::kSolved, CellState::kNoResult, CellState::kFailed,
                         CellState::kNoValue, CellState::kNoPoint});
  EXPECT_LT(svg_of(heat_of(cells)).size(), kMostBytes);
}

TEST(HostileMap, OfKindsAtRandomStaysSmall) {
  for (const std::uint32_t kinds : {2U, 5U, 13U, 1000U}) {
    EXPECT_LT(
        svg_of(test::modes_of(test::counted_cells(kSide, kSide), names_of(noise(kCells, kinds))))
            .size(),
        kMostBytes)
        << kinds;
  }
}

TEST(HostileMap, OfEveryOtherCellAnotherKindStaysSmall) {
  std::vector<std::uint32_t> chequered;
  for (std::size_t i = 0; i < kCells; ++i) {
    chequered.push_back((i % kSide + i / kSide) % 2 == 0 ? 0 : static_cast<std::uint32_t>(i));
  }
  EXPECT_LT(svg_of(test::modes_of(test::counted_cells(kSide, kSide), names_of(chequered))).size(),
            kMostBytes);
}

TEST(HostileMap, OfKindsWithGapsAtRandomStaysSmall) {
  Cells cells = test::counted_cells(kSide, kSide);
  scatter_states(cells, {CellState::kSolved, CellState::kNoResult, CellState::kFailed});
  EXPECT_LT(svg_of(test::modes_of(cells, names_of(noise(kCells, 13)))).size(), kMostBytes);
}

}  // namespace
}  // namespace oblique::client::plot
