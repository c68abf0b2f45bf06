#pragma once

#include <cstddef>

namespace oblique::solver {

/// `count` hardware vectors used as one: lanes of independent cases. More than one vector hides the
/// latency of the banded solve, whose rows depend on each other.
/// `Hardware::Vector` is a compiler's vector of doubles; the type's name keeps instances for
/// different instruction sets apart. Arithmetic only; a number on the other side of an operator
/// goes to all lanes.
template <class Hardware, std::size_t count>
struct LanePack {
  using Vector = typename Hardware::Vector;
  static constexpr std::size_t kLanes = count * sizeof(Vector) / sizeof(double);

  Vector part[count];

  template <class Operation>
  static inline LanePack each(Operation operation) {
    LanePack result;
    for (std::size_t i = 0; i < count; ++i) {
      result.part[i] = operation(i);
    }
    return result;
  }

  friend inline LanePack operator+(const LanePack& a, const LanePack& b) {
    return each([&](std::size_t i) { return a.part[i] + b.part[i]; });
  }
  friend inline LanePack operator-(const LanePack& a, const LanePack& b) {
    return each([&](std::size_t i) { return a.part[i] - b.part[i]; });
  }
  friend inline LanePack operator*(const LanePack& a, const LanePack& b) {
    return each([&](std::size_t i) { return a.part[i] * b.part[i]; });
  }
  friend inline LanePack operator+(const LanePack& a, double b) {
    return each([&](std::size_t i) { return a.part[i] + b; });
  }
  friend inline LanePack operator-(const LanePack& a, double b) {
    return each([&](std::size_t i) { return a.part[i] - b; });
  }
  friend inline LanePack operator*(const LanePack& a, double b) {
    return each([&](std::size_t i) { return a.part[i] * b; });
  }
  friend inline LanePack operator-(double a, const LanePack& b) {
    return each([&](std::size_t i) { return a - b.part[i]; });
  }
  friend inline LanePack operator+(double a, const LanePack& b) { return b + a; }
  friend inline LanePack operator*(double a, const LanePack& b) { return b * a; }
  inline LanePack& operator+=(const LanePack& b) { return *this = *this + b; }
  inline LanePack& operator-=(const LanePack& b) { return *this = *this - b; }
};

}  // namespace oblique::solver
