#include "client/explore/map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace oblique::client {
namespace {

/// How often cells are halved that a border enters, and that more than two borders enter.
constexpr std::uint32_t kHalvings = 2;
constexpr std::uint32_t kMaxHalvings = 4;

struct Position {
  double x;
  double y;
};

/// A square cell that is not halved (yet).
struct Cell {
  LatticePoint low;
  std::uint32_t size;

  std::array<LatticePoint, 4> corners() const {
    const auto [x, y] = low;
    return {{{x, y}, {x + size, y}, {x + size, y + size}, {x, y + size}}};
  }
};

/// A border that crosses the side of a cell.
struct Crossing {
  BorderVertex vertex;  ///< exact only if `width` is 1
  std::uint32_t width;  ///< of the bracket, in steps
  int after;            ///< region behind it, counterclockwise
  double way;           ///< from the lower left corner counterclockwise to it, in steps

  Position middle() const {
    const double half = width / 2.0;
    return {vertex.low.x + (vertex.is_along_x ? half : 0.0),
            vertex.low.y + (vertex.is_along_x ? 0.0 : half)};
  }
};

/// A border inside a cell, from crossing a to crossing b.
struct Chord {
  std::size_t a;
  std::size_t b;
  int region;  ///< to the right, except for what earlier chords cut off
  bool meets_others = false;
};

/// How borders run inside a cell.
struct Inside {
  std::vector<Crossing> crossings = {};  ///< counterclockwise
  std::vector<Chord> chords = {};
  int rest = 0;  ///< region of what no chord cuts off

  int region_at(const Position& at) const {
    for (const Chord& chord : chords) {
      const Position a = crossings[chord.a].middle();
      const Position b = crossings[chord.b].middle();
      if ((b.x - a.x) * (at.y - a.y) < (b.y - a.y) * (at.x - a.x)) {
        return chord.region;
      }
    }
    return rest;
  }
};

class BorderSearch {
 public:
  BorderSearch(const MapGrid& grid, const RegionsOf& regions_of)
      : grid_(grid), regions_of_(regions_of) {}

  void run();
  Borders borders() const;

 private:
  using Line = std::map<std::uint32_t, int>;  ///< regions of points by one coordinate

  void request(const LatticePoint& point) { requested_.push_back(point); }
  /// Solves the requested points.
  void solve();
  std::vector<Crossing> crossings_of(const Cell& cell) const;
  /// Bisects the sides of all cells, and halves cells. Returns false if there was nothing to do.
  bool refine();
  Inside inside_of(const Cell& cell) const;
  void fill(std::vector<int>& raster, const Cell& cell, const Inside& inside) const;

