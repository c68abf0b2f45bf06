#pragma once

#include <string>

namespace oblique::test {

/// The first difference between two databases in what must not depend on who solved what and when:
/// studies, models and results, row for row and to the last bit, without numbers given in order of
/// arrival, times of day, durations, and by whose key a study came, which is none without keys.
/// Empty when there is none.
std::string first_difference(const std::string& database, const std::string& other);

}  // namespace oblique::test
