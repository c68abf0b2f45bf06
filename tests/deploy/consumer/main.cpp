#include <cstdio>
#include <exception>

#include <oblique/solver.h>

int main() {
  const oblique::Finger finger(oblique::preset("printed"));
  const auto impact = finger.solve(1.0, 0.4, 0.9);
  std::printf("%.17g %.17g %.17g %s %s\n", impact.fn_peak_N, impact.duration_s,
              impact.energy.closure, impact.mode.c_str(), oblique::version().c_str());
  try {
    static_cast<void>(finger.solve(1.0, -0.4, 0.9));
  } catch (const oblique::InputError& error) {
    std::printf("%s\n", error.what());
  }
}
