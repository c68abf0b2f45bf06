#pragma once

#include <cstddef>
#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace oblique::solver {

/// Vectors of the instruction sets that a source is compiled for, with their multiply-adds: c + a b
/// and c - a b, which round once where the hardware can.
struct BaselineVectors {
  using Vector = double __attribute__((vector_size(16), may_alias));
#if defined(__aarch64__)
  static Vector plus_product(Vector c, Vector a, Vector b) {
    return vfmaq_f64(c, a, b);
  }
  static Vector less_product(Vector c, Vector a, Vector b) {
    return vfmsq_f64(c, a, b);
  }
#else
  static Vector plus_product(Vector c, Vector a, Vector b) {
    return c + a * b;
  }
  static Vector less_product(Vector c, Vector a, Vector b) {
    return c - a * b;
  }
#endif
};

#if defined(__AVX2__) && defined(__FMA__)
struct Avx2Vectors {
  using Vector = double __attribute__((vector_size(32), may_alias));
  static Vector plus_product(Vector c, Vector a, Vector b) { return _mm256_fmadd_pd(a, b, c); }
  static Vector less_product(Vector c, Vector a, Vector b) { return _mm256_fnmadd_pd(a, b, c); }
};
#endif

#if defined(__AVX512F__)
struct Avx512Vectors {
  using Vector = double __attribute__((vector_size(64), may_alias));
  static Vector plus_product(Vector c, Vector a, Vector b) { return _mm512_fmadd_pd(a, b, c); }
  static Vector less_product(Vector c, Vector a, Vector b) { return _mm512_fnmadd_pd(a, b, c); }
};
#endif

/// `count` hardware vectors used as one number for each lane. More than one vector hides the
/// latency of the banded solve, whose rows depend on each other.
template <class Hardware, std::size_t count>
struct LanePack {
  using Vector = typename Hardware::Vector;
  static constexpr std::size_t kLanes = count * sizeof(Vector) / sizeof(double);

  Vector part[count];

  LanePack() = default;
  /// `value` in all lanes.
  inline LanePack(double value) : LanePack(each([&](std::size_t) { return value - Vector{}; })) {}

  template <class Operation>
  static inline LanePack each(const Operation& operation) {
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
  friend inline LanePack operator/(const LanePack& a, const LanePack& b) {
    return each([&](std::size_t i) { return a.part[i] / b.part[i]; });
  }
  inline LanePack& operator+=(const LanePack& b) { return *this = *this + b; }
  inline LanePack& operator-=(const LanePack& b) { return *this = *this - b; }
};

/// As the functions in element_force.h; c and a are packs of the same kind or numbers.
template <class C, class A, class Hardware, std::size_t count>
inline auto plus_product(const C& c, const A& a, const LanePack<Hardware, count>& b) {
  using Pack = LanePack<Hardware, count>;
  const Pack c_pack = c;
  const Pack a_pack = a;
  return Pack::each([&](std::size_t i) {
    return Hardware::plus_product(c_pack.part[i], a_pack.part[i], b.part[i]);
  });
}

template <class C, class A, class Hardware, std::size_t count>
inline auto less_product(const C& c, const A& a, const LanePack<Hardware, count>& b) {
  using Pack = LanePack<Hardware, count>;
  const Pack c_pack = c;
  const Pack a_pack = a;
  return Pack::each([&](std::size_t i) {
    return Hardware::less_product(c_pack.part[i], a_pack.part[i], b.part[i]);
  });
}

}  // namespace oblique::solver
