#pragma once

#include <string>

#include "client/plot/plot_request.h"
#include "client/plot/study_shape.h"
#include "proto/oblique.pb.h"

namespace oblique::client::plot {

/// The study as a picture of it needs it. Of several blocks a map, or lines, show one: that of
/// `--block`, else that with the most points of those in which the axes vary that are asked for and
/// which have what `--at` holds. Where there is none, where that block is no grid, with `--block
/// all`, and of points and histograms unless a block is named, all of them are shown. Throws
/// solver::InputError for a block that the study does not have, and for a recipe without points.
StudyShape shape_for(const protocol::Recipe& recipe, const PlotRequest& request);

/// "block 4 of 4": which one is drawn.
std::string block_in_words(const StudyShape& shape);

}  // namespace oblique::client::plot