  MapGrid grid_;
  const RegionsOf& regions_of_;
  std::unordered_map<std::uint32_t, Line> rows_;     ///< by y
  std::unordered_map<std::uint32_t, Line> columns_;  ///< by x
  std::vector<Cell> cells_;
  std::vector<LatticePoint> requested_;
};

void BorderSearch::run() {
  for (std::uint32_t y = 0; y <= grid_.cells; ++y) {
    for (std::uint32_t x = 0; x <= grid_.cells; ++x) {
      request({x * grid_.cell(), y * grid_.cell()});
      if (x < grid_.cells && y < grid_.cells) {
        cells_.push_back({requested_.back(), grid_.cell()});
      }
    }
  }
  solve();
  while (refine()) {  // halving a cell may show borders on the sides of its neighbours
  }
}

void BorderSearch::solve() {
  const auto order = [](const LatticePoint& point) { return std::pair(point.y, point.x); };
  std::sort(requested_.begin(), requested_.end(),
            [&](const auto& a, const auto& b) { return order(a) < order(b); });
  requested_.erase(std::unique(requested_.begin(), requested_.end()), requested_.end());
  std::erase_if(requested_, [this](const LatticePoint& point) {
    const auto row = rows_.find(point.y);
    return row != rows_.end() && row->second.contains(point.x);
  });
  if (requested_.empty()) {
    return;
  }
  const auto regions = regions_of_(requested_);
  for (std::size_t i = 0; i < requested_.size(); ++i) {
    const auto& [x, y] = requested_[i];
    rows_[y].emplace(x, regions[i]);
    columns_[x].emplace(y, regions[i]);
  }
  requested_.clear();
}

std::vector<Crossing> BorderSearch::crossings_of(const Cell& cell) const {
  std::vector<Crossing> crossings;
  for (std::uint32_t side = 0; side < 4; ++side) {  // lower, right, upper, left
    const bool is_along_x = side % 2 == 0;
    const bool is_forward = side < 2;
    const std::uint32_t begin = is_along_x ? cell.low.x : cell.low.y;
    const std::uint32_t fixed =
        (is_along_x ? cell.low.y : cell.low.x) + (side == 1 || side == 2 ? cell.size : 0);
    const Line& line = (is_along_x ? rows_ : columns_).at(fixed);
    const auto of_side = static_cast<std::ptrdiff_t>(crossings.size());
    for (auto low = line.find(begin); low->first < begin + cell.size; ++low) {
      const auto high = std::next(low);
      if (low->second == high->second) {
        continue;
      }
      const double middle = (low->first - begin + high->first - begin) / 2.0;
      crossings.push_back(
          {{is_along_x ? LatticePoint{low->first, fixed} : LatticePoint{fixed, low->first},
            is_along_x, low->second, high->second},
           high->first - low->first,
           is_forward ? high->second : low->second,
           side * static_cast<double>(cell.size) + (is_forward ? middle : cell.size - middle)});
    }
    if (!is_forward) {
      std::reverse(crossings.begin() + of_side, crossings.end());
    }
  }
  return crossings;
}

bool BorderSearch::refine() {
  bool is_refined = false;
  auto active = std::exchange(cells_, {});
  while (!active.empty()) {
    std::vector<Cell> next;
    for (const Cell& cell : active) {
      const auto crossings = crossings_of(cell);
      bool is_open = false;
      for (const auto& [vertex, width, after, way] : crossings) {
        if (width > 1) {
          is_open = true;
          const std::uint32_t half = width / 2;
          request({vertex.low.x + (vertex.is_along_x ? half : 0),
                   vertex.low.y + (vertex.is_along_x ? 0 : half)});
        }
      }
      const bool is_simple = crossings.size() <= 2;
      if (!crossings.empty() &&
          cell.size > grid_.cell() >> (is_simple ? kHalvings : kMaxHalvings)) {
        for (const auto& corner : Cell{cell.low, cell.size / 2}.corners()) {
          next.push_back({corner, cell.size / 2});
          for (const auto& point : next.back().corners()) {
            request(point);
          }
        }
      } else {
        (is_open ? next : cells_).push_back(cell);
      }
    }
    is_refined = is_refined || !next.empty();
    solve();
    active = std::move(next);
  }
  return is_refined;
}

/// Marching squares for any number of regions: the shortest part of the rim whose neighbours are in
/// one region is cut off by a chord, again and again. The borders of three regions or more that
/// are left meet in a crossing, that behind the shortest part, so that slivers keep their sides.
Inside BorderSearch::inside_of(const Cell& cell) const {
  Inside inside{.crossings = crossings_of(cell)};
  const auto& crossings = inside.crossings;
  std::vector<std::size_t> open(crossings.size());
  for (std::size_t i = 0; i < open.size(); ++i) {
    open[i] = i;
  }
  const auto length = [&](std::size_t i) {
    const double way = crossings[open[(i + 1) % open.size()]].way - crossings[open[i]].way;
    return way < 0.0 ? way + 4.0 * cell.size : way;
  };
  inside.rest = open.empty() ? rows_.at(cell.low.y).at(cell.low.x) : crossings.back().after;
  while (!open.empty()) {
    const std::size_t n = open.size();
    std::size_t shortest = n;
    for (std::size_t i = 0; i < n; ++i) {
      if (crossings[open[(i + n - 1) % n]].after == crossings[open[(i + 1) % n]].after &&
          (shortest == n || length(i) < length(shortest))) {
        shortest = i;
      }
    }
    if (shortest == n) {
      std::size_t least = 0;
      for (std::size_t i = 1; i < n; ++i) {
        least = length(i) < length(least) ? i : least;
      }
      std::rotate(open.begin(), open.begin() + static_cast<std::ptrdiff_t>((least + 2) % n),
                  open.end());
      for (std::size_t i = 1; i < n; ++i) {
        inside.chords.push_back({open[0], open[i], crossings[open[i - 1]].after, true});
      }
      inside.rest = crossings[open[n - 1]].after;
      break;
    }
    const std::size_t a = open[shortest];
    const std::size_t b = open[(shortest + 1) % n];
    inside.chords.push_back({a, b, crossings[a].after});
    inside.rest = crossings[b].after;
    std::erase_if(open, [&](std::size_t each) { return each == a || each == b; });
  }
  return inside;
}

void BorderSearch::fill(std::vector<int>& raster, const Cell& cell, const Inside& inside) const {
  const double step = static_cast<double>(grid_.last()) / Borders::kRaster;
  const auto first_behind = [step](std::uint32_t place) {
    return static_cast<std::size_t>(std::ceil(place / step - 0.5));
  };
  for (auto y = first_behind(cell.low.y); y < first_behind(cell.low.y + cell.size); ++y) {
    for (auto x = first_behind(cell.low.x); x < first_behind(cell.low.x + cell.size); ++x) {
      raster[y * Borders::kRaster + x] = inside.region_at(
          {(static_cast<double>(x) + 0.5) * step, (static_cast<double>(y) + 0.5) * step});
    }
  }
}

/// Vertices and the chords between them.
struct BorderGraph {
  std::vector<std::vector<std::size_t>> neighbours = {};
  std::set<std::size_t> corners = {};  ///< where curves meet

