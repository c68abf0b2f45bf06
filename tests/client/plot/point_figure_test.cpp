// Figures of the time history of one point.
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/plot/picture_file.h"
#include "client/plot/point_figure.h"
#include "worker/solver/model/errors.h"

namespace oblique::client::plot {
namespace {

using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;

/// An invented contact of 200 us whose force rises and falls. The tip sticks for a quarter of the
/// time, compression takes a half, and e* = 0.5 makes restitution four times as stiff.
PointHistory small_history() {
  PointHistory history{.name = "Point 3 of a study",
                       .model = solver::preset("paper"),
                       .H_m = 1.0,
                       .mu = 1.2,
                       .e_star = 0.5};
  constexpr int kSteps = 20;
  for (int i = 0; i <= kSteps; ++i) {
    const double share = static_cast<double>(i) / kSteps;
    const double force_N = 4000.0 * share * (1.0 - share);
    const bool compresses = i < kSteps / 2;
    const double depth_m = compresses ? force_N / 1e7 : 1e-4 - (1000.0 - force_N) / 4e7;
    const bool sticks = i < kSteps / 4;
    const double xP_m = sticks ? 0.6 : 0.6 - 1e-4 * (share - 0.25);
    const double ux_m = -force_N / 1e7;
    history.rows.push_back({.t_s = 2e-4 * share,
                            .fn_N = force_N,
                            .ft_N = force_N,
                            .uy_m = -depth_m,
                            .ux_m = ux_m,
                            .xP_m = xP_m,
                            .vP_m_s = sticks ? 0.0 : -0.5,
                            .x_m = xP_m + ux_m,
                            .y_m = -1.0 - depth_m,
                            .vt_m_s = -5.0 + 4.0 * share,
                            .vn_m_s = -5.0 + 10.0 * share,
                            .state = std::string(sticks ? "S" : "s") + (compresses ? "C" : "R"),
                            .kinetic_J = 9.0 - share,
                            .strain_J = 0.5 * share,
                            .gravity_J = -3.0,
                            .momentum_x_Ns = 0.0,
                            .momentum_y_Ns = 0.0,
                            .reactions_N = {},
                            .nodes_m = {0.0, 0.0, 0.3, -0.75, 0.6 - 0.001 * share, -1.0}});
  }
  history.falls = {{0.5, {0.0, 0.0, 0.4, -0.5, 0.9, -0.5}}};
  return history;
}

TEST(PointSpans, ListPhasesBeforeStickIntervals) {
  const auto spans = panel_of(small_history(), PointPanel::kForces).spans;
  ASSERT_EQ(spans.size(), 3U);
  EXPECT_EQ(spans[0].kind, Span::Kind::kCompression);
  EXPECT_DOUBLE_EQ(spans[0].from, 0.0);
  EXPECT_DOUBLE_EQ(spans[0].to, 1e-4);
  EXPECT_EQ(spans[1].kind, Span::Kind::kRestitution);
  EXPECT_DOUBLE_EQ(spans[1].from, 1e-4);
  EXPECT_DOUBLE_EQ(spans[1].to, 2e-4);
  EXPECT_EQ(spans[2].kind, Span::Kind::kStick);
  EXPECT_DOUBLE_EQ(spans[2].to, 5e-5);
}

TEST(PointPanels, HysteresisSeparatesBranchesThatMeetAtTheTurn) {
  const auto curves = panel_of(small_history(), PointPanel::kLoop).curves;
  ASSERT_EQ(curves.size(), 2U);
  EXPECT_EQ(curves[0].name, "compression");
  ASSERT_EQ(curves[0].x.size(), 12U);  // eleven instants and one gap
  EXPECT_DOUBLE_EQ(curves[0].y[10], 1000.0);
  EXPECT_TRUE(std::isnan(curves[0].x[11]));
  EXPECT_DOUBLE_EQ(curves[1].x[0], curves[0].x[10]);
  EXPECT_GT(curves[1].x[10], 0.0) << "an indentation remains when the normal force is zero";
}

TEST(PointEnergies, AreLostByPOrStoredInTheElement) {
  const auto history = small_history();
  const auto curves = panel_of(history, PointPanel::kEnergies).curves;
  ASSERT_EQ(curves.size(), 5U);
  const auto& friction = curves[3].y;
  const auto& element = curves[4].y;
  EXPECT_DOUBLE_EQ(friction[5], 0.0) << "P sticks";
  // During stick both contact elements are springs with energy force * deformation / 2.
  const auto& stuck = history.rows[5];
  EXPECT_NEAR(element[5], 0.5 * stuck.fn_N * (-stuck.uy_m - stuck.ux_m), 1e-12);
  // At the end the tangential spring has no energy, and the normal one has lost 1 - e*^2 of it.
  EXPECT_NEAR(element.back(), 0.5 * 1000.0 * 1e-4 * (1.0 - 0.25), 1e-12);
  EXPECT_GT(friction.back(), 0.0);
  EXPECT_DOUBLE_EQ(curves[0].y.back(), -1.0);
}

TEST(PointShape, HasEqualScales) {
  const Figure figure = point_figure(small_history(), PointPanel::kShape);
  EXPECT_TRUE(figure.panels[0].has_equal_aspect);
  EXPECT_THAT(figure.panels[0].curves,
              ElementsAre(Field(&Curve::name, "at rest"), Field(&Curve::name, "drop 0.5 m"),
                          Field(&Curve::name, "at touch"), Field(&Curve::name, "at separation"),
                          Field(&Curve::name, "ground")));
}

TEST(PointFigure, HasSixPanelsOrTheRequestedOne) {
  const Figure all = point_figure(small_history(), {});
  EXPECT_EQ(all.panels.size(), 6U);
  EXPECT_EQ(all.columns, 2U);
  EXPECT_EQ(all.title, "Point 3 of a study");
  const Figure one = point_figure(small_history(), PointPanel::kVelocities);
  ASSERT_EQ(one.panels.size(), 1U);
  EXPECT_EQ(one.title, "Point 3 of a study: Velocities");
  EXPECT_FALSE(one.panels[0].spans.empty());
}

TEST(PointFigure, IsDrawnForAContactWithoutForce) {
  auto history = small_history();
  history.rows.resize(1);
  EXPECT_THAT(script_of(point_figure(history, {}), PictureFormat::kSvg, {}), HasSubstr("plot "));
  history.rows.clear();
  history.falls.clear();
  EXPECT_THAT(script_of(point_figure(history, {}), PictureFormat::kSvg, {}), HasSubstr("plot "));
}

TEST(PointFigure, AsATableHasAllPanels) {
  const auto csv = csv_of(point_figure(small_history(), {}));
  for (const char* heading :
       {"line,t_s,force_N\n", "line,minus_uy_m,fn_N\n", "line,t_s,energy_J\n", "line,x_m,y_m\n"}) {
    EXPECT_THAT(csv, HasSubstr(heading));
  }
  EXPECT_THAT(csv, HasSubstr("normal force F_n,0.0001,1000\n"));
}

TEST(PointPanels, AreFoundByNameAndSuggested) {
  EXPECT_EQ(point_panel_named(""), std::nullopt);
  EXPECT_EQ(point_panel_named("shape"), PointPanel::kShape);
  try {
    (void)point_panel_named("loops");
    FAIL();
  } catch (const solver::InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("--panel loops is not allowed"));
    EXPECT_THAT(error.what(), HasSubstr("forces, loop"));
  }
}

}  // namespace
}  // namespace oblique::client::plot
