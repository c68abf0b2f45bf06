#pragma once

#include <cstddef>
#include <string>

#include "proto/recipe/point_table.h"

namespace oblique::client {

/// Measured cost of a study on this machine with all threads busy.
struct StudyCost {
  std::size_t threads = 1;
  std::size_t falls_at_once = 1;  ///< number of falls that a thread solves at once in lanes
  double falls_s = 0.0;           ///< time for `falls_at_once` falls
  double contact_s = 0.0;         ///< time of a thread for a point without its fall
  std::size_t timed_falls = 0;
  std::size_t timed_points = 0;
};
/// Measures some falls of the study (about 1 s on 16 elements per link, 4 s on 48), then contacts
/// after these falls for one second.
StudyCost measured_cost(const protocol::PointTable& table, const protocol::StudySize& size);

/// Estimates the time [s]: (falls x time of a fall + points x time of a contact) / threads.
double time_s(const StudyCost& cost, const protocol::StudySize& size);

/// Returns the estimate as "about 15 min on 2 threads". If falls take most of the time, adds which
/// parameters share a fall, and the time with fewer values of the keys that change the fall.
std::string time_in_words(const StudyCost& cost, const protocol::StudySize& size,
                          const protocol::Recipe& recipe);

}  // namespace oblique::client
