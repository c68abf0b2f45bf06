#include "client/paper/paper_comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "client/io/tables.h"
#include "worker/solver/contact/contact_record.h"
#include "worker/solver/model/number.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

using solver::exact_number;
using solver::fixed_number;
using solver::signed_number;

constexpr double kKilo = 1.0 / 1e3;  // per unit
constexpr double kMilli = 1e3;       // per unit

// Values of files and databases went through decimal text; nothing closer is told apart.
bool same(double a, double b) {
  return std::abs(a - b) <= 1e-9;
}

// Rows do not have F_n at valleys, so they do not say which turns a ripple takes with it: phases
// are known up to the peak before the first ripple.
CaseNumbers own_case(const protocol::Row& row) {
  CaseNumbers own;
  own.mode = std::get<std::string>(row[7]);
  own.stick_ms = std::get<double>(row[6]) * kMilli;
  const auto peaks = nlohmann::json::parse(std::get<std::string>(row[4]));
  const auto phases = nlohmann::json::parse(std::get<std::string>(row[5]));
  std::size_t known_phases = phases.size();
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    if (peaks[i].at(3).get<int>() != 0) {
      own.fn_kN.push_back(peaks[i].at(1).get<double>() * kKilo);
      own.ft_kN.push_back(peaks[i].at(2).get<double>() * kKilo);
    } else {
      known_phases = std::min(known_phases, 2 * i == 0 ? 0 : 2 * i - 1);
    }
  }
  for (std::size_t i = 0; i < known_phases; ++i) {
    own.phases_ms.push_back((phases[i].at(2).get<double>() - phases[i].at(1).get<double>()) *
                            kMilli);
  }
  return own;
}

std::vector<double> values_of(const CaseNumbers& numbers, Quantity quantity) {
  switch (quantity) {
    case Quantity::kFn:
      return numbers.fn_kN;
    case Quantity::kFt:
      return numbers.ft_kN;
    case Quantity::kPhase:
      return numbers.phases_ms;
    default:
      return numbers.stick_ms ? std::vector{*numbers.stick_ms} : std::vector<double>{};
  }
}

const char* name_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::kFn:
      return "fn_peak_kN";
    case Quantity::kFt:
      return "ft_peak_kN";
    case Quantity::kPhase:
      return "phase_ms";
    default:
      return "stick_ms";
  }
}

void add_header(protocol::Table& table, const std::vector<std::string>& columns) {
  for (const auto& column : columns) {
    table.columns.emplace_back(column);
  }
}

void add_case(protocol::Row& row, const PublishedCase& published) {
  add_value(row, published.H_m);
  add_value(row, published.mu);
  add_value(row, published.e_star);
}

// "5.058 / 5.07 / -0.24", or what there is of it.
std::string beside(const std::vector<Difference>& differences, std::size_t case_index,
                   Quantity quantity, std::size_t index, int decimals) {
  const auto found =
      std::find_if(differences.begin(), differences.end(), [&](const Difference& difference) {
        return difference.case_index == case_index && difference.quantity == quantity &&
               difference.index == index;
      });
  if (found == differences.end()) {
    return {};
  }
  const auto published = fixed_number(found->published, decimals);
  if (!found->ours) {
    return fmt::format("- / {}", published);
  }
  return fmt::format("{} / {} / {}", fixed_number(*found->ours, decimals + 1), published,
                     signed_number(*found->percent(), 2));
}

void print_forces(std::ostream& out, const PublishedTable& published,
                  const std::vector<Difference>& differences) {
  constexpr std::array<const char*, 3> kPeaks{"1st", "2nd", "3rd"};
  out << "Peaks of the contact forces (Tab. 2): ours / published [kN] / difference [%]\n\n";
  protocol::Table table;
  add_header(table, {"H", "mu", "e*", "force", kPeaks[0], kPeaks[1], kPeaks[2]});
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    if (published.cases[i].fn_kN.empty()) {
      continue;
    }
    for (const auto& [quantity, name] :
         {std::pair(Quantity::kFn, "F_n"), std::pair(Quantity::kFt, "F_t")}) {
      auto& row = table.rows.emplace_back();
      add_case(row, published.cases[i]);
      add_value(row, std::string(name));
      for (std::size_t peak = 0; peak < kPeaks.size(); ++peak) {
        add_value(row, beside(differences, i, quantity, peak, 2));
      }
    }
  }
  print(out, table, Format::kTable);
}

void print_durations(std::ostream& out, const PublishedTable& published,
                     const std::vector<Difference>& differences) {
  out << "\nDurations of compression and restitution (section 4.2): ours / published [ms] / "
         "difference [%]\n\n";
  protocol::Table table;
  add_header(table, {"H", "mu", "e*", "phase", "ours / published / difference"});
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    for (std::size_t phase = 0; phase < published.cases[i].phases_ms.size(); ++phase) {
      auto& row = table.rows.emplace_back();
      add_case(row, published.cases[i]);
      add_value(
          row, fmt::format("{} {}", phase / 2 + 1, phase % 2 == 0 ? "compression" : "restitution"));
      add_value(row, beside(differences, i, Quantity::kPhase, phase, 3));
    }
  }
  print(out, table, Format::kTable);
}

