#pragma once

#include <string>

namespace oblique::validation {

/// One line of the table.
struct Check {
  std::string what;       ///< what is measured
  std::string reference;  ///< source of the correct value
  double measured;
  double bound;
  std::string reason;  ///< reason for this bound
};

/// Adds a line to the table, and fails the running test unless measured <= bound. Texts must not
/// contain '|', which separates the columns.
void expect_at_most(const Check& check);
/// Like expect_at_most(), but requires measured >= bound.
void expect_at_least(const Check& check);

}  // namespace oblique::validation
