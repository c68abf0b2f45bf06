#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/worker/solver/cases/shared_fingers.h"
#include "worker/solver/model/trace_columns.h"

namespace oblique::solver {
namespace {

/// The solver locates events to within this time.
constexpr double kLocated_s = 1e-13;

struct Traced {
  CaseResult result;
  std::vector<TraceRow> rows;
};

Traced traced(double H_m, double mu, double e_star) {
  Traced traced;
  Tracing tracing;
  tracing.sink = [&traced](const TraceRow& row) { traced.rows.push_back(row); };
  traced.result = coarse_finger().solve(H_m, mu, e_star, tracing);
  return traced;
}

/// Contacts with slip only, with stick and slip, with low restitution, and without friction.
const std::vector<Traced>& traces() {
  static const std::vector<Traced> list{traced(1.0, 0.4, 1.0), traced(1.0, 1.4, 0.8),
                                        traced(0.9, 0.9, 0.2), traced(0.9, 0.0, 0.8)};
  return list;
}

TEST(Trace, BeginsAtTouchWithoutForcesAndEndsAtSeparation) {
  for (const Traced& t : traces()) {
    const TraceRow& first = t.rows.front();
    EXPECT_EQ(first.t_s, 0.0);
    EXPECT_EQ(first.fn_N, 0.0);
    EXPECT_EQ(first.ft_N, 0.0);
    EXPECT_EQ(first.uy_m, 0.0);
    EXPECT_NEAR(first.y_m, -t.result.H_m, 1e-15);
    EXPECT_EQ(first.x_m, t.result.impact_x_m);
    EXPECT_EQ(first.vn_m_s, t.result.vn_in_m_s);
    EXPECT_EQ(first.state[1], 'C');
    const TraceRow& last = t.rows.back();
    EXPECT_EQ(last.t_s, t.result.duration_s);
    // The tolerance is the amount by which the force of the restitution spring changes in 1e-13 s.
    const double fn_N = kLocated_s * coarse_finger().model().k_N_m * std::abs(last.vn_m_s) /
                        (t.result.e_star * t.result.e_star);
    EXPECT_NEAR(last.fn_N, 0.0, fn_N);
    EXPECT_NEAR(last.ft_N, 0.0, t.result.mu * fn_N);
    EXPECT_EQ(last.vt_m_s, t.result.vt_out_m_s);
    EXPECT_EQ(last.vn_m_s, t.result.vn_out_m_s);
    EXPECT_EQ(last.state[1], 'R');
  }
}

TEST(Trace, ForcesStayInsideTheFrictionConeAndOnItInSlip) {
  for (const Traced& t : traces()) {
    for (const TraceRow& row : t.rows) {
      const double limit_N = t.result.mu * row.fn_N;
      EXPECT_GE(row.fn_N, -1e-6);
      EXPECT_LE(std::abs(row.ft_N), limit_N + 1e-6);
      if (row.state[0] == 's') {
        EXPECT_NEAR(std::abs(row.ft_N), limit_N, 1e-6);
        // The instant at which P stops has an error of up to 1e-13 s. In this time, a force of
        // 1e4 N at an acceleration of 1e4 m/s^2 reaches a power of 1e-5 W.
        EXPECT_LE(row.ft_N * row.vP_m_s, 1e-5) << "friction opposes the motion of P";
      }
    }
  }
}

TEST(Trace, ForcesFollowFromDeformationsAndPositions) {
  const ModelParameters& model = coarse_finger().model();
  for (const Traced& t : traces()) {
    for (const TraceRow& row : t.rows) {
      EXPECT_NEAR(row.ft_N, -model.k_N_m / model.eta2 * row.ux_m, 1e-6);
      EXPECT_NEAR(row.xP_m, row.x_m - row.ux_m, 1e-15);
      EXPECT_NEAR(row.uy_m, row.y_m + t.result.H_m, 1e-15);
    }
    // Until the end of the first compression the normal force is the force of the compression
    // spring.
    for (const TraceRow& row : t.rows) {
      if (row.state[1] == 'R') {
        break;
      }
      EXPECT_NEAR(row.fn_N, -model.k_N_m * row.uy_m, 1e-6);
    }
  }
}

TEST(Trace, PIsAtRestInStickAndMovesWithItsVelocityInSlip) {
  for (const Traced& t : traces()) {
    const double cone =
        t.result.mu * coarse_finger().model().eta2 / (t.result.e_star * t.result.e_star);
    double slide_m = 0.0;
    for (std::size_t i = 1; i < t.rows.size(); ++i) {
      const TraceRow& a = t.rows[i - 1];
      const TraceRow& b = t.rows[i];
      slide_m += std::abs(b.xP_m - a.xP_m);
      if (a.state[0] == 'S') {
        // The start of sliding has an error of up to 1e-13 s. In this time P moves by at most
        // `end_m`.
        const double end_m = kLocated_s * (std::abs(b.vt_m_s) + cone * std::abs(b.vn_m_s));
        EXPECT_NEAR(b.xP_m, a.xP_m, b.state[0] == 'S' ? 1e-15 : end_m);
        EXPECT_EQ(a.vP_m_s, 0.0);
      }
    }
    EXPECT_NEAR(slide_m, t.result.slide_m, 1e-12);
  }
}

TEST(Trace, ImpulsesAreTheIntegralsOfTheForces) {
  for (const Traced& t : traces()) {
    double impulse_n_Ns = 0.0;
    double impulse_t_Ns = 0.0;
    for (std::size_t i = 1; i < t.rows.size(); ++i) {
      const double half_s = 0.5 * (t.rows[i].t_s - t.rows[i - 1].t_s);
      impulse_n_Ns += half_s * (t.rows[i].fn_N + t.rows[i - 1].fn_N);
      impulse_t_Ns += half_s * (t.rows[i].ft_N + t.rows[i - 1].ft_N);
    }
    // The trapezoidal rule has a relative error of (omega h)^2/12 for the frequency omega.
    EXPECT_NEAR(impulse_n_Ns, t.result.impulse_n_Ns, 5e-3 * t.result.impulse_n_Ns);
    EXPECT_NEAR(impulse_t_Ns, t.result.impulse_t_Ns, 5e-3 * t.result.impulse_n_Ns);
  }
}

TEST(Trace, TangentialPeaksAreTheLocalMaximaOfTheTangentialForce) {
  std::vector<Traced> many = traces();
  for (const double mu : {0.7, 1.0, 1.3, 2.5}) {
    for (const double H_m : {0.1, 0.5, 1.1}) {
      many.push_back(traced(H_m, mu, 0.9));
    }
  }
  for (const Traced& t : many) {
    SCOPED_TRACE(t.result.mode);
    // Keeps one row per instant, because an event has two rows. Rows less than 1e-11 s apart count
    // as one instant. In this time the force changes by at most 1e-4 N.
    std::vector<TraceRow> rows;
    for (const TraceRow& row : t.rows) {
      if (rows.empty() || row.t_s > rows.back().t_s + 1e-11) {
        rows.push_back(row);
      }
    }
    std::vector<double> maxima_N;
    for (std::size_t i = 1; i + 1 < rows.size(); ++i) {
      const double ft_N = std::abs(rows[i].ft_N);
      if (ft_N > std::abs(rows[i - 1].ft_N) && ft_N > std::abs(rows[i + 1].ft_N)) {
        maxima_N.push_back(ft_N);
      }
    }
    ASSERT_EQ(t.result.ft_peaks.size(), maxima_N.size());
    for (std::size_t i = 0; i < maxima_N.size(); ++i) {
      EXPECT_NEAR(t.result.ft_peaks[i].ft_N, maxima_N[i], 1e-4);
    }
  }
}

TEST(Trace, EnergiesChangeByTheWorkOfTheContactForces) {
  for (const Traced& t : traces()) {
    const TraceRow& first = t.rows.front();
    const TraceRow& last = t.rows.back();
    const ContactEnergy& energy = t.result.energy;
    EXPECT_EQ(first.kinetic_J, energy.kinetic_in_J);
    EXPECT_NEAR(last.kinetic_J - first.kinetic_J, energy.kinetic_change_J, 1e-12);
    EXPECT_NEAR(last.strain_J - first.strain_J, energy.strain_change_J, 1e-12);
    EXPECT_NEAR(last.gravity_J - first.gravity_J, energy.gravity_change_J, 1e-12);
    EXPECT_LT(first.gravity_J, 0.0) << "the finger hangs below O";
    double work_J = 0.0;
    for (std::size_t i = 1; i < t.rows.size(); ++i) {
      const TraceRow& a = t.rows[i - 1];
      const TraceRow& b = t.rows[i];
      work_J +=
          0.5 * (a.fn_N + b.fn_N) * (b.y_m - a.y_m) + 0.5 * (a.ft_N + b.ft_N) * (b.x_m - a.x_m);
      const double change_J = (b.kinetic_J + b.strain_J + b.gravity_J) -
                              (first.kinetic_J + first.strain_J + first.gravity_J);
      EXPECT_NEAR(change_J, work_J, 2e-3 * energy.exchanged_J);
    }
  }
}

TEST(Trace, MomentumChangesByTheImpulsesOfPinContactAndWeight) {
  const ModelParameters& model = coarse_finger().model();
  double length_m = 0.0;
  for (const double link_m : model.lengths_m) {
    length_m += link_m;
  }
  const double weight_N = model.rho_kg_m3 * model.A_m2 * length_m * model.g_m_s2;
  for (const Traced& t : traces()) {
    const TraceRow& first = t.rows.front();
    double impulse_x_Ns = 0.0;
    double impulse_y_Ns = 0.0;
    double largest_Ns = 0.0;
    for (std::size_t i = 1; i < t.rows.size(); ++i) {
      const TraceRow& a = t.rows[i - 1];
      const TraceRow& b = t.rows[i];
      const double half_s = 0.5 * (b.t_s - a.t_s);
      impulse_x_Ns += half_s * (a.reactions_N[0] + b.reactions_N[0] + a.ft_N + b.ft_N);
      impulse_y_Ns +=
          half_s * (a.reactions_N[1] + b.reactions_N[1] + a.fn_N + b.fn_N - 2.0 * weight_N);
      largest_Ns = std::max({largest_Ns, std::abs(impulse_x_Ns), std::abs(impulse_y_Ns)});
      // The trapezoidal rule has a relative error of (omega h)^2/12 for the frequency omega.
      EXPECT_NEAR(b.momentum_x_Ns - first.momentum_x_Ns, impulse_x_Ns, 2e-2 * largest_Ns);
      EXPECT_NEAR(b.momentum_y_Ns - first.momentum_y_Ns, impulse_y_Ns, 2e-2 * largest_Ns);
    }
  }
}

Traced with_shape(const ModelParameters& model) {
  Traced traced;
  Tracing tracing;
  tracing.sink = [&traced](const TraceRow& row) { traced.rows.push_back(row); };
  tracing.with_shape = true;
  traced.result = Finger{model}.solve(0.9, 0.4, 1.0, tracing);
  return traced;
}

TEST(Trace, ShapeIsThatOfAChainFromThePinToTheTip) {
  const ModelParameters model = coarse_model(2);
  for (const TraceRow& row : with_shape(model).rows) {
    // Three links of two elements have seven nodes.
    ASSERT_EQ(row.nodes_m.size(), 14U);
    EXPECT_EQ(row.nodes_m[0], 0.0);
    EXPECT_EQ(row.nodes_m[1], 0.0);
    EXPECT_EQ(row.nodes_m[12], row.x_m);
    EXPECT_EQ(row.nodes_m[13], row.y_m);
    for (std::size_t node = 1; node < 7; ++node) {
      const double element_m = std::hypot(row.nodes_m[2 * node] - row.nodes_m[2 * node - 2],
                                          row.nodes_m[2 * node + 1] - row.nodes_m[2 * node - 1]);
      EXPECT_NEAR(element_m, 0.2, 0.002) << "links hardly bend or stretch";
    }
  }
  EXPECT_TRUE(traces()[0].rows[0].nodes_m.empty()) << "nodes are absent unless requested";
}

TEST(Trace, PeaksOfTheReactionsAgreeWithTheRows) {
  for (const Traced& t : traces()) {
    // Three links have reactions at the pin and at two joints.
    ASSERT_EQ(t.result.reaction_peaks.size(), 3U);
    for (std::size_t joint = 0; joint < 3; ++joint) {
      double largest_N = 0.0;
      for (const TraceRow& row : t.rows) {
        ASSERT_EQ(row.reactions_N.size(), 6U);
        largest_N = std::max(
            largest_N, std::hypot(row.reactions_N[2 * joint], row.reactions_N[2 * joint + 1]));
      }
      // A peak between two rows can exceed both by (omega h)^2/8 of the amplitude of the fastest
      // vibration. With one element per link, this amplitude is a large part of the reaction.
      EXPECT_GT(t.result.reaction_peaks[joint].force_N, 0.998 * largest_N);
      EXPECT_LT(t.result.reaction_peaks[joint].force_N, 1.02 * largest_N);
    }
  }
}

struct TraceWithFall {
  CaseResult result;
  std::vector<TraceRow> fall;
  std::vector<TraceRow> contact;
};

TraceWithFall traced_with_fall(const Finger& finger, bool with_fall = true) {
  TraceWithFall traced;
  const auto take = [&traced](const TraceRow& row) {
    (row.state == kFalling ? traced.fall : traced.contact).push_back(row);
    EXPECT_TRUE(row.state != kFalling || traced.contact.empty()) << "the fall comes first";
  };
  traced.result = finger.solve(0.9, 0.9, 0.7, {take, true, with_fall});
  return traced;
}

/// Fingers whose falls are solved by explicit steps, by collocation and by generalized-alpha.
const std::vector<Finger>& fingers() {
  static const std::vector<Finger> list = [] {
    ModelParameters by_steps = coarse_model();
    by_steps.integrator = Integrator::kGeneralizedAlpha;
    by_steps.dt_fall_s = 20e-6;
    by_steps.dt_s = 1e-6;
    return std::vector<Finger>{coarse_finger(), Finger{coarse_model(8)}, Finger{by_steps}};
  }();
  return list;
}

const std::vector<TraceWithFall>& falls() {
  static const std::vector<TraceWithFall> list = [] {
    std::vector<TraceWithFall> each;
    for (const Finger& finger : fingers()) {
      each.push_back(traced_with_fall(finger));
    }
    return each;
  }();
  return list;
}

TEST(FallOfATrace, GoesFromReleaseToTouchAtEvenlySpacedTimes) {
  for (const TraceWithFall& t : falls()) {
    ASSERT_EQ(t.fall.size(), static_cast<std::size_t>(kFallRows));
    const TraceRow& release = t.fall.front();
    EXPECT_EQ(release.t_s, -t.result.fall_time_s);
    EXPECT_EQ(release.y_m, 0.0);
    EXPECT_NEAR(release.x_m, 1.2, 1e-12);
    EXPECT_EQ(release.vn_m_s, 0.0);
    EXPECT_EQ(release.kinetic_J, 0.0);
    const double apart_s = t.result.fall_time_s / (kFallRows - 1);
    for (std::size_t i = 1; i < t.fall.size(); ++i) {
      EXPECT_NEAR(t.fall[i].t_s, t.fall[i - 1].t_s + apart_s, 1e-4 * apart_s) << i;
      EXPECT_LT(t.fall[i].y_m, t.fall[i - 1].y_m) << "the tip does not turn";
    }
  }
}

TEST(FallOfATrace, EndsAtTheFirstInstantOfTheContact) {
  for (const TraceWithFall& t : falls()) {
    TraceRow last = t.fall.back();
    EXPECT_EQ(last.t_s, 0.0);
    EXPECT_EQ(last.vP_m_s, last.vt_m_s) << "P moves with the tip before contact";
    last.vP_m_s = t.contact.front().vP_m_s;
    std::vector<double> before;
    std::vector<double> after;
    append_numbers(last, before);
    append_numbers(t.contact.front(), after);
    EXPECT_EQ(before, after);
  }
}

TEST(FallOfATrace, HasNoForceAndNoDeformationAtTheTip) {
  for (const TraceWithFall& t : falls()) {
    for (const TraceRow& row : t.fall) {
      EXPECT_EQ(row.fn_N, 0.0);
      EXPECT_EQ(row.ft_N, 0.0);
      EXPECT_EQ(row.uy_m, 0.0);
      EXPECT_EQ(row.ux_m, 0.0);
      EXPECT_EQ(row.xP_m, row.x_m);
    }
  }
}

TEST(FallOfATrace, DoesNotChangeTheContactOrTheResult) {
  for (std::size_t i = 0; i < fingers().size(); ++i) {
    const TraceWithFall without = traced_with_fall(fingers()[i], false);
    EXPECT_TRUE(without.fall.empty());
    ASSERT_EQ(without.contact.size(), falls()[i].contact.size());
    for (std::size_t row = 0; row < without.contact.size(); ++row) {
      std::vector<double> numbers;
      std::vector<double> with_fall;
      append_numbers(without.contact[row], numbers);
      append_numbers(falls()[i].contact[row], with_fall);
      ASSERT_EQ(numbers, with_fall) << row;
      ASSERT_EQ(without.contact[row].state, falls()[i].contact[row].state);
    }
    EXPECT_EQ(without.result.duration_s, falls()[i].result.duration_s);
    EXPECT_EQ(without.result.fn_peak_N, falls()[i].result.fn_peak_N);
    EXPECT_EQ(without.result.mode, falls()[i].result.mode);
  }
}

}  // namespace
}  // namespace oblique::solver
