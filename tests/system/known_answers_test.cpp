#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/database.h"
#include "tests/support/programs.h"

namespace oblique::test {
namespace {

/// What an independent solution of the same equations, converged in the step, gives for the preset
/// `paper`. Forces are rounded to 0.01 N, phases and durations to 0.001 µs, sticks to 0.01 µs,
/// slides to 1e-8 m.
struct KnownAnswer {
  double H_m;
  double mu;
  double e_star;
  std::vector<double> fn_peaks_N;
  std::vector<double> phases_us;
  double duration_us;
  std::string major_mode;
  double slide_mm;  ///< 0: not known
  double stick_us;
};

const std::string kThreePeaks = "sC sR sC sR sC sR";
const std::string kStick = "SC SR sR sC sR";

std::vector<KnownAnswer> known_answers() {
  return {
      {1.00,
       0.4,
       1.0,
       {5057.63, 1516.64, 2358.21},
       {68.933, 161.711, 69.753, 70.303, 101.194, 79.236},
       551.128,
       kThreePeaks,
       1.00135,
       0},
      {1.00,
       0.4,
       0.8,
       {5057.63, 1736.82, 2577.42},
       {68.933, 107.422, 116.329, 72.771, 102.874, 67.778},
       536.105,
       kThreePeaks,
       1.04358,
       0},
      {1.00,
       0.4,
       0.6,
       {5057.63, 1803.78, 2788.27},
       {68.933, 83.734, 135.094, 68.471, 105.922, 58.972},
       521.126,
       kThreePeaks,
       1.08213,
       0},
      {0.96,
       0.4,
       1.0,
       {4887.83, 1639.06, 2465.77},
       {66.010, 146.372, 83.239, 77.427, 101.924, 74.885},
       549.857,
       kThreePeaks,
       1.08502,
       0},
      {1.04,
       0.4,
       1.0,
       {5217.04, 1335.73, 2443.84},
       {73.490, 167.908, 64.627, 57.663, 104.112, 86.117},
       553.917,
       kThreePeaks,
       0.90816,
       0},
      {1.00,
       0.6,
       1.0,
       {4744.57, 784.43, 1587.48, 2395.13},
       {65.512, 122.053, 5.980, 17.338, 82.959, 76.168, 98.578, 75.108},
       543.697,
       kThreePeaks,
       0.91376,
       0},
      {1.00,
       0.8,
       1.0,
       {4470.76, 1617.97, 2467.37},
       {62.179, 116.795, 110.856, 77.882, 96.859, 71.882},
       536.454,
       kThreePeaks,
       0.83962,
       0},
      {1.00,
       1.2,
       1.0,
       {4281.94, 1573.71},
       {57.271, 113.003, 115.734, 59.809},
       345.818,
       kStick,
       0,
       70.49},
      {1.00,
       1.4,
       1.0,
       {4281.94, 1496.67},
       {57.271, 108.256, 119.499, 57.290},
       342.316,
       kStick,
       0,
       83.42},
      {1.00,
       1.6,
       1.0,
       {4281.94, 1421.47},
       {57.271, 106.240, 117.536, 58.785},
       339.832,
       kStick,
       0,
       92.11},
  };
}

/// Relative error allowed at the default step.
constexpr double kTolerance = 3e-5;
/// The same for instants, of the duration: valleys are flat, and the default step moves one by
/// 0.003 µs.
constexpr double kTimeTolerance = 6e-6;

/// Values rounded to `digit` may be half of it off, and `kTolerance` besides.
void expect_close(double value, double known, double digit, const std::string& what) {
  EXPECT_NEAR(value, known, 0.5 * digit + kTolerance * std::abs(known)) << what;
}

std::string where(const KnownAnswer& known, const std::string& table) {
  std::ostringstream sql;
  sql << " FROM " << table
      << " WHERE study_id = 1 AND point = (SELECT point FROM results WHERE H = " << known.H_m
      << " AND mu = " << known.mu << " AND e = " << known.e_star << ")";
  return sql.str();
}

void expect_forces(const Database& database, const KnownAnswer& known, const std::string& name) {
  const auto peaks_N = database.numbers("SELECT fn_N" + where(known, "peaks") + " ORDER BY seq");
  ASSERT_EQ(peaks_N.size(), known.fn_peaks_N.size()) << name;
  for (std::size_t i = 0; i < peaks_N.size(); ++i) {
    expect_close(peaks_N[i], known.fn_peaks_N[i], 0.01, name + ": peak " + std::to_string(i));
  }
  EXPECT_EQ(database.texts("SELECT major_mode" + where(known, "results")).at(0), known.major_mode)
      << name;
}

void expect_times(const Database& database, const KnownAnswer& known, const std::string& name) {
  const auto phases_us =
      database.numbers("SELECT 1e6 * (t1_s - t0_s)" + where(known, "phases") + " ORDER BY seq");
  ASSERT_EQ(phases_us.size(), known.phases_us.size()) << name;
  for (std::size_t i = 0; i < phases_us.size(); ++i) {
    // A phase ends where the force turns, a time of the contact: its error is that of the contact.
    EXPECT_NEAR(phases_us[i], known.phases_us[i], 0.0005 + kTimeTolerance * known.duration_us)
        << name << ": phase " << i;
  }
  EXPECT_NEAR(database.number("SELECT 1e6 * duration_s" + where(known, "results")),
              known.duration_us, 0.0005 + kTimeTolerance * known.duration_us)
      << name << ": duration";
  expect_close(database.number("SELECT 1e6 * stick_total_s" + where(known, "results")),
               known.stick_us, 0.01, name + ": stick");
  if (known.slide_mm > 0.0) {
    expect_close(database.number("SELECT 1e3 * slide_m" + where(known, "results")), known.slide_mm,
                 1e-5, name + ": slide");
  }
}

TEST(KnownAnswersTest, TheTenPublishedCasesComeThroughRealProcessesWithTheKnownAnswers) {
  const TemporaryFolder folder;
  const Database database(folder.file("paper.db"));
  const Outcome ran =
      run_oblique(folder, {"run", OBLIQUE_PAPER_STUDY, "--db", folder.file("paper.db")});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  ASSERT_EQ(database.number("SELECT count(*) FROM results WHERE status = 'solved'"), 10);
  for (const KnownAnswer& known : known_answers()) {
    std::ostringstream name;
    name << "H = " << known.H_m << ", mu = " << known.mu << ", e = " << known.e_star;
    expect_forces(database, known, name.str());
    expect_times(database, known, name.str());
  }
  EXPECT_LT(database.number("SELECT max(closure) FROM results"), 1e-4);
}

TEST(KnownAnswersTest, TheSameStudyAgainHasNothingToSolve) {
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

TEST(KnownAnswersTest, APointWithoutAnswerIsARowWithTheReasonAndTheOthersAreSolved) {
  const TemporaryFolder folder;
  const Database database(folder.file("steps.db"));
  // 20 µs is beyond the stability limit.
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
