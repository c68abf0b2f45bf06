#include "client/paper/paper_comparison.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "client/output/printer.h"
#include "worker/solver/contact/contact_record.h"
#include "worker/solver/model/number.h"
#include "worker/solver/solve.h"

namespace oblique::client {
namespace {

constexpr double kKilo = 1e3;

void add_differences(std::vector<Difference>& all, std::size_t case_index, Quantity quantity,
                     const std::vector<double>& published, const std::vector<double>& ours,
                     double scale) {
  for (std::size_t i = 0; i < published.size(); ++i) {
    all.push_back({case_index, quantity, i, published[i],
                   i < ours.size() ? std::optional(ours[i] * scale) : std::nullopt});
  }
}

// Values of files and databases went through decimal text; nothing closer is told apart.
bool same(double a, double b) {
  return std::abs(a - b) <= 1e-9;
}

// Rows do not have F_n at valleys, so they do not say which turns a ripple takes with it: phases
// are known up to the peak before the first ripple.
OwnCase own_case(const protocol::Row& row) {
  OwnCase own{.fn_N = {},
              .ft_N = {},
              .phases_s = {},
              .stick_total_s = std::get<double>(row[6]),
              .major_mode = std::get<std::string>(row[7])};
  const auto peaks = nlohmann::json::parse(std::get<std::string>(row[4]));
  const auto phases = nlohmann::json::parse(std::get<std::string>(row[5]));
  std::size_t known_phases = phases.size();
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    if (peaks[i].at(3).get<int>() != 0) {
      own.fn_N.push_back(peaks[i].at(1));
      own.ft_N.push_back(peaks[i].at(2));
    } else {
      known_phases = std::min(known_phases, 2 * i == 0 ? 0 : 2 * i - 1);
    }
  }
  for (std::size_t i = 0; i < known_phases; ++i) {
    own.phases_s.push_back(phases[i].at(2).get<double>() - phases[i].at(1).get<double>());
  }
  return own;
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

}  // namespace

OwnCase own_case(const solver::CaseResult& result) {
  OwnCase own{.fn_N = {},
              .ft_N = {},
              .phases_s = {},
              .stick_total_s = result.stick_total_s,
              .major_mode = result.major_mode};
  for (const auto& peak : result.peaks) {
    if (peak.major) {
      own.fn_N.push_back(peak.fn_N);
      own.ft_N.push_back(peak.ft_N);
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
      own.phases_s.push_back(result.phases[i].t1_s - start_s);
      start_s = result.phases[i].t1_s;
    }
  }
  return own;
}

std::optional<double> Difference::percent() const {
  return ours ? std::optional(100.0 * (*ours - published) / published) : std::nullopt;
}

std::vector<Difference> compare(const PublishedTable& table,
                                const std::vector<std::optional<OwnCase>>& own) {
  std::vector<Difference> all;
  for (std::size_t i = 0; i < table.cases.size(); ++i) {
    const auto& published = table.cases[i];
    const auto ours = own[i].value_or(OwnCase{});
    add_differences(all, i, Quantity::kFn, published.fn_kN, ours.fn_N, 1.0 / kKilo);
    add_differences(all, i, Quantity::kFt, published.ft_kN, ours.ft_N, 1.0 / kKilo);
    add_differences(all, i, Quantity::kPhase, published.phases_ms, ours.phases_s, kKilo);
    if (published.stick_ms) {
      add_differences(all, i, Quantity::kStick, {*published.stick_ms},
                      own[i] ? std::vector<double>{ours.stick_total_s} : std::vector<double>{},
                      kKilo);
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

std::vector<std::vector<std::optional<OwnCase>>> solved_cases(
    const PublishedTable& table, std::span<const solver::Finger> fingers) {
  const std::size_t cases = table.cases.size();
  std::vector own(fingers.size(), std::vector<std::optional<OwnCase>>(cases));
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

std::vector<std::optional<OwnCase>> own_cases(const PublishedTable& table,
                                              const protocol::Table& rows) {
  std::vector<std::optional<OwnCase>> own(table.cases.size());
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

}  // namespace oblique::client
