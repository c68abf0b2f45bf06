#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace oblique::solver {

/// One impact of the preset `paper`. The values are from an independent explicit solution with
/// converged steps. Forces are rounded to 0.01 N, times of phases and contacts to 0.001 us, stick
/// to 0.01 us, slide to 10 nm.
struct KnownImpact {
  double H_m;
  double mu;
  double e_star;
  std::vector<double> fn_peaks_N;
  std::vector<double> phases_us;
  double contact_us;
  std::string mode;
  std::size_t major_peaks;  ///< as published
  double slide_mm;          ///< negative if unknown
  double stick_us;
  double ft_peak_N;  ///< negative if unknown
};

inline const std::vector<KnownImpact>& known_impacts() {
  const std::string three = "sC sR sC sR sC sR";
  const std::string four = "sC sR sC sR sC sR sC sR";
  const std::string stick = "SC SR sR sC sR";
  // clang-format off
  static const std::vector<KnownImpact> impacts{
      {1.00, 0.4, 1.0, {5057.63, 1516.64, 2358.21},
       {68.933, 161.711, 69.753, 70.303, 101.194, 79.236}, 551.128, three, 3, 1.00135, 0.0, -1.0},
      {1.00, 0.4, 0.8, {5057.63, 1736.82, 2577.42},
       {68.933, 107.422, 116.329, 72.771, 102.874, 67.778}, 536.105, three, 3, 1.04358, 0.0, -1.0},
      {1.00, 0.4, 0.6, {5057.63, 1803.78, 2788.27},
       {68.933, 83.734, 135.094, 68.471, 105.922, 58.972}, 521.126, three, 3, 1.08213, 0.0, -1.0},
      {0.96, 0.4, 1.0, {4887.83, 1639.06, 2465.77},
       {66.010, 146.372, 83.239, 77.427, 101.924, 74.885}, 549.857, three, 3, 1.08502, 0.0, -1.0},
      {1.04, 0.4, 1.0, {5217.04, 1335.73, 2443.84},
       {73.490, 167.908, 64.627, 57.663, 104.112, 86.117}, 553.917, three, 3, 0.90816, 0.0, -1.0},
      {1.00, 0.6, 1.0, {4744.57, 784.43, 1587.48, 2395.13},
       {65.512, 122.053, 5.980, 17.338, 82.959, 76.168, 98.578, 75.108}, 543.697, four, 3, 0.91376, 0.0, -1.0},
      {1.00, 0.8, 1.0, {4470.76, 1617.97, 2467.37},
       {62.179, 116.795, 110.856, 77.882, 96.859, 71.882}, 536.454, three, 3, 0.83962, 0.0, -1.0},
      {1.00, 1.2, 1.0, {4281.94, 1573.71},
       {57.271, 113.003, 115.734, 59.809}, 345.818, stick, 2, -1.0, 70.49, 4924.49},
      {1.00, 1.4, 1.0, {4281.94, 1496.67},
       {57.271, 108.256, 119.499, 57.290}, 342.316, stick, 2, -1.0, 83.42, 4967.52},
      {1.00, 1.6, 1.0, {4281.94, 1421.47},
       {57.271, 106.240, 117.536, 58.785}, 339.832, stick, 2, -1.0, 92.11, 4967.52},
  };
  // clang-format on
  return impacts;
}

}  // namespace oblique::solver
