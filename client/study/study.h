#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "proto/oblique.pb.h"
#include "proto/recipe/point_table.h"

namespace oblique::client {

/// Puts the place of what a sentence of PointTable::judge_points speaks of before it: file, line
/// and column, or the flag.
using Located = std::function<std::string(const std::string& sentence)>;

/// A study as people write it: a name and what makes its points.
struct Study {
  std::string name;
  protocol::Recipe recipe;
  Located located = {};  ///< none: no place is known
};

/// What a sentence of PointTable::judge_points speaks of, by its beginning.
struct Subject {
  std::size_t block;     ///< its number, from 0
  std::string_view key;  ///< of an axis, or `where`; part of the sentence
};
Subject subject_of(std::string_view sentence);

/// Judges what only the points tell (PointTable::judge_points). Throws solver::InputError with the
/// place.
void judge_points(const protocol::PointTable& table, const Located& located);
void judge_points(const Study& study);

}  // namespace oblique::client
