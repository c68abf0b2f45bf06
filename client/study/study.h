#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "proto/oblique.pb.h"

namespace oblique::client {

/// A study as people write it: a name and what makes its points.
struct Study {
  std::string name;
  protocol::Recipe recipe;
  /// Puts the place of what a sentence of PointTable::survey speaks of before it: file, line and
  /// column, or the flag. None: no place is known.
  std::function<std::string(const std::string& sentence)> located = {};
};

/// What a sentence of PointTable::survey speaks of, by its beginning.
struct Subject {
  std::size_t block;     ///< its number, from 0
  std::string_view key;  ///< of an axis, or `where`; part of the sentence
};
Subject subject_of(std::string_view sentence);

/// Judges what only the points tell (PointTable::survey), unless they are more than a second's
/// work, which the server judges. Throws solver::InputError with the place.
void judge_points(const Study& study);

}  // namespace oblique::client
