#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "client/service/source_flags.h"
#include "client/study/point_flags.h"
#include "client/verbs/picture_flags.h"

namespace oblique::client {

/// What flags of `plot` say of one point.
struct PointPictureFlags {
  std::string study;                  ///< empty: the point is that of `values`
  std::optional<std::int64_t> point;  ///< of the study
  PointFlags values;                  ///< of a point of no study
  std::string panel;                  ///< empty: all
  bool local = false;
  bool on_worker = false;
};

/// Adds --point, --panel, --local, --on-worker and the flags of a point's values and model. `flags`
/// must live as long as `verb`.
void add_point_picture_flags(CLI::App& verb, PointPictureFlags& flags, bool with_single_lengths);

/// Whether the flags mean a point. Throws solver::InputError where they contradict each other.
bool is_point_meant(const PointPictureFlags& flags);

/// Solves the point again and draws its time histories. Throws what solving and writing throw, and
/// std::runtime_error for a point without an answer.
int plot_point(const PointPictureFlags& flags, const PictureFlags& picture,
               const SourceFlags& source);

}  // namespace oblique::client
