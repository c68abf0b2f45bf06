#pragma once

#include <cstddef>
#include <string>

#include "proto/recipe/point_table.h"

namespace oblique::client {

/// What a study costs on this machine with all threads busy.
struct StudyCost {
  std::size_t threads = 1;
  std::size_t falls_at_once = 1;  ///< falls that one thread solves side by side in lanes
  double falls_s = 0.0;           ///< time of that many falls, or fewer
  double contact_s = 0.0;         ///< thread time of a point without its fall
  std::size_t timed_falls = 0;
  std::size_t timed_points = 0;
};
/// Times some falls of the study (about 1 s on 16 elements a link, 4 s on 48), then contacts over
/// them for a second.
StudyCost measured_cost(const protocol::PointTable& table, const protocol::StudySize& size);

/// (Falls x time of a fall + points x time of a contact)/threads.
double time_s(const StudyCost& cost, const protocol::StudySize& size);

/// "about 15 min on 2 threads". If falls take most of it, also which parameters share a fall, and
/// how many values of the sampled keys would make it short.
std::string time_in_words(const StudyCost& cost, const protocol::StudySize& size,
                          const protocol::Recipe& recipe);

}  // namespace oblique::client
