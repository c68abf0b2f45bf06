#pragma once

#include "client/output/work_line.h"
#include "client/study/reach.h"
#include "worker/solver/solve.h"

namespace oblique::client {

/// Looks into what the verbs take as points, by solving falls here. On a terminal it says what it
/// waits for.
ReachCheck tip_reach();

/// Lets the finger fall, if it has not fallen yet, and says on `line` how far it is.
double largest_drop_m(const solver::Finger& finger, WorkLine& line);

}  // namespace oblique::client
