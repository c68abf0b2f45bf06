#pragma once

/// Pairs (x, y) and multiply-adds, for the innermost loops. By hand, and without Eigen: `Real` is a
/// number or a pack of lanes, `Constant` may be a number where `Real` is a pack.
namespace oblique::solver {

/// c + a b. Multiply-adds are called by name, so that which operations round once is written here
/// and not left to a compiler, whose choice may differ from one instance of a template to the next.
/// For numbers it is what the compiler makes of it; packs have their own in lane_pack.h.
template <class C, class A, class B>
inline auto plus_product(const C& c, const A& a, const B& b) {
  return c + a * b;
}

/// c - a b.
template <class C, class A, class B>
inline auto less_product(const C& c, const A& a, const B& b) {
  return c - a * b;
}

template <class Real>
struct PlanarVector {
  Real x;
  Real y;

  friend inline PlanarVector operator+(const PlanarVector& a, const PlanarVector& b) {
    return {a.x + b.x, a.y + b.y};
  }
  friend inline PlanarVector operator-(const PlanarVector& a, const PlanarVector& b) {
    return {a.x - b.x, a.y - b.y};
  }
  template <class Constant>
  friend inline PlanarVector operator*(const Constant& a, const PlanarVector& b) {
    return {a * b.x, a * b.y};
  }
};

template <class Real>
inline Real dot(const PlanarVector<Real>& a, const PlanarVector<Real>& b) {
  return plus_product(a.x * b.x, a.y, b.y);
}

template <class Real, class Constant>
inline PlanarVector<Real> plus_product(const PlanarVector<Real>& c, const Constant& a,
                                       const PlanarVector<Real>& b) {
  return {plus_product(c.x, a, b.x), plus_product(c.y, a, b.y)};
}

template <class Real, class Constant>
inline PlanarVector<Real> less_product(const PlanarVector<Real>& c, const Constant& a,
                                       const PlanarVector<Real>& b) {
  return {less_product(c.x, a, b.x), less_product(c.y, a, b.y)};
}

}  // namespace oblique::solver
