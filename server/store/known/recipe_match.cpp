#include "server/store/known/recipe_match.h"

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "proto/recipe/canonical.h"
#include "server/store/known/product_match.h"
#include "server/store/known/recipe_blocks.h"

namespace oblique::server {
namespace {

using Take = std::function<void(const SharedRun&)>;

/// What costs more than a plain number: the text of a model; a pair of blocks; a run that is kept.
constexpr std::uint64_t kModelWork = 100;
constexpr std::uint64_t kPairWork = 500;
constexpr std::uint64_t kRunWork = 8;
/// Points in a table take memory.
constexpr std::uint64_t kMostTabled = 5'000'000;

/// The points of one study by what they are, where nothing inverts its recipe.
class TabledPoints {
 public:
  explicit TabledPoints(const protocol::PointTable& table) : table_(table) {}

  bool add(const std::vector<Interval>& points, Work& work) {
    for (const Interval& interval : points) {
      for (std::uint64_t point = interval.begin; point < interval.end; ++point) {
        if (!work.spend(kRunWork)) {
          return false;
        }
        const protocol::Point at = table_.point(point);
        const auto [same, is_new] = points_.emplace(
            key_of(model_of(table_, at.model, own_models_, work), at), Ends{point, point});
        if (!is_new) {
          next_[same->second.last] = point;
          same->second.last = point;
        }
      }
    }
    return true;
  }

  /// The lowest of the points that have another study's values.
  std::optional<std::uint64_t> find(const protocol::PointTable& other, const protocol::Point& at,
                                    Work& work) {
    const auto found = points_.find(key_of(model_of(other, at.model, other_models_, work), at));
    return found == points_.end() ? std::nullopt : std::optional(found->second.first);
  }
  /// Gives all of them, and never again.
  template <typename Give>
  void take_out(const protocol::PointTable& other, const protocol::Point& at, Work& work,
                const Give& give) {
    const auto found = points_.find(key_of(model_of(other, at.model, other_models_, work), at));
    if (found == points_.end()) {
      return;
    }
    std::optional<std::uint64_t> point = found->second.first;
    points_.erase(found);
    while (point && work.spend(1)) {
      give(*point);
      const auto next = next_.find(*point);
      point = next == next_.end() ? std::nullopt : std::optional(next->second);
    }
  }

 private:
  using Key = std::array<std::uint64_t, 4>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t hash = 0;
      for (const std::uint64_t part : key) {
        hash = (hash ^ part) * 0x9e3779b97f4a7c15U;
        hash ^= hash >> 29U;
      }
      return hash;
    }
  };
  using Models = std::unordered_map<std::uint64_t, std::uint64_t>;

  static Key key_of(std::uint64_t model, const protocol::Point& at) {
    return {model, std::bit_cast<std::uint64_t>(at.H_m), std::bit_cast<std::uint64_t>(at.mu),
            std::bit_cast<std::uint64_t>(at.e_star)};
  }

  /// One number for each text of a model.
  std::uint64_t model_of(const protocol::PointTable& table, std::uint64_t number, Models& known,
                         Work& work) {
    if (const auto found = known.find(number); found != known.end()) {
      return found->second;
    }
    work.spend(kModelWork);
    const std::string text = protocol::canonical_model(table.model(number));
    return known.emplace(number, texts_.emplace(text, texts_.size()).first->second).first->second;
  }

  const protocol::PointTable& table_;
  std::map<std::string, std::uint64_t> texts_;
  Models own_models_;
  Models other_models_;
  /// Points of the same values: the lowest and the highest.
  struct Ends {
    std::uint64_t first;
    std::uint64_t last;
  };
  std::unordered_map<Key, Ends, Hash> points_;
  std::unordered_map<std::uint64_t, std::uint64_t> next_;  // higher one of the same values
};

/// Unites runs that follow each other before they are given away.
class RunGatherer {
 public:
  RunGatherer(const Take& take, Work& work) : take_(take), work_(work) {}

  void add(std::uint64_t point, std::uint64_t source_point) {
    if (run_ && run_->point + run_->count == point &&
        run_->source_point + run_->count == source_point) {
      ++run_->count;
      return;
    }
    finish();
    run_ = SharedRun{point, source_point, 1};
  }
  void finish() {
    if (run_ && work_.spend(kRunWork)) {
      take_(*run_);
    }
    run_.reset();
  }

 private:
  const Take& take_;
  Work& work_;
  std::optional<SharedRun> run_;
};

/// Two blocks and which of their points count.
struct BlockPair {
  const PlacedBlock& target;
  const PlacedBlock& source;
  const IntervalSet& open;
  const IntervalSet& known;
  std::vector<Interval> open_here;
  std::vector<Interval> known_here;
  Work& work;
  const Take& take;

  /// Those of a run that count on both sides.
  void give(const SharedRun& run) const {
    for (const Interval& piece : open.within(run.point, run.point + run.count)) {
      const std::uint64_t from = run.source_point + (piece.begin - run.point);
      for (const Interval& there : known.within(from, from + (piece.end - piece.begin))) {
        if (!work.spend(kRunWork)) {
          return;
        }
        take({piece.begin + (there.begin - from), there.begin, there.end - there.begin});
      }
    }
  }

