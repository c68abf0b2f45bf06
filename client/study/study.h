#pragma once

#include <string>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// A study as people write it: a name and what makes its points.
struct Study {
  std::string name;
  protocol::Recipe recipe;
};

}  // namespace oblique::client
