#include "client/explore/map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <unordered_map>
#include <utility>

namespace oblique::client {
namespace {

/// A cell may be halved kHalvings times if its rim has two crossings, kMaxHalvings times if more.
constexpr std::uint32_t kHalvings = 2;
constexpr std::uint32_t kMaxHalvings = 4;

struct Position {
  double x;
  double y;
};

LatticePoint middle_of(const LatticePoint& a, const LatticePoint& b) {
  return {(a.x + b.x) / 2, (a.y + b.y) / 2};
}

/// Returns a number that sorts points by y, then by x.
std::uint64_t key_of(const LatticePoint& point) {
  return std::uint64_t{point.y} << 32U | point.x;
}

/// A square cell. Halving replaces it by four.
struct Cell {
  LatticePoint low;
  std::uint32_t size;

  /// Counterclockwise from `low`.
  std::array<LatticePoint, 4> corners() const {
    const auto [x, y] = low;
    return {{{x, y}, {x + size, y}, {x + size, y + size}, {x, y + size}}};
  }
};

/// A place where a border crosses the rim of a cell. It lies between a and b (its bracket); b
/// follows a counterclockwise.
struct Crossing {
  LatticePoint a;
  LatticePoint b;
  int before;           ///< region at a
  int after;            ///< region at b
  std::uint32_t width;  ///< distance from a to b, in steps of the lattice
  double way;           ///< way along the rim from the lower left corner to the middle, in steps

  Position middle() const { return {(a.x + b.x) / 2.0, (a.y + b.y) / 2.0}; }
  BorderVertex vertex() const {
    const bool is_forward = a.x < b.x || a.y < b.y;
    return {is_forward ? a : b, a.y == b.y, is_forward ? before : after,
            is_forward ? after : before};
  }
};

/// A border inside a cell, from crossing a to crossing b.
struct Chord {
  Crossing a;
  Crossing b;
  int region;  ///< region right of the chord, except for parts that earlier chords cut off
  bool meets_others = false;
};

/// The borders inside a cell.
struct Inside {
  std::vector<Chord> chords = {};
  int rest = 0;  ///< region of the part that no chord cuts off

