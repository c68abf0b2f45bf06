#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"
#include "tests/worker/solver/cases/known_impacts.h"

namespace oblique::test {
namespace {

using solver::KnownImpact;

/// Allowed relative error at the default step.
constexpr double kTolerance = 3e-5;
/// Allowed error of instants, relative to the duration. Near a minimum the force is flat, so the
/// error of the default step moves the instant of the minimum by 0.003 µs.
constexpr double kTimeTolerance = 6e-6;

/// Compares a value with a known one that is rounded to multiples of `digit`.
void expect_close(double value, double known, double digit, const std::string& what) {
  EXPECT_NEAR(value, known, 0.5 * digit + kTolerance * std::abs(known)) << what;
}

std::string where(const KnownImpact& known, const std::string& table) {
  std::ostringstream sql;
  sql << " FROM " << table
      << " WHERE study_id = 1 AND point = (SELECT point FROM results WHERE H = " << known.H_m
      << " AND mu = " << known.mu << " AND e = " << known.e_star << ")";
  return sql.str();
}

void expect_forces(const Database& database, const KnownImpact& known, const std::string& name) {
  const auto peaks_N = database.numbers("SELECT fn_N" + where(known, "peaks") + " ORDER BY seq");
  ASSERT_EQ(peaks_N.size(), known.fn_peaks_N.size()) << name;
  for (std::size_t i = 0; i < peaks_N.size(); ++i) {
    expect_close(peaks_N[i], known.fn_peaks_N[i], 0.01, name + ": peak " + std::to_string(i));
  }
  EXPECT_EQ(database.texts("SELECT mode" + where(known, "results")).at(0), known.mode) << name;
  EXPECT_EQ(database.number("SELECT sum(major)" + where(known, "peaks")), known.major_peaks)
      << name;
}

void expect_times(const Database& database, const KnownImpact& known, const std::string& name) {
  const auto phases_us =
      database.numbers("SELECT 1e6 * (t1_s - t0_s)" + where(known, "phases") + " ORDER BY seq");
  ASSERT_EQ(phases_us.size(), known.phases_us.size()) << name;
  for (std::size_t i = 0; i < phases_us.size(); ++i) {
    // Phases end at extrema of the force. Errors of these times scale with the contact duration.
    EXPECT_NEAR(phases_us[i], known.phases_us[i], 0.0005 + kTimeTolerance * known.contact_us)
        << name << ": phase " << i;
  }
  EXPECT_NEAR(database.number("SELECT 1e6 * duration_s" + where(known, "results")),
              known.contact_us, 0.0005 + kTimeTolerance * known.contact_us)
      << name << ": duration";
  expect_close(database.number("SELECT 1e6 * stick_total_s" + where(known, "results")),
               known.stick_us, 0.01, name + ": stick");
  if (known.slide_mm > 0.0) {
    expect_close(database.number("SELECT 1e3 * slide_m" + where(known, "results")), known.slide_mm,
                 1e-5, name + ": slide");
  }
}

TEST(KnownAnswersTest, RealProcessesGiveTheKnownAnswersOfTheTenPublishedCases) {
  const TemporaryFolder folder;
  const Database database(folder.file("paper.db"));
  const Outcome ran =
      run_oblique(folder, {"run", OBLIQUE_PAPER_STUDY, "--db", folder.file("paper.db")});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  ASSERT_EQ(database.number("SELECT count(*) FROM results WHERE status = 'solved'"), 10);
  for (const KnownImpact& known : solver::known_impacts()) {
    std::ostringstream name;
    name << "H = " << known.H_m << ", mu = " << known.mu << ", e = " << known.e_star;
    expect_forces(database, known, name.str());
    expect_times(database, known, name.str());
  }
  EXPECT_LT(database.number("SELECT max(closure) FROM results"), 1e-4);
}

TEST(KnownAnswersTest, RunningTheSameStudyAgainSolvesNothing) {
  const TemporaryFolder folder;
  const std::string file = folder.file("paper.db");
  const Database database(file);
  const Outcome first = run_oblique(folder, {"run", OBLIQUE_PAPER_STUDY, "--db", file});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto solved_at = database.texts("SELECT solved_at FROM results ORDER BY point");
  const Outcome second = run_oblique(folder, {"run", OBLIQUE_PAPER_STUDY, "--db", file});
  EXPECT_EQ(second.exit_code, 0) << second.err;
  EXPECT_EQ(second.out, first.out);
  EXPECT_EQ(database.texts("SELECT solved_at FROM results ORDER BY point"), solved_at);
}

TEST(KnownAnswersTest, AFailedPointIsARowWithTheReasonAndTheOthersAreSolved) {
  const TemporaryFolder folder;
  const Database database(folder.file("steps.db"));
  // The step of 20 µs is above the stability limit, so this point fails.
  const Outcome ran = run_oblique(
      folder, {"run", "--preset", "paper", "--H", "1", "--mu", "0.4", "--e", "1", "--dt",
               "4e-6,2e-5", "--name", "steps", "--db", folder.file("steps.db")});
  EXPECT_EQ(ran.exit_code, 1) << ran.err;
  EXPECT_EQ(database.texts("SELECT status FROM results ORDER BY point"),
            (std::vector<std::string>{"solved", "failed"}));
  EXPECT_NE(database.texts("SELECT error FROM results WHERE point = 1").at(0).find("2e-05"),
            std::string::npos);
}

}  // namespace
}  // namespace oblique::test
