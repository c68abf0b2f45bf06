#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace oblique::solver {

/// One impact of the preset `paper` as an independent explicit solution gives it, converged in the
/// step; forces to 0.01 N, times to 0.01 us, slide to 10 nm.
struct KnownImpact {
  double H_m;
  double mu;
  double e_star;
  std::vector<double> fn_peaks_N;
  std::vector<double> phases_us;
  double contact_us;
  std::string mode;
  std::size_t major_peaks;  ///< as published
  double slide_mm;          ///< < 0: not known
  double stick_us;
  double ft_peak_N;  ///< < 0: not known
};

inline const std::vector<KnownImpact>& known_impacts() {
  const std::string three = "sC sR sC sR sC sR";
  const std::string four = "sC sR sC sR sC sR sC sR";
  const std::string stick = "SC SR sR sC sR";
  // clang-format off
  static const std::vector<KnownImpact> impacts{
      {1.00, 0.4, 1.0, {5057.63, 1516.64, 2358.21},
       {68.94, 161.70, 69.77, 70.30, 101.19, 79.23}, 551.13, three, 3, 1.00135, 0.0, -1.0},
      {1.00, 0.4, 0.8, {5057.63, 1736.82, 2577.42},
       {68.94, 107.42, 116.33, 72.77, 102.88, 67.77}, 536.11, three, 3, 1.04358, 0.0, -1.0},
      {1.00, 0.4, 0.6, {5057.63, 1803.78, 2788.27},
       {68.94, 83.74, 135.09, 68.47, 105.92, 58.97}, 521.13, three, 3, 1.08213, 0.0, -1.0},
      {0.96, 0.4, 1.0, {4887.83, 1639.06, 2465.77},
       {66.02, 146.37, 83.24, 77.43, 101.92, 74.88}, 549.86, three, 3, 1.08502, 0.0, -1.0},
      {1.04, 0.4, 1.0, {5217.04, 1335.73, 2443.84},
       {73.50, 167.91, 64.63, 57.66, 104.11, 86.11}, 553.92, three, 3, 0.90816, 0.0, -1.0},
      {1.00, 0.6, 1.0, {4744.57, 784.43, 1587.48, 2395.13},
       {65.52, 122.06, 5.97, 17.34, 82.96, 76.17, 98.58, 75.10}, 543.70, four, 3, 0.91376, 0.0, -1.0},
      {1.00, 0.8, 1.0, {4470.76, 1617.97, 2467.37},
       {62.19, 116.79, 110.86, 77.88, 96.86, 71.88}, 536.46, three, 3, 0.83962, 0.0, -1.0},
      {1.00, 1.2, 1.0, {4281.94, 1573.71},
       {57.28, 113.00, 115.74, 59.80}, 345.82, stick, 2, -1.0, 70.49, 4924.49},
      {1.00, 1.4, 1.0, {4281.94, 1496.67},
       {57.28, 108.26, 119.50, 57.28}, 342.32, stick, 2, -1.0, 83.42, 4967.52},
      {1.00, 1.6, 1.0, {4281.94, 1421.47},
       {57.28, 106.24, 117.54, 58.78}, 339.84, stick, 2, -1.0, 92.11, 4967.52},
  };
  // clang-format on
  return impacts;
}

}  // namespace oblique::solver
