#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/database.h"
#include "tests/support/process.h"
#include "tests/system/many_points.h"

namespace oblique::test {

/// The words after `oblique` by which a client submits the study and watches it to its end, but for
/// the server.
std::vector<std::string> submit_and_watch();

/// Waits until so many points have a row.
void wait_for_rows(const Database& database, double at_least);

/// The watching `client` learns that the study has ended, each point has one row, none failed, and
/// by `workers`, what `oblique workers --format json` wrote, none is taken for one that is lost
/// again and again.
void expect_completed(Process& client, const Database& database,
                      const std::function<std::string()>& workers);

double seconds_since(std::chrono::steady_clock::time_point then);

/// Prints what was measured beside the test's own lines.
void print_measured(const std::string& what, double time_s);

}  // namespace oblique::test
