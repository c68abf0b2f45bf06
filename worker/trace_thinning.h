#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "worker/solver/model/trace.h"

namespace oblique::worker {

/// Rows of a trace within a bound of bytes: all of them where they are few enough, else evenly
/// chosen ones. Among them are then, of each stretch between two that are chosen, those with the
/// largest and the smallest normal force and the largest tangential one, those at which the state
/// changes, and the last. Of the fall at most a quarter of the bytes is kept, evenly in time.
class TraceThinning {
 public:
  struct Row {
    std::uint64_t number;  ///< among the rows of the contact, or of the fall
    std::vector<double> numbers;
    double fn_N;
    double ft_N;  ///< its magnitude
    std::uint8_t state;
  };
  using Shared = std::shared_ptr<const Row>;

  explicit TraceThinning(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void add(const solver::TraceRow& row);
  /// What is kept, in the order of time.
  std::vector<Shared> rows() const;

  /// A fall and a contact of fewer rows are of no use.
  static constexpr std::size_t kFewestRows = 16;
  /// Bytes of a row of so many numbers.
  static std::size_t bytes_of(std::size_t numbers) { return numbers * sizeof(double) + 1; }

 private:
  /// Rows that follow each other.
  struct Stretch {
    Shared first;
    Shared largest_normal;
    Shared smallest_normal;
    Shared largest_tangential;

    void take(const Stretch& next);
  };

  std::size_t most_rows() const;
  void halve();
  std::vector<Shared> contact_rows() const;

  std::size_t most_bytes_;
  std::size_t row_bytes_ = 0;
  std::vector<Shared> fall_;
  std::vector<Stretch> stretches_;
  std::vector<Shared> changes_;  ///< of the state: the rows before and after
  Shared last_;
  std::uint64_t rows_of_fall_ = 0;
  std::uint64_t rows_of_contact_ = 0;
  std::uint64_t a_stretch_ = 1;   ///< rows
  std::size_t kept_at_most_ = 0;  ///< of the contact, counted again when it is too much
};

}  // namespace oblique::worker
