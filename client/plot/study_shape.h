#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/oblique.pb.h"

namespace oblique::client::plot {

/// A key of a study that the recipe gives values to.
struct StudyAxis {
  std::string key;     ///< as studies write it: "E"
  std::string column;  ///< as questions do: "E_Pa"; for single lengths an expression
  /// Values of the chosen block, rising; none where they are drawn from a distribution or follow
  /// from others, or are more than kMostListed.
  std::vector<double> values = {};
  std::vector<double> all_values = {};  ///< the same of all blocks that are drawn
  bool is_listed = true;                ///< `values` has them all
  bool is_logarithmic = false;          ///< its range is

  /// Whether it has more than one value in the chosen block.
  bool varies() const { return !is_listed || values.size() > 1; }
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

/// The column of questions that a key is.
std::string column_of_key(const std::string& key);

/// The block with the most points of those that `is_meant`; nothing: there is none.
std::optional<BlockOfStudy> largest_block(
    const protocol::Recipe& recipe, const std::function<bool(const protocol::Block&)>& is_meant);

/// Of a recipe that was judged, with the axes of that block: of its points alone (`is_alone`), or
/// of those of all blocks.
StudyShape shape_of(const protocol::Recipe& recipe, const BlockOfStudy& block, bool is_alone);

}  // namespace oblique::client::plot
