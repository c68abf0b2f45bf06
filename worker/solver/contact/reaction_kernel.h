#pragma once

#include <cstddef>
#include <cstdint>

/// The search for local maxima of the reactions in all lanes at once, as plain loops that compilers
/// turn into vector code: most steps have none in any lane, and one look says so. As
/// chain_kernel.h, nothing here may call an ordinary inline function that other translation units
/// share.
namespace oblique::solver {

/// Element [reaction * lanes + lane], or [lane]. Squared magnitudes; below 0: none yet.
struct ReactionArrays {
  std::size_t reactions;
  std::size_t lanes;
  const double* is_new;  ///< one a lane: not 0 where `next` counts
  const double* next;    ///< what comes after `last`
  double* last;
  double* before;              ///< what came before `last`
  const double* worth_a_look;  ///< a lower maximum is not the largest
  std::int64_t* candidates;    ///< what mark_candidates() found
};

/// The search by `Hardware::Vector`, a compiler's vector of doubles of which the lanes are a
/// multiple. The type's name keeps instances for different instruction sets apart.
template <class Hardware>
struct ReactionKernel {
  using Vector = typename Hardware::Vector;
  static constexpr std::size_t kWidth = sizeof(Vector) / sizeof(double);

  /// Marks where `last` is a local maximum worth a look, or `before` is none yet. Whether there are
  /// any marks.
  static bool mark_candidates(const ReactionArrays& arrays) {
    using Mask = decltype(Vector{} < Vector{});
    Mask any{};
    for (std::size_t i = 0; i < arrays.reactions * arrays.lanes; i += kWidth) {
      const Vector is_new = load(arrays.is_new + i % arrays.lanes);
      const Vector next = load(arrays.next + i);
      const Vector last = load(arrays.last + i);
      const Vector before = load(arrays.before + i);
      const Vector worth_a_look = load(arrays.worth_a_look + i);
      const Mask is_maximum = (last > worth_a_look) & (last >= before) & (last >= next);
      const Mask candidates = (is_new > 0.0) & (is_maximum | (before < 0.0));
      __builtin_memcpy(arrays.candidates + i, &candidates, sizeof candidates);
      any |= candidates;
    }
    bool is_any = false;
    for (std::size_t i = 0; i < kWidth; ++i) {
      is_any = is_any || any[i] != 0;
    }
    return is_any;
  }

  /// `next` becomes `last`, and `last` `before`, in the lanes where it is new.
  static void shift(const ReactionArrays& arrays) {
    for (std::size_t i = 0; i < arrays.reactions * arrays.lanes; i += kWidth) {
      const auto is_new = load(arrays.is_new + i % arrays.lanes) > 0.0;
      const Vector last = load(arrays.last + i);
      store(arrays.before + i, is_new ? last : load(arrays.before + i));
      store(arrays.last + i, is_new ? load(arrays.next + i) : last);
    }
  }

 private:
  static Vector load(const double* numbers) {
    Vector vector;
    __builtin_memcpy(&vector, numbers, sizeof vector);
    return vector;
  }
  static void store(double* numbers, const Vector& vector) {
    __builtin_memcpy(numbers, &vector, sizeof vector);
  }
};

}  // namespace oblique::solver
