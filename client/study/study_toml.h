#pragma once

#include <string>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// A study file of that name and recipe: read again it gives a recipe of the same digest.
/// The recipe is one that was judged. What came from CSV files stands in it as lists.
std::string study_toml(const std::string& name, const protocol::Recipe& recipe);

}  // namespace oblique::client
