#include "client/paper/paper_comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <toml++/toml.h>
#include <nlohmann/json.hpp>

#include "client/io/row_output.h"
#include "client/paper/published_toml.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"
#include "worker/solver/reference/contact_record.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

using solver::exact_number;
using solver::fixed_number;
using solver::signed_number;

constexpr double kKilo = 1.0 / 1e3;  // per unit
constexpr double kMilli = 1e3;       // per unit

template <typename Value>
std::vector<Value> list(const toml::table& table, std::string_view key) {
  std::vector<Value> values;
  if (const auto* array = table[key].as_array()) {
    for (const auto& item : *array) {
      values.push_back(item.value<Value>().value());
    }
  }
  return values;
}

PublishedCase case_of(const toml::table& table) {
  return {{.mode = table["mode"].value<std::string>().value(),
           .fn_kN = list<double>(table, "fn_kN"),
           .ft_kN = list<double>(table, "ft_kN"),
           .phases_ms = list<double>(table, "phases_ms"),
           .stick_ms = table["stick_ms"].value<double>()},
          table["H"].value<double>().value(),
          table["mu"].value<double>().value(),
          table["e"].value<double>().value(),
          table["read"].value<std::string>().value()};
}

// Rows of the database do not contain F_n at valleys. Therefore the phases that belong to a ripple
// are unknown, and only the phases up to the peak before the first ripple are used.
CaseNumbers case_of_row(const protocol::Row& row) {
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

protocol::Row row_of(const PublishedCase& published) {
  return {published.H_m, published.mu, published.e_star};
}

protocol::Value value_or_null(const std::optional<double>& value) {
  return value ? protocol::Value(*value) : protocol::Value();
}

// Formats "5.058 / 5.07 / -0.24"; missing values are dashes.
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
  return found->ours ? fmt::format("{} / {} / {}", fixed_number(*found->ours, decimals + 1),
                                   published, signed_number(*found->percent(), 2))
                     : fmt::format("- / {}", published);
}

void print_forces(std::ostream& out, const PublishedTable& published,
                  const std::vector<Difference>& differences) {
  out << "Peaks of the contact forces (Tab. 2): ours / published [kN] / difference [%]\n\n";
  protocol::Table table{.columns = {"H", "mu", "e*", "force", "1st", "2nd", "3rd"}};
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    for (const auto& [quantity, name] :
         {std::pair(Quantity::kFn, "F_n"), std::pair(Quantity::kFt, "F_t")}) {
      if (published.cases[i].fn_kN.empty()) {
        continue;
      }
      auto& row = table.rows.emplace_back(row_of(published.cases[i]));
      row.emplace_back(name);
      for (std::size_t peak = 0; peak < 3; ++peak) {
        row.emplace_back(beside(differences, i, quantity, peak, 2));
      }
    }
  }
  print(out, table, Format::kTable);
}

void print_times(std::ostream& out, const PublishedTable& published,
                 const std::vector<Difference>& differences) {
  const std::string last = "ours / published / difference";
  protocol::Table phases{.columns = {"H", "mu", "e*", "phase", last}};
  protocol::Table sticks{.columns = {"H", "mu", "e*", last}};
  for (std::size_t i = 0; i < published.cases.size(); ++i) {
    for (std::size_t phase = 0; phase < published.cases[i].phases_ms.size(); ++phase) {
      auto& row = phases.rows.emplace_back(row_of(published.cases[i]));
      row.emplace_back(
          fmt::format("{} {}", phase / 2 + 1, phase % 2 == 0 ? "compression" : "restitution"));
      row.emplace_back(beside(differences, i, Quantity::kPhase, phase, 3));
    }
    if (published.cases[i].stick_ms) {
      auto& row = sticks.rows.emplace_back(row_of(published.cases[i]));
      row.emplace_back(beside(differences, i, Quantity::kStick, 0, 3));
    }
  }
  out << "\nDurations of compression and restitution (section 4.2): ours / published [ms] / "
         "difference [%]\n\n";
  print(out, phases, Format::kTable);
  out << "\nTime in stick (section 4.3): ours / published [ms] / difference [%]\n\n";
  print(out, sticks, Format::kTable);
}

std::string place_of(const PublishedCase& in) {
  return fmt::format("H = {}, mu = {}, e* = {}", exact_number(in.H_m), exact_number(in.mu),
                     exact_number(in.e_star));
}

std::string place_of(const PublishedTable& published, const Difference& difference) {
  const std::size_t number = difference.index + 1;
  const auto what = difference.quantity == Quantity::kFn   ? fmt::format("peak {} of F_n", number)
                    : difference.quantity == Quantity::kFt ? fmt::format("peak {} of F_t", number)
                    : difference.quantity == Quantity::kStick
                        ? std::string("time in stick")
                        : fmt::format("{} {}", number % 2 == 1 ? "compression" : "restitution",
                                      difference.index / 2 + 1);
  return what + " at " + place_of(published.cases[difference.case_index]);
}

