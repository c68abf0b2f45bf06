#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/plot/plot_request.h"
#include "proto/oblique.pb.h"

namespace oblique::client::plot {

/// A key of a study that the recipe gives values to.
struct StudyAxis {
  std::string key;     ///< as studies write it: "E"
  std::string column;  ///< as queries do: "E_Pa"; for single lengths an expression
  /// Values of the chosen block, rising; none where they are drawn from a distribution or follow
  /// from others, or are more than kMostListed.
  std::vector<double> values = {};
  std::vector<double> all_values = {};  ///< the same of all blocks that are drawn
  bool is_listed = true;                ///< `values` has them all
  bool is_logarithmic = false;          ///< its range is

  /// Whether it has more than one value in the chosen block.
  bool varies() const { return !is_listed || values.size() > 1; }
  bool is_named(std::string_view name) const { return name == key || name == column; }
};
inline constexpr std::uint64_t kMostListed = 100'000;

/// One of a study's blocks, whose points follow each other.
struct BlockOfStudy {
  std::size_t number = 0;  ///< from 0
  std::uint64_t first_point = 0;
  std::uint64_t points = 0;
};

/// What a study is made of, as far as pictures need it.
struct StudyShape {
  std::vector<StudyAxis> axes;  ///< in the order of the recipe: model keys, then H, mu and e
  bool is_grid = true;          ///< the chosen block is a product of its axes
  BlockOfStudy block = {};      ///< whose axes these are
  std::size_t blocks = 1;       ///< of the study
  std::uint64_t points = 0;     ///< of all blocks, with those that filters leave out
  bool is_one_block = false;    ///< of several blocks pictures show the chosen one alone

  /// nullptr: there is none of that key or column.
  const StudyAxis* find(std::string_view name) const;
  /// The keys with more than one value.
  std::vector<const StudyAxis*> varying() const;
};

/// The study as a picture of it needs it. Of several blocks a map, or lines, show one: that of
/// `--block`, else that with the most points of those in which the axes vary that are asked for and
/// which have what `--at` holds. Where there is none, where that block is no grid, with `--block
/// all`, and of points and histograms unless a block is named, all of them are shown. Throws
/// solver::InputError for a block that the study does not have, and for a recipe without points.
StudyShape shape_for(const protocol::Recipe& recipe, const PlotRequest& request);

}  // namespace oblique::client::plot
