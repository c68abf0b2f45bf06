#pragma once

#include <stdexcept>

namespace oblique::solver {

/// A value from the user that the solver cannot take. The message names key, value and what is
/// allowed.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A point that has no answer: the contact does not end, a step diverged.
class SolveError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace oblique::solver
