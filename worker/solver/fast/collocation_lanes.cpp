#include "worker/solver/fast/collocation_lanes.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "worker/solver/fast/front_kernel.h"

namespace oblique::solver {
namespace {

/// Legendre polynomials up to the degree kStages at x in [-1, 1].
struct LegendreValues {
  explicit LegendreValues(double x) : P{1.0, x} {
    for (std::size_t n = 2; n <= GaussCollocation::kStages; ++n) {
      const auto k = static_cast<double>(n);
      P[n] = ((2.0 * k - 1.0) * x * P[n - 1] - (k - 1.0) * P[n - 2]) / k;
    }
  }
  double P[GaussCollocation::kStages + 1];
};

/// After so many iterations the step is taken to be too long.
constexpr int kMostIterations = 10;
/// Corrections that no longer shrink are rounding when they are below this many errors allowed.
constexpr double kRoundingErrors = 1000.0;

template <class Item>
constexpr std::size_t numbers_of() {
  return sizeof(Item) / sizeof(double);
}

}  // namespace

GaussCollocation::GaussCollocation() {
  const auto n = static_cast<double>(kStages);
  for (std::size_t i = 0; i < kStages; ++i) {
    double x = -std::cos(std::numbers::pi * (static_cast<double>(i) + 0.75) / (n + 0.5));
    double slope = 0.0;
    for (int newton = 0; newton < 20; ++newton) {
      const LegendreValues at(x);
      slope = n * (x * at.P[kStages] - at.P[kStages - 1]) / (x * x - 1.0);
      x -= at.P[kStages] / slope;
    }
    node[i] = 0.5 * (1.0 + x);
    weight[i] = 1.0 / ((1.0 - x * x) * slope * slope);
    position_weight[i] = weight[i] * (1.0 - node[i]);
    const LegendreValues at(x);
    for (std::size_t degree = 0; degree < kStages; ++degree) {
      legendre[degree][i] = (2.0 * static_cast<double>(degree) + 1.0) * weight[i] * at.P[degree];
    }
  }
  for (std::size_t i = 0; i < kStages; ++i) {
    integrals(node[i], integral[i]);
  }
  constexpr auto kRows = static_cast<Eigen::Index>(kStages);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::MatrixXd A = Eigen::Map<const RowMajor>(integral[0], kRows, kRows);
  const Eigen::EigenSolver<Eigen::MatrixXd> eigen(A);
  const Eigen::MatrixXcd T = eigen.eigenvectors();
  const Eigen::MatrixXcd inverse = T.inverse();
  std::size_t pair = 0;
  for (Eigen::Index k = 0; k < kRows; ++k) {
    const std::complex<double> lambda = eigen.eigenvalues()[k];
    if (lambda.imag() < 0.0) {
      continue;  // the other one of a pair
    }
    const std::complex<double> squared = lambda * lambda;
    squared_re[pair] = squared.real();
    squared_im[pair] = squared.imag();
    for (Eigen::Index row = 0; row < kRows; ++row) {
      const auto i = static_cast<std::size_t>(row);
      const std::complex<double> back = 2.0 * T(row, k);
      into_re[pair][i] = inverse(k, row).real();
      into_im[pair][i] = inverse(k, row).imag();
      back_re[i][pair] = back.real();
      back_im[i][pair] = -back.imag();
      shift_re[i][pair] = (back * squared).real();
      shift_im[i][pair] = -(back * squared).imag();
    }
    ++pair;
  }
}

void GaussCollocation::integrals(double c, double* b) const {
  const LegendreValues at(2.0 * c - 1.0);
  // int_0^c P_k(2 t - 1) dt
  double of_legendre[kStages];
  of_legendre[0] = c;
  for (std::size_t k = 1; k < kStages; ++k) {
    of_legendre[k] = 0.5 * (at.P[k + 1] - at.P[k - 1]) / (2.0 * static_cast<double>(k) + 1.0);
  }
  for (std::size_t j = 0; j < kStages; ++j) {
    b[j] = 0.0;
    for (std::size_t k = kStages; k-- > 0;) {
      b[j] += legendre[k][j] * of_legendre[k];
    }
  }
}

const GaussCollocation& gauss_collocation() {
  static const GaussCollocation rule;
  return rule;
}

CollocationLanes::CollocationLanes(const LaneKernel& kernel, const Chain& chain)
    : kernel_(kernel),
      size_(2 * static_cast<std::size_t>(chain.rows())),
      chains_(chain.tables(), kernel.lanes),
      memory_(kernel.lanes),
      total_kg_(kernel.lanes),
      steps_(kernel.lanes) {
  const std::size_t links = chain.links();
  const std::size_t elements = links * chain.tables().elements_per_link;
  arrays_.chain = chains_.tables();
  arrays_.mass_kg = memory_.zeros(size_ / 2);
  arrays_.h_s = memory_.zeros(1);
  arrays_.active = memory_.zeros(1);
  arrays_.state = memory_.zeros(3 * size_);
  arrays_.next = memory_.zeros(3 * size_);
  arrays_.stage_q = memory_.zeros(GaussCollocation::kStages * size_);
  arrays_.stage_a = memory_.zeros(GaussCollocation::kStages * size_);
  arrays_.work = memory_.zeros(2 * GaussCollocation::kPairs * size_);
  arrays_.tangents = memory_.zeros(elements * numbers_of<TangentBlocks<double>>());
  arrays_.fronts =
      memory_.zeros(GaussCollocation::kPairs * elements * numbers_of<ElementFront<double>>());
  arrays_.ends = memory_.zeros(GaussCollocation::kPairs * links * numbers_of<EndFront<double>>());
  arrays_.squares = memory_.zeros(1);
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    load(lane, chain);
  }
}

