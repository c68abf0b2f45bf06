#pragma once

#include <map>
#include <string>

#include "client/study/point_flags.h"

namespace oblique::client {

/// The flags of one point, with some replaced or added.
inline PointFlags flags_of(std::map<std::string, std::string> axes) {
  PointFlags flags;
  flags.axes = {{"H", "1"}, {"mu", "0.4"}, {"e", "1"}};
  for (auto& [key, text] : axes) {
    flags.axes[key] = text;
  }
  return flags;
}

}  // namespace oblique::client
