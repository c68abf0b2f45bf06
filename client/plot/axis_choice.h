#pragma once

#include <string>
#include <vector>

#include "client/plot/plot_request.h"
#include "client/plot/study_shape.h"

namespace oblique::client::plot {

/// An axis of a picture.
struct ChosenAxis {
  std::string column;               ///< as questions have it
  std::string name;                 ///< as it is labelled
  const StudyAxis* axis = nullptr;  ///< nullptr: it is a column of results
};

/// The axis that a flag names. Throws solver::InputError for a name like those of the study's keys
/// that is none, with the nearest; other expressions are left to the source to judge.
ChosenAxis chosen_axis(const std::string& flag, const std::string& text, const StudyShape& shape);

/// Keys in the order in which pictures take them for axes: mu, H, then those with the most values.
std::vector<const StudyAxis*> by_preference(const StudyShape& shape);

/// What holds for all points of a picture.
struct Condition {
  std::string sql;                 ///< empty: all points
  std::string sql_without_where;   ///< the same, also of points that --where leaves out
  std::vector<std::string> shown;  ///< "e = 0.9", for the subtitle
  std::vector<std::string> said;   ///< sentences about what was chosen
};

/// --where and --at, and with `fixes_others` the first value of each other axis that is left open.
/// `drawn`: the axes of the picture. Throws solver::InputError for an --at that names no key, or a
/// value that the key does not have, with the nearest.
Condition condition_of(const PlotRequest& request, const StudyShape& shape,
                       const std::vector<ChosenAxis>& drawn, bool fixes_others);

/// Whether a condition speaks of a key.
bool names_axis(const std::string& condition, const StudyAxis& axis);

}  // namespace oblique::client::plot
