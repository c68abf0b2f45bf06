// Whether the margin of a contact tells how far its mode is from another one: random points, the
// same points a little displaced, and how many of them have another mode then, by their margin.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "worker/solver/solve.h"

namespace oblique::solver {
namespace {

/// Ends of the bands into which margins are sorted.
constexpr std::array kBands{1e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1.0};

struct Answer {
  std::string mode;
  double margin = 0.0;
};
/// By number; nothing for points without an answer.
using Answers = std::vector<std::optional<Answer>>;

std::vector<PointRequest> random_points(std::uint64_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  };
  std::vector<PointRequest> points;
  for (std::uint64_t number = 0; number < count; ++number) {
    points.push_back({number, between(0.1, 1.15), between(0.01, 2.0), between(0.4, 0.99)});
  }
  return points;
}

Answers solved(const Finger& finger, const std::vector<PointRequest>& points) {
  Answers answers(points.size());
  std::size_t next = 0;
  finger.solve_points(
      [&] { return next < points.size() ? std::optional(points[next++]) : std::nullopt; },
      [&](PointOutcome&& outcome) {
        if (outcome.result) {
          answers[outcome.number] = Answer{outcome.result->mode, *outcome.result->margin};
        }
      });
  return answers;
}

/// Prints how many points for which `counts` is true lie in each band, and the largest margin.
template <class Counts>
void print_line(const std::string& what, const Answers& base, const Counts& counts) {
  std::array<int, kBands.size()> in_band{};
  double largest = 0.0;
  for (std::size_t i = 0; i < base.size(); ++i) {
    if (base[i] && counts(i)) {
      const auto* const band = std::upper_bound(kBands.begin(), kBands.end() - 1, base[i]->margin);
      ++in_band[static_cast<std::size_t>(band - kBands.begin())];
      largest = std::max(largest, base[i]->margin);
    }
  }
  std::printf("| %s |", what.c_str());
  for (const int number : in_band) {
    std::printf(" %d |", number);
  }
  std::printf(" %.1e |\n", largest);
}

class MarginStudy {
 public:
  MarginStudy(std::uint64_t count, std::uint64_t seed)
      : points_(random_points(count, seed)), base_(solved(finger_, points_)) {}

  void run() const {
    std::printf("| margin below |");
    for (const double end : kBands) {
      std::printf(" %g |", end);
    }
    std::printf(" largest |\n|---|");
    for (std::size_t i = 0; i <= kBands.size(); ++i) {
      std::printf("---:|");
    }
    std::printf("\n");
    print_line("points", base_, [](std::size_t) { return true; });
    for (const double by : {1e-4, 1e-3}) {
      const std::string size = by < 5e-4 ? "1e-4" : "1e-3";
      print_displaced("H by " + size, by, &PointRequest::H_m);
      print_displaced("mu by " + size, by, &PointRequest::mu);
      print_displaced("e* by " + size, by, &PointRequest::e_star);
    }
    const double dt_s = finger_.solve(1.0, 0.4, 1.0).solver.dt_s;
    for (const double factor : {0.5, 2.0}) {
      ModelParameters model = preset("paper");
      model.dt_s = factor * dt_s;
      print_changes(factor < 1.0 ? "half the step" : "twice the step",
                    {solved(Finger(model), points_)});
    }
  }

 private:
  /// Both ways.
  void print_displaced(const std::string& what, double by, double PointRequest::*key) const {
    std::vector<Answers> sets;
    for (const double side : {-1.0, 1.0}) {
      auto displaced = points_;
      for (PointRequest& point : displaced) {
        point.*key *= 1.0 + side * by;
      }
      sets.push_back(solved(finger_, displaced));
    }
    print_changes(what, sets);
  }

  /// Of the points that have another mode in one of the sets.
  void print_changes(const std::string& what, const std::vector<Answers>& sets) const {
    print_line(what, base_, [&](std::size_t i) {
      return std::any_of(sets.begin(), sets.end(), [&](const Answers& set) {
        return set[i] && set[i]->mode != base_[i]->mode;
      });
    });
  }

  Finger finger_{preset("paper")};
  std::vector<PointRequest> points_;
  Answers base_;
};

}  // namespace
}  // namespace oblique::solver

/// Number of points, and seed.
int main(int count, char** words) {
  const auto number = [&](int place, std::uint64_t otherwise) {
    return count > place ? std::strtoull(words[place], nullptr, 10) : otherwise;
  };
  oblique::solver::MarginStudy(number(1, 10'000), number(2, 1)).run();
}