  /// Looks the points of one side up in the other, where `find` gives those that are the same.
  template <typename Find>
  void look_up(bool of_target, Find find) const {
    RunGatherer runs(take, work);
    const protocol::PointTable& table = of_target ? *target.table : *source.table;
    for (const Interval& interval : of_target ? open_here : known_here) {
      for (std::uint64_t point = interval.begin; point < interval.end && work.spend(1); ++point) {
        find(table, table.point(point), [&](std::uint64_t other) {
          if ((of_target ? known : open).contains(other)) {
            runs.add(of_target ? point : other, of_target ? other : point);
          }
        });
      }
    }
    runs.finish();
  }
};

void look_up_in_product(const BlockPair& pair, bool of_target) {
  ProductInverse inverse(of_target ? pair.source : pair.target);
  pair.look_up(of_target,
               [&](const protocol::PointTable& table, const protocol::Point& at, const auto& give) {
                 solver::ModelParameters model;
                 if (!inverse.knows_model(at.model)) {
                   pair.work.spend(kModelWork);
                   model = table.model(at.model);
                 }
                 if (const auto found = inverse.find(at.model, model, at.H_m, at.mu, at.e_star)) {
                   give(*found);
                 }
               });
}

void look_up_in_table(const BlockPair& pair) {
  // The smaller side is put into the table.
  const bool of_target = size_of(pair.open_here) >= size_of(pair.known_here);
  const auto& tabled = of_target ? pair.known_here : pair.open_here;
  if (size_of(tabled) > kMostTabled) {
    return;
  }
  TabledPoints points(of_target ? *pair.source.table : *pair.target.table);
  if (points.add(tabled, pair.work)) {
    // Of a value that the target has often each of its points is wanted; of one that the source has
    // often any will do.
    pair.look_up(of_target, [&](const protocol::PointTable& table, const protocol::Point& at,
                                const auto& give) {
      if (!of_target) {
        points.take_out(table, at, pair.work, give);
      } else if (const auto found = points.find(table, at, pair.work)) {
        give(*found);
      }
    });
  }
}

/// A sample whose points follow from their numbers alone is the same in both as far as both go.
bool is_same_sample(const PlacedBlock& target, const PlacedBlock& source) {
  if (!target.block->has_sample() || !source.block->has_sample()) {
    return false;
  }
  const auto text = [](const PlacedBlock& placed) {
    protocol::Recipe recipe;
    *recipe.mutable_model() = placed.table->recipe().model();
    protocol::Block& block = *recipe.add_blocks() = *placed.block;
    block.clear_where();
    if (block.sample().kind() != protocol::SAMPLE_LATIN_HYPERCUBE) {
      block.mutable_sample()->set_count(1);
    }
    return protocol::canonical_recipe(recipe);
  };
  return text(target) == text(source);
}

/// Whether all values of a sample are listed, so that later points may be those of earlier ones.
bool repeats_points(const protocol::Block& block) {
  return std::none_of(block.axes().begin(), block.axes().end(),
                      [](const protocol::Axis& axis) { return axis.has_distribution(); });
}

void match_blocks(const BlockPair& pair) {
  if (pair.open_here.empty() || pair.known_here.empty() || pair.work.is_over()) {
    return;
  }
  const bool target_is_product = is_product(*pair.target.block);
  const bool source_is_product = is_product(*pair.source.block);
  const std::uint64_t open = size_of(pair.open_here);
  const std::uint64_t known = size_of(pair.known_here);
  if (target_is_product && source_is_product) {
    const auto match = ProductMatch::of(pair.target, pair.source, pair.work);
    if (match && match->runs() <= std::min(open, known)) {
      match->each(pair.work, [&](const SharedRun& run) { pair.give(run); });
    } else {
      look_up_in_product(pair, open <= known);
    }
  } else if (is_same_sample(pair.target, pair.source)) {
    const std::uint64_t same = std::min(pair.target.points, pair.source.points);
    pair.give({pair.target.first_point, pair.source.first_point, same});
    if (repeats_points(*pair.target.block)) {
      look_up_in_table({pair.target, pair.source, pair.open, pair.known,
                        pair.open.within(pair.target.first_point + same, pair.target.end()),
                        pair.known_here, pair.work, pair.take});
    }
  } else if (source_is_product) {
    look_up_in_product(pair, true);
  } else if (target_is_product) {
    look_up_in_product(pair, false);
  } else {
    look_up_in_table(pair);
  }
}

}  // namespace

void match_recipes(const protocol::PointTable& target, const IntervalSet& open,
                   const protocol::PointTable& source, const IntervalSet& known, Work& work,
                   const Take& take) {
  if (target.wants_errors() != source.wants_errors()) {
    return;
  }
  const auto blocks = blocks_of(target);
  const auto source_blocks = blocks_of(source);
  for (const PlacedBlock& block : blocks) {
    const auto open_here = open.within(block.first_point, block.end());
    if (open_here.empty()) {
      continue;
    }
    for (const PlacedBlock& other : source_blocks) {
      if (!work.spend(1)) {
        return;
      }
      if (block.box.is_apart_from(other.box)) {
        continue;
      }
      work.spend(kPairWork);
      match_blocks({block, other, open, known, open_here,
                    known.within(other.first_point, other.end()), work, take});
    }
  }
}

}  // namespace oblique::server
