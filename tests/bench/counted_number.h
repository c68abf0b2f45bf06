#pragma once

#include <cstdint>

namespace oblique::bench {

/// A number that counts the operations done on it, to learn how many the kernels do. A multiply-add
/// counts as two, as it does in a processor's peak.
class CountedNumber {
 public:
  CountedNumber() = default;
  // NOLINTNEXTLINE: a plain number is one of these, as it is for a vector of lanes
  CountedNumber(double value) : value_(value) {}

  static std::uint64_t& operations() {
    thread_local std::uint64_t count = 0;
    return count;
  }

  friend CountedNumber operator+(CountedNumber a, CountedNumber b) {
    return counted(a.value_ + b.value_);
  }
  friend CountedNumber operator-(CountedNumber a, CountedNumber b) {
    return counted(a.value_ - b.value_);
  }
  friend CountedNumber operator*(CountedNumber a, CountedNumber b) {
    return counted(a.value_ * b.value_);
  }
  CountedNumber& operator+=(CountedNumber b) { return *this = *this + b; }
  CountedNumber& operator-=(CountedNumber b) { return *this = *this - b; }

 private:
  static CountedNumber counted(double value) {
    ++operations();
    return {value};
  }
  double value_ = 0.0;
};

}  // namespace oblique::bench
