#include "client/paper_comparison.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

#include "client/axis.h"
#include "client/printer.h"

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

OwnCase own_case(const protocol::Row& row) {
  OwnCase own{.fn_N = {},
              .ft_N = {},
              .phases_s = {},
              .stick_total_s = row.values(6).real(),
              .major_mode = row.values(7).text()};
  for (const auto& peak : nlohmann::json::parse(row.values(4).text())) {
    if (peak.at(3).get<int>() != 0) {
      own.fn_N.push_back(peak.at(1));
      own.ft_N.push_back(peak.at(2));
    }
  }
  for (const auto& phase : nlohmann::json::parse(row.values(5).text())) {
    own.phases_s.push_back(phase.at(2).get<double>() - phase.at(1).get<double>());
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
  for (const auto& phase : result.phases) {
    own.phases_s.push_back(phase.t1_s - phase.t0_s);
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

std::vector<std::optional<OwnCase>> own_cases(const PublishedTable& table,
                                              const protocol::QueryReply& rows) {
  std::vector<std::optional<OwnCase>> own(table.cases.size());
  for (std::size_t i = 0; i < table.cases.size(); ++i) {
    const auto& published = table.cases[i];
    for (const auto& row : rows.rows()) {
      if (!same(row.values(1).real(), published.H_m) || !same(row.values(2).real(), published.mu) ||
          !same(row.values(3).real(), published.e_star)) {
        continue;
      }
      if (own[i]) {
        throw std::runtime_error(
            "the study has several points with H = " + shown_number(published.H_m) +
            ", mu = " + shown_number(published.mu) + ", e = " + shown_number(published.e_star) +
            ": the comparison needs a study of one model");
      }
      own[i] = own_case(row);
    }
  }
  return own;
}

protocol::QueryReply rows_of(const PublishedTable& table,
                             const std::vector<Difference>& differences) {
  protocol::QueryReply reply;
  for (const char* column :
       {"H", "mu", "e", "quantity", "seq", "published", "ours", "difference_percent"}) {
    reply.add_columns(column);
  }
  for (const auto& difference : differences) {
    const auto& published = table.cases[difference.case_index];
    auto& row = *reply.add_rows();
    add_value(row, published.H_m);
    add_value(row, published.mu);
    add_value(row, published.e_star);
    add_value(row, std::string(name_of(difference.quantity)));
    add_value(row, static_cast<std::int64_t>(difference.index));
    add_value(row, difference.published);
    for (const auto& value : {difference.ours, difference.percent()}) {
      auto* added = row.add_values();
      if (value) {
        added->set_real(*value);
      }
    }
  }
  return reply;
}

}  // namespace oblique::client