  void join(std::size_t a, std::size_t b) {
    neighbours[a].push_back(b);
    neighbours[b].push_back(a);
  }
  /// Follows chords to the end of their curve, and removes them.
  std::vector<std::size_t> taken_curve(std::size_t vertex) {
    std::vector<std::size_t> curve{vertex};
    do {
      const std::size_t next = neighbours[vertex].front();
      neighbours[vertex].erase(neighbours[vertex].begin());
      auto& back = neighbours[next];
      back.erase(std::find(back.begin(), back.end(), vertex));
      curve.push_back(next);
      vertex = next;
    } while (!corners.contains(vertex) && !neighbours[vertex].empty());
    return curve;
  }
  std::vector<std::vector<std::size_t>> taken_curves() {
    std::vector<std::vector<std::size_t>> curves;
    for (const bool is_closed : {false, true}) {  // open curves first, from an end
      for (std::size_t vertex = 0; vertex < neighbours.size(); ++vertex) {
        while (!neighbours[vertex].empty() &&
               (is_closed || neighbours[vertex].size() == 1 || corners.contains(vertex))) {
          curves.push_back(taken_curve(vertex));
        }
      }
    }
    return curves;
  }
};

Borders BorderSearch::borders() const {
  Borders borders;
  borders.raster.resize(std::size_t{Borders::kRaster} * Borders::kRaster);
  BorderGraph graph;
  std::map<std::tuple<bool, std::uint32_t, std::uint32_t>, std::size_t> numbers;
  const auto number_of = [&](const BorderVertex& vertex) {
    const auto [place, is_new] = numbers.try_emplace(
        {vertex.is_along_x, vertex.low.x, vertex.low.y}, borders.vertices.size());
    if (is_new) {
      borders.vertices.push_back(vertex);
      graph.neighbours.emplace_back();
    }
    return place->second;
  };
  for (const Cell& cell : cells_) {
    const Inside inside = inside_of(cell);
    fill(borders.raster, cell, inside);
    for (const Chord& chord : inside.chords) {
      const auto a = number_of(inside.crossings[chord.a].vertex);
      graph.join(a, number_of(inside.crossings[chord.b].vertex));
      if (chord.meets_others) {
        graph.corners.insert(a);
      }
    }
  }
  borders.curves = graph.taken_curves();
  return borders;
}

// ---- Shifts ----

struct Sample {
  BorderVertex vertex;
  std::size_t curve;
  std::uint32_t low = 0;
  std::uint32_t high = 0;  ///< the border is between; both 0: not found

