#pragma once

#include <cstddef>
#include <string>

#include "proto/recipe/point_table.h"

namespace oblique::client {

/// What a study costs here with all threads at work.
struct StudyCost {
  std::size_t threads = 1;
  std::size_t falls_at_once = 1;  ///< that a thread solves side by side, in lanes
  double falls_s = 0.0;           ///< for so many or fewer
  double contact_s = 0.0;         ///< of a thread, for a point without its fall
  std::size_t timed_falls = 0;
  std::size_t timed_points = 0;
};
/// Solves some falls of the study, about 1 s on 16 elements a link and 4 s on 48, and for a second
/// contacts over them.
StudyCost measured_cost(const protocol::PointTable& table, const protocol::StudySize& size);

/// (Falls x time of a fall + points x time of a contact)/threads.
double time_s(const StudyCost& cost, const protocol::StudySize& size);

/// "about 15 min on 2 threads". Where most of it is falls, also what falls share, and how many
/// values of the keys that are drawn would make it short.
std::string time_in_words(const StudyCost& cost, const protocol::StudySize& size,
                          const protocol::Recipe& recipe);

}  // namespace oblique::client
