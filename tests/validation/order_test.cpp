#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "tests/validation/both_ways.h"
#include "tests/validation/validation_table.h"
#include "tests/worker/solver/reference/from_eliminated.h"
#include "worker/solver/reference/contact.h"

namespace oblique::validation {
namespace {

using solver::ChainState;
using solver::Contact;
using solver::ContactParameters;
using solver::Motion;

/// Final state of a run, in vectors that can be subtracted.
struct Outcome {
  std::vector<double> position;
  std::vector<double> velocity;
  std::vector<double> multipliers;
  std::vector<double> events_s;
};

constexpr solver::AffineContactForce<double> kNoContact{};

std::vector<double> in_turn(const Eigen::Matrix2Xd& columns) {
  return {columns.data(), columns.data() + columns.size()};
}

solver::Coordinates in_columns(const std::vector<double>& values) {
  return Eigen::Matrix2Xd::Map(values.data(), 2, static_cast<Eigen::Index>(values.size() / 2));
}

void add_state(const Motion& motion, const solver::AffineContactForce<double>& force,
               const ChainState& state, Outcome& outcome) {
  Eigen::Matrix2Xd reactions_N;
  motion.reactions(force, state, reactions_N);
  outcome.position = in_turn(state.q);
  outcome.velocity = in_turn(state.v);
  outcome.multipliers = in_turn(reactions_N);
}

/// Returns the state after `steps` steps of free motion.
Outcome fall_for(const Motion& motion, ChainState state, double duration_s, int steps) {
  ChainState next = state;
  motion.restart(kNoContact, state);
  for (int i = 0; i < steps; ++i) {
    motion.step(state, kNoContact, duration_s / steps, next);
    std::swap(state, next);
  }
  Outcome outcome;
  add_state(motion, kNoContact, state, outcome);
  return outcome;
}

/// Follows a contact from touch to `end_s`. Returns the final state and the times of the events.
Outcome contact_until(const Motion& motion, const ContactParameters& parameters, ChainState state,
                      double dt_s, double end_s) {
  Contact contact(parameters, motion.tip(state), {dt_s, dt_s});
  motion.restart(contact.force(), state);
  Outcome outcome;
  ChainState trial = state;
  while (!contact.finished()) {
    const double left_s = end_s - contact.time_s();
    if (contact.trial_step_s() >= left_s && contact.trial_step_s() == dt_s) {
      motion.step(state, contact.force(), left_s, trial);
      std::swap(state, trial);
      break;
    }
    const auto integrals = motion.step(state, contact.force(), contact.trial_step_s(), trial);
    const int events = contact.events();
    if (!contact.judge(motion.tip(trial), integrals)) {
      continue;
    }
    std::swap(state, trial);
    if (contact.events() != events) {
      motion.restart(contact.force(), state);
      outcome.events_s.push_back(contact.time_s());
    }
  }
  add_state(motion, contact.force(), state, outcome);
  return outcome;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += (a[i] - b.at(i)) * (a[i] - b.at(i));
  }
  return std::sqrt(sum);
}

/// Converts the final state of the explicit integrator to the coordinates of the constrained chain.
Outcome in_constrained_coordinates(Outcome outcome, const solver::GeneralizedAlphaMotion& motion) {
  ChainState state;
  state.q = in_columns(outcome.position);
  state.v = in_columns(outcome.velocity);
  state = from_eliminated(motion.chain(), state);
  outcome.position = in_turn(state.q);
  outcome.velocity = in_turn(state.v);
  return outcome;
}

/// Collects the smallest observed order of convergence of each part of an Outcome over several
/// runs.
class SmallestOrders {
 public:
  /// Adds the orders that follow from the errors of two runs. The second run has half the step of
  /// the first. `right` is the exact outcome.
  void add(const Outcome& at_step, const Outcome& at_half, const Outcome& right) {
    for (std::size_t i = 0; i < kParts.size(); ++i) {
      const auto part = kParts[i].values;
      if ((right.*part).empty()) {
        continue;
      }
      ASSERT_EQ((at_step.*part).size(), (right.*part).size());
      ASSERT_EQ((at_half.*part).size(), (right.*part).size());
      const double order =
          std::log2(distance(at_step.*part, right.*part) / distance(at_half.*part, right.*part));
      smallest_[i] = std::min(smallest_[i], order);
    }
  }

