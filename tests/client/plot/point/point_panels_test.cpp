// What pictures of one point show.
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/figures/legend.h"
#include "client/plot/point/panels.h"
#include "tests/client/plot/point/history_of_tests.h"
#include "worker/solver/model/errors.h"

namespace oblique::client::plot {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::Not;

TEST(PointSpans, ArePhasesAndOverThemStick) {
  const auto spans = spans_of(test::small_history());
  ASSERT_EQ(spans.size(), 3U);
  EXPECT_EQ(spans[0].name, "compression");
  EXPECT_DOUBLE_EQ(spans[0].from, 0.0);
  EXPECT_DOUBLE_EQ(spans[0].to, 1e-4);
  EXPECT_EQ(spans[1].name, "restitution");
  EXPECT_DOUBLE_EQ(spans[1].from, 1e-4);
  EXPECT_DOUBLE_EQ(spans[1].to, 2e-4);
  EXPECT_EQ(spans[2].name, "stick");
  EXPECT_DOUBLE_EQ(spans[2].to, 5e-5);
}

TEST(PointSpans, ThatComeAgainAreSpansOfTheirOwn) {
  auto history = test::small_history();
  history.rows[15].state = "SR";
  const auto spans = spans_of(history);
  ASSERT_EQ(spans.size(), 4U);
  EXPECT_DOUBLE_EQ(spans[3].from, 1.5e-4);
  EXPECT_DOUBLE_EQ(spans[3].to, 1.6e-4);
}

TEST(PointPanels, OverTimeReachFromTouchToSeparation) {
  for (const auto panel : {PointPanel::kForces, PointPanel::kDeformation, PointPanel::kVelocities,
                           PointPanel::kEnergies}) {
    const Figure figure = figure_of(test::small_history(), panel, true);
    EXPECT_EQ(figure.panels[0].x.range, (Range{0.0, 2e-4}));
    EXPECT_EQ(figure.panels[0].x.label, "time since touch [\u00b5s]");
  }
}

TEST(PointPanels, HysteresisPartsBranchesAndJoinsThemAtTheTurn) {
  const Figure figure = figure_of(test::small_history(), PointPanel::kLoop, false);
  const auto& curves = figure.panels[0].curves;
  ASSERT_EQ(curves.size(), 2U);
  EXPECT_EQ(curves[0].name, "compression");
  ASSERT_EQ(curves[0].x.size(), 12U);  // eleven instants and the gap
  EXPECT_DOUBLE_EQ(curves[0].y[10], 1000.0);
  EXPECT_TRUE(std::isnan(curves[0].x[11]));
  EXPECT_DOUBLE_EQ(curves[1].x[0], curves[0].x[10]);
  EXPECT_GT(curves[1].x[10], 0.0) << "an indentation is left";
}

TEST(PointEnergies, WhatTheTipGivesIsLostByPOrIsInTheElement) {
  const auto history = test::small_history();
  const auto energies = energies_of(history);
  EXPECT_DOUBLE_EQ(energies.friction[5], 0.0) << "P sticks";
  // While it sticks both elements are springs: a half of force times deformation each.
  const auto& stuck = history.rows[5];
  EXPECT_NEAR(energies.element[5], 0.5 * stuck.fn_N * (-stuck.uy_m - stuck.ux_m), 1e-12);
  // In the end the tangential spring is empty, and the normal one has lost 1 - e*^2 of its work.
  EXPECT_NEAR(energies.element.back(), 0.5 * 1000.0 * 1e-4 * (1.0 - 0.25), 1e-12);
  EXPECT_GT(energies.friction.back(), 0.0);
  EXPECT_DOUBLE_EQ(energies.kinetic.back(), -1.0);
}

TEST(PointShape, HasOneScaleUpwardsAndSideways) {
  const Figure figure = figure_of(test::small_history(), PointPanel::kShape, false);
  EXPECT_TRUE(figure.panels[0].has_equal_aspect);
  EXPECT_THAT(figure.panels[0].curves,
              ElementsAre(Field(&Curve::name, "at rest"), Field(&Curve::name, "drop 0.5 m"),
                          Field(&Curve::name, "at touch"), Field(&Curve::name, "at separation"),
                          Field(&Curve::name, "ground")));
  EXPECT_EQ(shape_note(test::small_history()),
            "From touch to separation no node moves farther than 1 mm.");
}

TEST(PointSheet, NamesShadingsOnce) {
  const Sheet all = sheet_of(test::small_history(), {});
  ASSERT_EQ(all.parts.size(), 6U);
  EXPECT_THAT(legend_of(all.parts[0]), Contains(Field(&LegendEntry::name, "stick")));
  for (std::size_t i = 1; i < 6; ++i) {
    EXPECT_THAT(legend_of(all.parts[i]), Not(Contains(Field(&LegendEntry::name, "stick"))));
  }
  const Sheet one = sheet_of(test::small_history(), PointPanel::kVelocities);
  ASSERT_EQ(one.parts.size(), 1U);
  EXPECT_THAT(legend_of(one.parts[0]), Contains(Field(&LegendEntry::name, "stick")));
}

TEST(PointSheet, IsDrawnOfAContactThatIsNone) {
  auto history = test::small_history();
  history.rows.clear();
  history.falls.clear();
  EXPECT_THAT(svg_of(sheet_of(history, {}), {1040.0, 1080.0}), HasSubstr("</svg>"));
  history = test::small_history();
  history.rows.resize(1);
  EXPECT_THAT(svg_of(sheet_of(history, {}), {1040.0, 1080.0}), HasSubstr("</svg>"));
}

TEST(PointPanels, AreFoundByNameAndSuggested) {
  EXPECT_EQ(point_panel_named(""), std::nullopt);
  EXPECT_EQ(point_panel_named("shape"), PointPanel::kShape);
  try {
    (void)point_panel_named("loops");
    FAIL();
  } catch (const solver::InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("--panel loops is not known"));
    EXPECT_THAT(error.what(), HasSubstr("forces, loop"));
  }
}

}  // namespace
}  // namespace oblique::client::plot
