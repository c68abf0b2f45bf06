// `oblique-kill-matrix FIRST_SEED COUNT` runs the cycles of COUNT seeds and prints failed cycles.
#include <chrono>
#include <cstdint>
#include <exception>
#include <iostream>
#include <string>

#include "tests/system/kill_matrix/kill_cycle.h"

int main(int argc, char** argv) {
  using namespace oblique::test;
  if (argc != 3) {
    std::cerr << "usage: oblique-kill-matrix FIRST_SEED COUNT\n";
    return 2;
  }
  try {
    const auto start = std::chrono::steady_clock::now();
    const MatrixReport report = run_matrix(std::stoull(argv[1]), std::stoull(argv[2]));
    const auto took = std::chrono::steady_clock::now() - start;
    for (const std::string& failure : report.failures) {
      std::cout << failure << "\n\n";
    }
    std::cout << report.cycles << " cycles in "
              << std::chrono::duration_cast<std::chrono::seconds>(took).count() << " s, "
              << report.not_reached << " ended before their point, " << report.failures.size()
              << " failed\n";
    return report.failures.empty() ? 0 : 1;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}