  void expect_at_least_order(const std::string& title, const std::string& reference,
                             double least) const {
    for (std::size_t i = 0; i < kParts.size(); ++i) {
      if (std::isfinite(smallest_[i])) {
        expect_at_least({title + ": order of " + kParts[i].name, reference, smallest_[i], least,
                         "the method's order is " + std::to_string(std::lround(least))});
      }
    }
  }

 private:
  struct Part {
    const char* name;
    std::vector<double> Outcome::*values;
  };
  static constexpr std::array<Part, 4> kParts{{{"positions", &Outcome::position},
                                               {"velocities", &Outcome::velocity},
                                               {"multipliers", &Outcome::multipliers},
                                               {"instants of events", &Outcome::events_s}}};
  std::array<double, kParts.size()> smallest_{HUGE_VAL, HUGE_VAL, HUGE_VAL, HUGE_VAL};
};

/// Returns a chain of links so soft that the fall bends them far. The paper's links vibrate so
/// little in the fall that rounding would dominate the errors.
solver::ModelParameters soft_chain() {
  solver::ModelParameters model = solver::preset("paper");
  model.E_Pa *= 1e-4;
  return model;
}
constexpr double kFall_s = 0.2;
/// A time before the end of the shortest of the ten contacts.
constexpr double kContact_s = 330e-6;

TEST(Order, OfTheExplicitIntegratorIsFourInTheFall) {
  const solver::Chain chain(soft_chain());
  const solver::ExplicitMotion motion(chain);
  const auto at = [&](int steps) { return fall_for(motion, chain.at_rest(), kFall_s, steps); };
  SmallestOrders orders;
  orders.add(at(2000), at(4000), at(16000));
  orders.expect_at_least_order("fall of soft links, explicit, 100 to 50 us", "the same at 12.5 us",
                               3.8);
}

TEST(Order, OfGeneralizedAlphaIsTwoInTheFall) {
  const solver::Chain chain(soft_chain());
  const solver::ExplicitMotion right(chain);
  const solver::GeneralizedAlphaMotion motion(soft_chain());
  const auto at = [&](int steps) { return fall_for(motion, motion.at_rest(), kFall_s, steps); };
  SmallestOrders orders;
  orders.add(at(10000), at(20000),
             in_constrained_coordinates(fall_for(right, chain.at_rest(), kFall_s, 16000), motion));
  orders.expect_at_least_order("fall of soft links, generalized-alpha, 20 to 10 us",
                               "explicit, 12.5 us", 1.9);
}

TEST(Order, OfTheExplicitIntegratorIsFourInContactWithEvents) {
  const BothWays both(solver::preset("paper"));
  SmallestOrders orders;
  for (const Point& point : kPublishedPoints) {
    const auto at = [&](double dt_s) {
      return contact_until(both.by_explicit(), both.contact(point), both.explicit_touch(point.H_m),
                           dt_s, kContact_s);
    };
    orders.add(at(1e-6), at(0.5e-6), at(0.125e-6));
  }
  orders.expect_at_least_order("ten published contacts, explicit, 1 to 0.5 us",
                               "the same at 0.125 us", 3.8);
}

TEST(Order, OfGeneralizedAlphaIsTwoInContactWithEvents) {
  const BothWays both(solver::preset("paper"));
  SmallestOrders orders;
  for (const Point& point : kPublishedPoints) {
    const auto at = [&](double dt_s) {
      return contact_until(both.by_generalized_alpha(), both.contact(point),
                           both.generalized_alpha_touch(point.H_m), dt_s, kContact_s);
    };
    const Outcome right = contact_until(both.by_explicit(), both.contact(point),
                                        both.explicit_touch(point.H_m), 0.25e-6, kContact_s);
    orders.add(at(1e-7), at(0.5e-7),
               in_constrained_coordinates(right, both.by_generalized_alpha()));
  }
  orders.expect_at_least_order("ten published contacts, generalized-alpha, 0.1 to 0.05 us",
                               "explicit, 0.25 us", 1.9);
}

}  // namespace
}  // namespace oblique::validation