void print_sticks(std::ostream& out, const PublishedTable& published,
                  const std::vector<Difference>& differences) {
  out << "\nTime in stick (section 4.3): ours / published [ms] / difference [%]\n\n";
  protocol::Table table;
  add_header(table, {"H", "mu", "e*", "ours / published / difference"});
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    if (published.cases[i].stick_ms) {
      auto& row = table.rows.emplace_back();
      add_case(row, published.cases[i]);
      add_value(row, beside(differences, i, Quantity::kStick, 0, 3));
    }
  }
  print(out, table, Format::kTable);
}

std::string place_of(const PublishedCase& in) {
  return fmt::format("H = {}, mu = {}, e* = {}", exact_number(in.H_m), exact_number(in.mu),
                     exact_number(in.e_star));
}

// Says plainly which published modes are not ours.
void print_other_modes(std::ostream& out, const PublishedTable& published, const OwnCases& own) {
  std::string others;
  std::size_t solved = 0;
  std::size_t same = 0;
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    const auto& in = published.cases[i];
    if (!own[i]) {
      continue;
    }
    ++solved;
    if (own[i]->mode == in.mode) {
      ++same;
      continue;
    }
    others += fmt::format("- {}: {} ({} peaks), published {} ({})\n", place_of(in), own[i]->mode,
                          own[i]->fn_kN.size(), in.mode, published_peaks(in));
  }
  if (solved == 0) {
    return;
  }
  out << fmt::format("\nThe mode is the published one in {} of {} cases solved", same, solved);
  out << (others.empty() ? ".\n" : ". It is another one, with other peaks, at\n\n" + others);
}

void print_modes_table(std::ostream& out, const PublishedTable& published, const OwnCases& own) {
  out << "Peaks and modes, ripples merged (Figs. 4 to 6)\n\n";
  protocol::Table table;
  add_header(table, {"H", "mu", "e*", "peaks", "published", "mode", "published mode"});
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    auto& row = table.rows.emplace_back();
    add_case(row, published.cases[i]);
    if (own[i]) {
      add_value(row, static_cast<std::int64_t>(own[i]->fn_kN.size()));
    } else {
      row.emplace_back();
    }
    add_value(row, std::int64_t{published_peaks(published.cases[i])});
    add_value(row, own[i] ? own[i]->mode : std::string("not solved"));
    add_value(row, own[i] && own[i]->mode == published.cases[i].mode ? std::string("the same")
                                                                     : published.cases[i].mode);
  }
  print(out, table, Format::kTable);
}

std::string place_of(const PublishedTable& published, const Difference& difference) {
  const auto& in = published.cases[difference.case_index];
  std::string what;
  switch (difference.quantity) {
    case Quantity::kFn:
      what = fmt::format("peak {} of F_n", difference.index + 1);
      break;
    case Quantity::kFt:
      what = fmt::format("peak {} of F_t", difference.index + 1);
      break;
    case Quantity::kPhase:
      what = fmt::format("{} {}", difference.index % 2 == 0 ? "compression" : "restitution",
                         difference.index / 2 + 1);
      break;
    case Quantity::kStick:
      what = "time in stick";
      break;
  }
  return what + " at " + place_of(in);
}

void print_differences_summary(std::ostream& out, const PublishedTable& published,
                               const std::vector<Difference>& differences) {
  const auto summary = summary_of(differences);
  out << fmt::format("\n{} trustworthy published numbers", differences.size());
  if (summary.missing > 0) {
    out << fmt::format(", {} of them without ours", summary.missing);
  }
  if (summary.largest) {
    out << fmt::format(
        ": rms difference {} %, largest {} % ({})", fixed_number(summary.rms_percent, 2),
        fixed_number(summary.largest_percent, 2), place_of(published, *summary.largest));
  }
  out << "\n";
}

void print_misprints(std::ostream& out, const PublishedTable& published) {
  out << "\nNot counted, for they are misprinted:\n\n";
  for (const auto& misprint : published.misprints) {
    out << "- " << misprint.where << ": ";
    for (std::size_t i = 0; i < misprint.printed.size(); ++i) {
      out << (i > 0 ? "; " : "") << misprint.printed[i];
    }
    out << "\n    " << misprint.why << "\n";
  }
}

}  // namespace

CaseNumbers own_case(const solver::CaseResult& result) {
  CaseNumbers own;
  own.mode = result.major_mode;
  own.stick_ms = result.stick_total_s * kMilli;
  for (const auto& peak : result.peaks) {
    if (peak.major) {
      own.fn_kN.push_back(peak.fn_N * kKilo);
      own.ft_kN.push_back(peak.ft_N * kKilo);
    }
  }
  std::vector<double> turns_N;
  for (std::size_t i = 0; i + 1 < result.phases.size(); ++i) {
    turns_N.push_back(result.phases[i].fn_end_N);
  }
  const auto survives = solver::without_ripples(turns_N);
  double start_s = 0.0;
  for (std::size_t i = 0; i < result.phases.size(); ++i) {
    if (i == survives.size() || survives[i]) {
      own.phases_ms.push_back((result.phases[i].t1_s - start_s) * kMilli);
      start_s = result.phases[i].t1_s;
    }
  }
  return own;
}