void CollocationLanes::load(std::size_t lane, const Chain& chain) {
  const ChainTables<double> tables = chain.tables();
  chains_.set(lane, tables);
  std::vector<double> kg(size_ / 2, 0.0);
  std::size_t row = 0;
  for (std::size_t link = 0; link < tables.links; ++link) {
    const ElementConstants<double>& constants = tables.link[link];
    for (std::size_t e = 1; e <= tables.elements_per_link; ++e) {
      const ElementRows at =
          rows_of_element(row, e == tables.elements_per_link && link + 1 < tables.links);
      kg[at.p_i] += constants.m_pp;
      kg[at.s_i] += constants.m_ss;
      kg[at.p_j] += constants.m_pp;
      kg[at.s_j] += constants.m_ss;
      row = at.p_j;
    }
  }
  kg[row] += *tables.tip_mass_kg;
  for (std::size_t i = 0; i < kg.size(); ++i) {
    arrays_.mass_kg[i * lanes() + lane] = kg[i];
  }
  total_kg_[lane] = chain.mass_kg();
  const ChainState rest = chain.at_rest();
  std::vector<double> state(rest.q.data(), rest.q.data() + size_);
  state.resize(3 * size_, 0.0);
  set_state(lane, state.data());
}

void CollocationLanes::set_state(std::size_t lane, const double* q_v_mean) {
  for (std::size_t i = 0; i < 3 * size_; ++i) {
    arrays_.state[i * lanes() + lane] = q_v_mean[i];
  }
}

void CollocationLanes::attempt() {
  bool is_any_active = false;
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    Step& step = steps_[lane];
    step = {.h_s = step.h_s, .error_m = step.error_m};
    arrays_.h_s[lane] = step.h_s;
    arrays_.active[lane] = step.h_s > 0.0 ? 1.0 : 0.0;
    is_any_active = is_any_active || step.h_s > 0.0;
  }
  kernel_.prepare(gauss_collocation(), arrays_);
  std::vector<double> before_m(lanes(), 0.0);
  for (int iteration = 1; is_any_active; ++iteration) {
    kernel_.iterate(gauss_collocation(), arrays_);
    is_any_active = false;
    for (std::size_t lane = 0; lane < lanes(); ++lane) {
      if (arrays_.active[lane] == 0.0) {
        continue;
      }
      Step& step = steps_[lane];
      step.iterations = iteration;
      const double size_m = std::sqrt(arrays_.squares[lane] / total_kg_[lane]);
      // What is left is the next correction and those after it: a geometric series.
      const double ratio = iteration > 1 ? size_m / before_m[lane] : 1.0;
      const bool is_rounding =
          iteration > 2 && ratio > 0.1 && size_m <= kRoundingErrors * step.error_m;
      step.converged =
          size_m <= step.error_m || is_rounding || (ratio < 0.5 && size_m * ratio <= step.error_m);
      const bool is_hopeless =
          !std::isfinite(size_m) || ratio > 2.0 || iteration >= kMostIterations;
      before_m[lane] = size_m;
      if (step.converged || is_hopeless) {
        arrays_.active[lane] = 0.0;
      } else {
        is_any_active = true;
      }
    }
  }
  kernel_.finish(gauss_collocation(), arrays_);
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    steps_[lane].unresolved_m_s = std::sqrt(arrays_.squares[lane] / total_kg_[lane]);
  }
}

void CollocationLanes::accept() {
  for (std::size_t lane = 0; lane < lanes(); ++lane) {
    for (std::size_t i = lane; !steps_[lane].is_accepted && i < 3 * size_ * lanes(); i += lanes()) {
      arrays_.next[i] = arrays_.state[i];
    }
  }
  std::swap(arrays_.state, arrays_.next);
}

CollocationLanes::Entries CollocationLanes::entries(std::size_t lane, std::size_t i) const {
  Entries entries;
  for (std::size_t vector = 0; vector < entries.size(); ++vector) {
    const std::size_t row = vector < 3 ? vector : vector - 3;
    const double* numbers = vector < 3 ? arrays_.state : arrays_.stage_a;
    entries[vector] = numbers[(row * size_ + i) * lanes() + lane];
  }
  return entries;
}

std::vector<double> CollocationLanes::state_and_stages(std::size_t lane) const {
  std::vector<double> numbers;
  numbers.reserve((3 + GaussCollocation::kStages) * size_);
  for (std::size_t i = lane; i < 3 * size_ * lanes(); i += lanes()) {
    numbers.push_back(arrays_.state[i]);
  }
  for (std::size_t i = lane; i < GaussCollocation::kStages * size_ * lanes(); i += lanes()) {
    numbers.push_back(arrays_.stage_a[i]);
  }
  return numbers;
}

}  // namespace oblique::solver