  std::uint32_t place() const { return vertex.is_along_x ? vertex.low.x : vertex.low.y; }
  LatticePoint at(std::uint32_t along) const {
    return vertex.is_along_x ? LatticePoint{along, vertex.low.y}
                             : LatticePoint{vertex.low.x, along};
  }
  std::uint32_t middle() const { return low + (high - low) / 2; }
  double shift() const { return std::abs((low + (high - 1.0)) / 2.0 - place()); }
};

/// Places around a vertex, ever further from it.
std::vector<std::uint32_t> places_around(const Sample& sample, const MapGrid& grid) {
  std::set<std::uint32_t> places{sample.place(), sample.place() + 1};
  for (std::uint32_t parts = 8; parts <= 8192; parts *= 4) {
    const std::uint32_t reach = std::min(grid.last() / parts, grid.last() - sample.place());
    places.insert(sample.place() + reach);
    places.insert(sample.place() - std::min(grid.last() / parts, sample.place()));
  }
  return {places.begin(), places.end()};
}

/// Brackets the nearest borders of the same regions, where there are some.
void find_brackets(std::vector<Sample>& samples, const MapGrid& grid, const RegionsOf& regions_of) {
  std::vector<LatticePoint> points;
  for (const Sample& sample : samples) {
    for (const auto place : places_around(sample, grid)) {
      points.push_back(sample.at(place));
    }
  }
  const auto regions = regions_of(points);
  std::size_t first = 0;
  for (Sample& sample : samples) {
    const auto places = places_around(sample, grid);
    for (std::size_t i = 1; i < places.size(); ++i) {
      Sample found = sample;
      found.low = places[i - 1];
      found.high = places[i];
      if (regions[first + i - 1] == sample.vertex.from && regions[first + i] == sample.vertex.to &&
          (sample.high == 0 || found.shift() < sample.shift())) {
        sample = found;
      }
    }
    first += places.size();
  }
}

/// Halves the brackets. Returns false if all are one step wide.
bool bisect(std::vector<Sample>& samples, const RegionsOf& regions_of) {
  std::vector<Sample*> open;
  std::vector<LatticePoint> points;
  for (Sample& sample : samples) {
    if (sample.high > sample.low + 1) {
      open.push_back(&sample);
      points.push_back(sample.at(sample.middle()));
    }
  }
  if (open.empty()) {
    return false;
  }
  const auto regions = regions_of(points);
  for (std::size_t i = 0; i < open.size(); ++i) {
    const auto middle = open[i]->middle();
    (regions[i] == open[i]->vertex.from ? open[i]->low : open[i]->high) = middle;
  }
  return true;
}

}  // namespace

MapGrid MapGrid::of(std::uint32_t cells, double bracket) {
  MapGrid grid{.cells = cells, .halvings = kMaxHalvings};
  while (1.0 / grid.last() > bracket) {
    ++grid.halvings;
  }
  return grid;
}

Borders find_borders(const MapGrid& grid, const RegionsOf& regions_of) {
  BorderSearch search(grid, regions_of);
  search.run();
  return search.borders();
}

std::vector<CurveShift> find_shifts(const MapGrid& grid, const Borders& borders, std::size_t every,
                                    const RegionsOf& regions_of) {
  std::vector<Sample> samples;
  for (std::size_t curve = 0; curve < borders.curves.size(); ++curve) {
    const auto& vertices = borders.curves[curve];
    for (std::size_t i = std::min(every, vertices.size()) / 2; i < vertices.size(); i += every) {
      samples.push_back({borders.vertices[vertices[i]], curve});
    }
  }
  if (!samples.empty()) {
    find_brackets(samples, grid, regions_of);
  }
  while (bisect(samples, regions_of)) {
  }
  std::vector<std::vector<double>> found(borders.curves.size());
  std::vector<CurveShift> shifts(borders.curves.size());
  for (const Sample& sample : samples) {
    ++shifts[sample.curve].checked;
    if (sample.high == 0) {
      ++shifts[sample.curve].lost;
    } else {
      found[sample.curve].push_back(sample.shift() / grid.last());
    }
  }
  for (std::size_t i = 0; i < shifts.size(); ++i) {
    if (!found[i].empty()) {
      std::sort(found[i].begin(), found[i].end());
      shifts[i].median = found[i][found[i].size() / 2];
      shifts[i].largest = found[i].back();
    }
  }
  return shifts;
}

}  // namespace oblique::client
