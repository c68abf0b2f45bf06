#pragma once

#include <string>

namespace oblique::validation {

/// One line of the table.
struct Check {
  std::string what;       ///< what is measured
  std::string reference;  ///< source of the right answer
  double measured;
  double bound;
  std::string reason;  ///< why this bound
};

/// Adds a line to the table, and fails the running test unless measured <= bound. Texts must not
/// contain '|', which separates the columns.
void expect_at_most(const Check& check);
/// The same for measured >= bound.
void expect_at_least(const Check& check);

}  // namespace oblique::validation
