#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"

namespace oblique::client {

/// Puts the place of what a sentence of PointTable::survey speaks of before it: file, line and
/// column, or the flag.
using Located = std::function<std::string(const std::string& sentence)>;

/// A study as people write it: a name and what makes its points.
struct Study {
  std::string name;
  protocol::Recipe recipe;
  Located located = {};  ///< none: no place is known
};

/// What a sentence of PointTable::survey speaks of, by its beginning.
struct Subject {
  std::size_t block;     ///< its number, from 0
  std::string_view key;  ///< of an axis, or `where`; part of the sentence
};
Subject subject_of(std::string_view sentence);

/// Judges what only the points tell and counts what filters leave in (PointTable::survey, which
/// `goes_on` is for too). False when that was ended. Throws solver::InputError with the place.
bool judge_points(
    protocol::PointTable& table, const Located& located,
    const std::function<bool()>& goes_on = [] { return true; });

/// The same of a study that goes to a server, unless its points are more than a second's work,
/// which the server judges.
void judge_points(const Study& study);

}  // namespace oblique::client