std::optional<double> Difference::percent() const {
  return ours ? std::optional(100.0 * (*ours - published) / published) : std::nullopt;
}

std::vector<Difference> compare(const PublishedTable& table, const OwnCases& own) {
  std::vector<Difference> all;
  for (std::size_t i = 0; i < table.cases.size(); ++i) {
    for (const auto quantity : {Quantity::kFn, Quantity::kFt, Quantity::kPhase, Quantity::kStick}) {
      const auto published = values_of(table.cases[i], quantity);
      const auto ours = own[i] ? values_of(*own[i], quantity) : std::vector<double>{};
      for (std::size_t j = 0; j < published.size(); ++j) {
        all.push_back({i, quantity, j, published[j],
                       j < ours.size() ? std::optional(ours[j]) : std::nullopt});
      }
    }
  }
  return all;
}

DifferenceSummary summary_of(const std::vector<Difference>& differences) {
  DifferenceSummary summary;
  double sum_squared = 0.0;
  for (const auto& difference : differences) {
    const auto percent = difference.percent();
    if (!percent) {
      ++summary.missing;
      continue;
    }
    ++summary.counted;
    sum_squared += *percent * *percent;
    if (!summary.largest || std::abs(*percent) > summary.largest_percent) {
      summary.largest_percent = std::abs(*percent);
      summary.largest = difference;
    }
  }
  if (summary.counted > 0) {
    summary.rms_percent = std::sqrt(sum_squared / static_cast<double>(summary.counted));
  }
  return summary;
}

std::vector<OwnCases> solved_cases(const PublishedTable& table,
                                   std::span<const solver::Finger> fingers) {
  const std::size_t cases = table.cases.size();
  std::vector own(fingers.size(), OwnCases(cases));
  std::size_t next = 0;
  std::string error;
  solver::solve_points(
      [&]() -> std::optional<solver::FingerPoint> {
        if (next == fingers.size() * cases) {
          return std::nullopt;
        }
        const auto& asked = table.cases[next % cases];
        const auto& finger = fingers[next / cases];
        return solver::FingerPoint{finger, {next++, asked.H_m, asked.mu, asked.e_star}};
      },
      [&](solver::PointOutcome&& outcome) {
        if (outcome.result) {
          own[outcome.number / cases][outcome.number % cases] = own_case(*outcome.result);
        } else {
          error = outcome.error;
        }
      });
  if (!error.empty()) {
    throw solver::SolveError(error);
  }
  return own;
}

OwnCases own_cases(const PublishedTable& table, const protocol::Table& rows) {
  OwnCases own(table.cases.size());
  for (std::size_t i = 0; i < table.cases.size(); ++i) {
    const auto& published = table.cases[i];
    for (const auto& row : rows.rows) {
      if (!same(std::get<double>(row[1]), published.H_m) ||
          !same(std::get<double>(row[2]), published.mu) ||
          !same(std::get<double>(row[3]), published.e_star)) {
        continue;
      }
      if (own[i]) {
        throw std::runtime_error(
            "the study has several points with H = " + solver::exact_number(published.H_m) +
            ", mu = " + solver::exact_number(published.mu) + ", e = " +
            solver::exact_number(published.e_star) + ": the comparison needs a study of one model");
      }
      own[i] = own_case(row);
    }
  }
  return own;
}

protocol::Table rows_of(const PublishedTable& table, const std::vector<Difference>& differences) {
  protocol::Table reply{
      .columns = {"H", "mu", "e", "quantity", "seq", "published", "ours", "difference_percent"}};
  for (const auto& difference : differences) {
    const auto& published = table.cases[difference.case_index];
    auto& row = reply.rows.emplace_back();
    add_value(row, published.H_m);
    add_value(row, published.mu);
    add_value(row, published.e_star);
    add_value(row, std::string(name_of(difference.quantity)));
    add_value(row, static_cast<std::int64_t>(difference.index));
    add_value(row, difference.published);
    for (const auto& value : {difference.ours, difference.percent()}) {
      row.push_back(value ? protocol::Value(*value) : protocol::Value());
    }
  }
  return reply;
}

void print_modes(std::ostream& out, const PublishedTable& table, const OwnCases& own) {
  print_modes_table(out, table, own);
  print_other_modes(out, table, own);
}

void print_comparison(std::ostream& out, const PublishedTable& table, const OwnCases& own) {
  const auto differences = compare(table, own);
  print_forces(out, table, differences);
  print_durations(out, table, differences);
  print_sticks(out, table, differences);
  out << '\n';
  print_modes(out, table, own);
  print_differences_summary(out, table, differences);
  print_misprints(out, table);
}

}  // namespace oblique::client