  int region_at(const Position& at) const {
    for (const Chord& chord : chords) {
      const Position a = chord.a.middle();
      const Position b = chord.b.middle();
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

  void run() {
    for (std::uint32_t y = 0; y < grid_.cells; ++y) {
      for (std::uint32_t x = 0; x < grid_.cells; ++x) {
        add_cell(cells_, {x * grid_.cell(), y * grid_.cell()}, grid_.cell());
      }
    }
    solve();
    // Points that are solved for a cell can show borders on the rims of its neighbours. Therefore
    // all cells are refined again until no cell changes.
    for (bool is_refined = true; is_refined;) {
      is_refined = false;
      for (auto active = std::exchange(cells_, {}); !active.empty();) {
        std::vector<Cell> next;
        for (const Cell& cell : active) {
          refine(cell, next);
        }
        is_refined = is_refined || !next.empty();
        solve();
        active = std::move(next);
      }
    }
  }
  Borders borders() const;

 private:
  void request(const LatticePoint& point) {
    if (!regions_.contains(key_of(point))) {
      requested_.insert(key_of(point));
    }
  }
  /// Solves the requested points.
  void solve() {
    if (requested_.empty()) {
      return;
    }
    std::vector<LatticePoint> points;
    for (const std::uint64_t key : requested_) {
      points.push_back({static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(key >> 32U)});
    }
    const auto regions = regions_of_(points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      regions_[key_of(points[i])] = regions[i];
    }
    requested_.clear();
  }
  /// Appends a cell, and requests its corners.
  void add_cell(std::vector<Cell>& cells, const LatticePoint& low, std::uint32_t size) {
    cells.push_back({low, size});
    for (const LatticePoint& corner : cells.back().corners()) {
      request(corner);
    }
  }
  /// Requests the middles of wide brackets. Halves the cell if its borders need smaller cells.
  /// Appends the cell, or its quarters, to `next` if it may change further, else to `cells_`.
  void refine(const Cell& cell, std::vector<Cell>& next) {
    const auto crossings = crossings_of(cell);
    bool is_open = false;
    for (const Crossing& crossing : crossings) {
      if (crossing.width > 1) {
        is_open = true;
        request(middle_of(crossing.a, crossing.b));
      }
    }
    const std::uint32_t halvings = crossings.size() <= 2 ? kHalvings : kMaxHalvings;
    if (crossings.empty() || cell.size <= grid_.cell() >> halvings) {
      (is_open ? next : cells_).push_back(cell);
      return;
    }
    for (const LatticePoint& low : Cell{cell.low, cell.size / 2}.corners()) {
      add_cell(next, low, cell.size / 2);
    }
  }

  /// Appends the crossings from a to b, two solved points. `way` is the place of a along the rim.
  void walk(const LatticePoint& a, const LatticePoint& b, std::uint32_t width, double way,
            std::vector<Crossing>& crossings) const {
    const LatticePoint middle = middle_of(a, b);
    const std::uint32_t half = width / 2;
    if (half > 0 && regions_.contains(key_of(middle))) {
      walk(a, middle, half, way, crossings);
      walk(middle, b, half, way + half, crossings);
      return;
    }
    const int before = regions_.at(key_of(a));
    const int after = regions_.at(key_of(b));
    if (before != after) {
      crossings.push_back({a, b, before, after, width, way + width / 2.0});
    }
  }
  /// The crossings of the rim, counterclockwise from the lower left corner.
  std::vector<Crossing> crossings_of(const Cell& cell) const {
    std::vector<Crossing> crossings;
    const auto corners = cell.corners();
    for (std::size_t i = 0; i < 4; ++i) {
      walk(corners[i], corners[(i + 1) % 4], cell.size, static_cast<double>(i) * cell.size,
           crossings);
    }
    return crossings;
  }
  Inside inside_of(const Cell& cell) const;
  void fill(std::vector<int>& raster, const Cell& cell, const Inside& inside) const;

  MapGrid grid_;
  const RegionsOf& regions_of_;
  std::vector<Cell> cells_;
  std::unordered_map<std::uint64_t, int> regions_;  ///< region of each solved point, by key_of
  std::set<std::uint64_t> requested_;               ///< keys of points
};

/// Marching squares for any number of regions. The crossings divide the rim into parts. While a
/// part has two neighbours of the same region, a chord cuts off the shortest such part. At the end
/// no crossing or at least three remain. In the latter case chords join one crossing to all others.
/// This crossing is not an end of the shortest part, so that a sliver keeps both sides.
Inside BorderSearch::inside_of(const Cell& cell) const {
  auto open = crossings_of(cell);
  Inside inside{.rest = open.empty() ? regions_.at(key_of(cell.low)) : open.back().after};
  while (!open.empty()) {
    const std::size_t n = open.size();
    // Part after crossing i: whether the regions before and after it differ, and its length.
    std::vector<std::pair<bool, double>> parts;
    for (std::size_t i = 0; i < n; ++i) {
      const Crossing& end = open[(i + 1) % n];
      const double way = end.way - open[i].way;
      parts.emplace_back(open[i].before != end.after, way < 0.0 ? way + 4.0 * cell.size : way);
    }
    const auto shortest = std::min_element(parts.begin(), parts.end());
    const auto a = static_cast<std::size_t>(shortest - parts.begin());
    if (shortest->first) {
      std::rotate(open.begin(), open.begin() + static_cast<std::ptrdiff_t>((a + 2) % n),
                  open.end());
      for (std::size_t i = 1; i < n; ++i) {
        inside.chords.push_back({open[0], open[i], open[i].before, true});
      }
      inside.rest = open[n - 1].after;
      break;
    }
    const Chord chord{open[a], open[(a + 1) % n], open[a].after};
    inside.chords.push_back(chord);
    inside.rest = chord.b.after;
    std::erase_if(open, [&](const Crossing& each) {
      return each.way == chord.a.way || each.way == chord.b.way;
    });
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

/// Joins chords to curves. A curve ends at a corner, or where no chord continues it.
/// `neighbours[i]` are the vertices that chords join to vertex i.
std::vector<std::vector<std::size_t>> curves_of(std::vector<std::vector<std::size_t>> neighbours,
                                                const std::set<std::size_t>& corners) {
  std::vector<std::vector<std::size_t>> curves;
  for (const bool is_closed : {false, true}) {  // open curves first, from an end
    for (std::size_t start = 0; start < neighbours.size(); ++start) {
      while (!neighbours[start].empty() &&
             (is_closed || neighbours[start].size() == 1 || corners.contains(start))) {
        auto& curve = curves.emplace_back(1, start);
        do {
          const std::size_t vertex = curve.back();
          const std::size_t next = neighbours[vertex].front();
          neighbours[vertex].erase(neighbours[vertex].begin());
          auto& back = neighbours[next];
          back.erase(std::find(back.begin(), back.end(), vertex));
          curve.push_back(next);
        } while (!corners.contains(curve.back()) && !neighbours[curve.back()].empty());
      }
    }
  }
  return curves;
}

Borders BorderSearch::borders() const {
  Borders borders;
  borders.raster.resize(std::size_t{Borders::kRaster} * Borders::kRaster);
  std::vector<std::vector<std::size_t>> neighbours;
  std::set<std::size_t> corners;
  std::map<std::pair<bool, std::uint64_t>, std::size_t> numbers;
  const auto number_of = [&](const BorderVertex& vertex) {
    const auto [number, is_new] =
        numbers.try_emplace({vertex.is_along_x, key_of(vertex.low)}, borders.vertices.size());
    if (is_new) {
      borders.vertices.push_back(vertex);
      neighbours.emplace_back();
    }
    return number->second;
  };
  for (const Cell& cell : cells_) {
    const Inside inside = inside_of(cell);
    fill(borders.raster, cell, inside);
    for (const Chord& chord : inside.chords) {
      const auto a = number_of(chord.a.vertex());
      const auto b = number_of(chord.b.vertex());
      neighbours[a].push_back(b);
      neighbours[b].push_back(a);
      if (chord.meets_others) {
        corners.insert(a);
      }
    }
  }
  borders.curves = curves_of(std::move(neighbours), corners);
  return borders;
}

// ---- Shifts ----

/// A vertex, and the search for the border near it in another solution.
struct Sample {
  BorderVertex vertex;
  std::size_t curve;
  std::vector<std::uint32_t> places = {};  ///< requested places along the axis of the bracket
  std::uint32_t low = 0;
  std::uint32_t high = 0;  ///< the border is between low and high; both are 0 if not found

  LatticePoint point_at(std::uint32_t place) const {
    return vertex.is_along_x ? LatticePoint{place, vertex.low.y}
                             : LatticePoint{vertex.low.x, place};
  }
  /// Distance of a bracket from the bracket of the vertex, in steps.
  double shift_of(std::uint32_t from, std::uint32_t to) const {
    return std::abs((from + (to - 1.0)) / 2.0 - vertex.place());
  }

  /// Requests the ends of the vertex's bracket, and places at increasing distances from it.
  void look_around(const MapGrid& grid) {
    const std::uint32_t place = vertex.place();
    std::set<std::uint32_t> around{place, place + 1};
    for (std::uint32_t parts = 8; parts <= 8192; parts *= 4) {
      const std::uint32_t reach = grid.last() / parts;
      around.insert({std::min(place + reach, grid.last()), place - std::min(reach, place)});
    }
    places.assign(around.begin(), around.end());
  }
  /// Narrows the bracket and requests its middle. The first call chooses the bracket around the
  /// nearest border between the vertex's two regions.
  void narrow(std::span<const int> regions_of_places) {
    if (places.size() == 1) {
      (regions_of_places[0] == vertex.from ? low : high) = places[0];
    }
    for (std::size_t i = 1; i < places.size(); ++i) {
      if (regions_of_places[i - 1] == vertex.from && regions_of_places[i] == vertex.to &&
          (high == 0 || shift_of(places[i - 1], places[i]) < shift_of(low, high))) {
        low = places[i - 1];
        high = places[i];
      }
    }
    places.clear();
    if (high > low + 1) {
      places.push_back(low + (high - low) / 2);
    }
  }
};

/// Solves the requested places of the samples and narrows their brackets, until no place is
/// requested.
void find_brackets(std::vector<Sample>& samples, const RegionsOf& regions_of) {
  while (true) {
    std::vector<LatticePoint> points;
    for (const Sample& sample : samples) {
      for (const std::uint32_t place : sample.places) {
        points.push_back(sample.point_at(place));
      }
    }
    if (points.empty()) {
      return;
    }
    const auto regions = regions_of(points);
    std::span<const int> rest = regions;
    for (Sample& sample : samples) {
      const std::size_t count = sample.places.size();
      sample.narrow(rest.first(count));
      rest = rest.subspan(count);
    }
  }
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
      samples.back().look_around(grid);
    }
  }
  find_brackets(samples, regions_of);
  std::vector<CurveShift> shifts(borders.curves.size());
  std::vector<std::vector<double>> found(shifts.size());
  for (const Sample& sample : samples) {
    ++shifts[sample.curve].checked;
    if (sample.high == 0) {
      ++shifts[sample.curve].lost;
    } else {
      found[sample.curve].push_back(sample.shift_of(sample.low, sample.high) / grid.last());
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