void print_differences_summary(std::ostream& out, const PublishedTable& published,
                               const std::vector<Difference>& differences) {
  const auto summary = summary_of(differences);
  out << fmt::format("\n{} reliable published numbers", differences.size());
  if (summary.missing > 0) {
    out << fmt::format(", {} of them not computed", summary.missing);
  }
  if (summary.largest) {
    out << fmt::format(
        ": rms difference {} %, largest {} % ({})", fixed_number(summary.rms_percent, 2),
        fixed_number(summary.largest_percent, 2), place_of(published, *summary.largest));
  }
  out << "\n";
}

}  // namespace

PublishedTable published_table() {
  const auto top = toml::parse(kPublishedToml);
  PublishedTable published;
  for (const auto& node : *top["case"].as_array()) {
    published.cases.push_back(case_of(*node.as_table()));
  }
  for (const auto& node : *top["misprint"].as_array()) {
    const auto& table = *node.as_table();
    published.misprints.push_back({.where = table["where"].value<std::string>().value(),
                                   .printed = list<std::string>(table, "printed"),
                                   .why = table["why"].value<std::string>().value()});
  }
  return published;
}

int published_peaks(const PublishedCase& published) {
  int peaks = 0;
  for (std::size_t i = 1; i < published.mode.size(); i += 3) {
    peaks += published.mode[i] == 'C' ? 1 : 0;
  }
  return peaks;
}

bool PublishedCase::is_at(double H, double friction, double e) const {
  return std::abs(H - H_m) <= 1e-9 && std::abs(friction - mu) <= 1e-9 &&
         std::abs(e - e_star) <= 1e-9;
}

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
        return solver::FingerPoint{finger, next++, {asked.H_m, asked.mu, asked.e_star}};
      },
      [&](solver::Outcome&& outcome) {
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
  for (const auto& row : rows.rows) {
    for (std::size_t i = 0; i < own.size(); ++i) {
      if (!table.cases[i].is_at(std::get<double>(row[1]), std::get<double>(row[2]),
                                std::get<double>(row[3]))) {
        continue;
      }
      if (own[i]) {
        throw std::runtime_error(
            fmt::format("the study has several points with {}: compare a study of one model",
                        place_of(table.cases[i])));
      }
      own[i] = case_of_row(row);
    }
  }
  return own;
}

protocol::Table rows_of(const PublishedTable& table, const std::vector<Difference>& differences) {
  // Names in the order of Quantity.
  constexpr std::array<const char*, 4> kNames{"fn_peak_kN", "ft_peak_kN", "phase_ms", "stick_ms"};
  protocol::Table reply{
      .columns = {"H", "mu", "e", "quantity", "seq", "published", "ours", "difference_percent"}};
  for (const auto& difference : differences) {
    auto& row = reply.rows.emplace_back(row_of(table.cases[difference.case_index]));
    row.emplace_back(kNames[static_cast<std::size_t>(difference.quantity)]);
    row.emplace_back(static_cast<std::int64_t>(difference.index));
    row.emplace_back(difference.published);
    row.push_back(value_or_null(difference.ours));
    row.push_back(value_or_null(difference.percent()));
  }
  return reply;
}

void print_modes(std::ostream& out, const PublishedTable& table, const OwnCases& own) {
  out << "Peaks and modes, ripples merged (Figs. 4 to 6)\n\n";
  protocol::Table modes{
      .columns = {"H", "mu", "e*", "peaks", "published", "mode", "published mode"}};
  std::string others;
  std::size_t solved = 0;
  std::size_t same_modes = 0;
  for (std::size_t i = 0; i < table.cases.size(); ++i) {
    const auto& published = table.cases[i];
    const bool is_same = own[i] && own[i]->mode == published.mode;
    auto& row = modes.rows.emplace_back(row_of(published));
    row.push_back(own[i] ? protocol::Value(static_cast<std::int64_t>(own[i]->fn_kN.size()))
                         : protocol::Value());
    row.emplace_back(std::int64_t{published_peaks(published)});
    row.emplace_back(own[i] ? own[i]->mode : "not solved");
    row.emplace_back(is_same ? "the same" : published.mode);
    solved += own[i] ? 1U : 0U;
    same_modes += is_same ? 1U : 0U;
    if (own[i] && !is_same) {
      others +=
          fmt::format("- {}: {} ({} peaks), published {} ({})\n", place_of(published), own[i]->mode,
                      own[i]->fn_kN.size(), published.mode, published_peaks(published));
    }
  }
  print(out, modes, Format::kTable);
  if (solved > 0) {
    out << fmt::format("\nThe mode is the published one in {} of {} cases solved", same_modes,
                       solved)
        << (others.empty() ? ".\n" : ". The mode differs, and with it the peaks, at\n\n" + others);
  }
}

void print_comparison(std::ostream& out, const PublishedTable& table, const OwnCases& own) {
  const auto differences = compare(table, own);
  print_forces(out, table, differences);
  print_times(out, table, differences);
  out << '\n';
  print_modes(out, table, own);
  print_differences_summary(out, table, differences);
  out << "\nNot counted, because they are misprints:\n\n";
  for (const auto& [where, printed, why] : table.misprints) {
    out << fmt::format("- {}: {}\n    {}\n", where, fmt::join(printed, "; "), why);
  }
}

}  // namespace oblique::client
