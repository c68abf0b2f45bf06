#include "client/paper/figures/paper_cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "worker/solver/model/number.h"

namespace oblique::client {
namespace {

struct Values {
  double H_m;
  double mu;
  double e_star;
};

bool is_at(const PublishedCase& published, const Values& values) {
  constexpr double kSame = 1e-9;  // both are written in decimals
  return std::abs(published.H_m - values.H_m) < kSame &&
         std::abs(published.mu - values.mu) < kSame &&
         std::abs(published.e_star - values.e_star) < kSame;
}

PaperCase solved_case(const PublishedCase& published, const solver::Finger& finger) {
  PaperCase one{.published = published,
                .history = {.name = {},
                            .model = finger.model(),
                            .H_m = published.H_m,
                            .mu = published.mu,
                            .e_star = published.e_star}};
  auto& rows = one.history.rows;
  one.history.result =
      finger.solve(published.H_m, published.mu, published.e_star,
                   {[&rows](const solver::TraceRow& row) { rows.push_back(row); }, false});
  return one;
}

}  // namespace

PaperGroups solved_groups(const PublishedTable& table, const solver::Finger& finger) {
  std::vector<PaperCase> all;
  for (const auto& published : table.cases) {
    all.push_back(solved_case(published, finger));
  }
  const auto group = [&all](PaperGroup::Key key, std::string title,
                            const std::array<Values, 3>& members) {
    PaperGroup made{.key = key, .title = std::move(title), .cases = {}};
    for (const Values& values : members) {
      const auto found = std::find_if(all.begin(), all.end(), [&values](const PaperCase& one) {
        return is_at(one.published, values);
      });
      if (found == all.end()) {
        throw std::runtime_error(fmt::format("the published table lacks H = {}, mu = {}, e* = {}",
                                             values.H_m, values.mu, values.e_star));
      }
      made.cases.push_back(*found);
    }
    return made;
  };
  using enum PaperGroup::Key;
  return {
      .over_H = group(kH, "drop H (\u03bc = 0.4, e* = 1)",
                      {{{0.96, 0.4, 1.0}, {1.0, 0.4, 1.0}, {1.04, 0.4, 1.0}}}),
      .over_e = group(kE, "restitution e* (H = 1 m, \u03bc = 0.4)",
                      {{{1.0, 0.4, 0.6}, {1.0, 0.4, 0.8}, {1.0, 0.4, 1.0}}}),
      .over_small_mu = group(kMu, "friction \u03bc, small (H = 1 m, e* = 1)",
                             {{{1.0, 0.4, 1.0}, {1.0, 0.6, 1.0}, {1.0, 0.8, 1.0}}}),
      .over_large_mu = group(kMu, "friction \u03bc, large (H = 1 m, e* = 1)",
                             {{{1.0, 1.2, 1.0}, {1.0, 1.4, 1.0}, {1.0, 1.6, 1.0}}}),
  };
}

std::string name_in_group(const PaperCase& one, PaperGroup::Key key) {
  switch (key) {
    case PaperGroup::Key::kH:
      return fmt::format("H = {} m", solver::readable_number(one.history.H_m));
    case PaperGroup::Key::kMu:
      return fmt::format("\u03bc = {}", solver::readable_number(one.history.mu));
    case PaperGroup::Key::kE:
      return fmt::format("e* = {}", solver::readable_number(one.history.e_star));
  }
  return {};
}

}  // namespace oblique::client
