#pragma once

#include <string>

namespace oblique::validation {

/// One line of the table.
struct Check {
  std::string what;       ///< what is measured
  std::string reference;  ///< where the right answer comes from
  double measured;
  double bound;
  std::string reason;  ///< where the bound comes from
};

/// Fails the running test unless measured <= bound, and adds a line to the table. Texts must not
/// hold '|', which separates the columns.
void expect_at_most(const Check& check);
/// The same for measured >= bound.
void expect_at_least(const Check& check);

}  // namespace oblique::validation
