// Counts how often the 95 % intervals of `oblique fit` contain the true value. Uses many more
// synthetic measurements than a test has time for.
#include <cstdint>
#include <string>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "tests/client/explore/fit_coverage.h"

int main(int argc, char** argv) {
  CLI::App app("How often 95 % intervals of fits to synthetic measurements cover the truth");
  int fits = 1000;
  std::uint64_t seed = 1;
  app.add_option("--fits", fits, "number of fits")->capture_default_str();
  app.add_option("--seed", seed, "of the noise")->capture_default_str();
  bool is_scaled = false;
  app.add_flag("--scale", is_scaled, "fit with a wrong deviation and scale it");
  CLI11_PARSE(app, argc, argv);
  const auto coverage = oblique::test::fit_coverage(fits, seed, is_scaled);
  const auto percent = [&](int covered) { return 100.0 * covered / coverage.fits; };
  fmt::print("{} fits: k {:.1f} %, eta2 {:.1f} %\n", coverage.fits, percent(coverage.k),
             percent(coverage.eta2));
  return 0;
}
