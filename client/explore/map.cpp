#include "client/explore/map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>
#include <utility>

namespace oblique::client {
namespace {

/// How often cells are halved: where a side has several borders or a chord is far from its border,
/// and where borders meet.
constexpr std::uint32_t kSideHalvings = 3;
constexpr std::uint32_t kCornerHalvings = 6;

/// A border is to be closer to the middle of its chord than this part of its cell.
constexpr double kChordTolerance = 1.0 / 128;

std::uint64_t key_of(const LatticePoint& point) {
  return (std::uint64_t{point.y} << 32U) | point.x;
}

Position position_of(const LatticePoint& point) {
  return {static_cast<double>(point.x), static_cast<double>(point.y)};
}

double distance(const Position& a, const Position& b) {
  return std::hypot(b.x - a.x, b.y - a.y);
}

double length_of(const std::vector<Position>& path) {
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    length += distance(path[i - 1], path[i]);
  }
  return length;
}

/// By the shoelace formula.
double area_of(const std::vector<Position>& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto& a = polygon[i];
    const auto& b = polygon[(i + 1) % polygon.size()];
    twice += a.x * b.y - b.x * a.y;
  }
  return std::abs(twice) / 2.0;
}

/// Whether a ray to the right crosses the polygon's sides an odd number of times.
bool is_inside(const std::vector<Position>& polygon, const Position& at) {
  bool is_odd = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto& a = polygon[i];
    const auto& b = polygon[(i + 1) % polygon.size()];
    if ((a.y > at.y) != (b.y > at.y) && at.x < a.x + (at.y - a.y) / (b.y - a.y) * (b.x - a.x)) {
      is_odd = !is_odd;
    }
  }
  return is_odd;
}

}  // namespace

Position BorderVertex::middle() const {
  const Position at = position_of(low);
  return is_along_x ? Position{at.x + 0.5, at.y} : Position{at.x, at.y + 0.5};
}

MapGrid MapGrid::of(std::uint32_t cells, double bracket) {
  MapGrid grid{.cells = cells, .halvings = kCornerHalvings};
  while (1.0 / grid.last() > bracket) {
    ++grid.halvings;
  }
  return grid;
}

// ---- The search ----

BorderSearch::BorderSearch(const MapGrid& grid) : grid_(grid) {
  for (std::uint32_t y = 0; y < grid.cells; ++y) {
    for (std::uint32_t x = 0; x < grid.cells; ++x) {
      leaves_.emplace(key_of({x * grid.cell(), y * grid.cell()}), grid.cell());
    }
  }
}

const int* BorderSearch::find(const LatticePoint& point) const {
  const auto row = rows_.find(point.y);
  if (row == rows_.end()) {
    return nullptr;
  }
  const auto found = row->second.find(point.x);
  return found == row->second.end() ? nullptr : &found->second;
}

void BorderSearch::request(const LatticePoint& point) {
  if (find(point) == nullptr && is_requested_.insert(key_of(point)).second) {
    requested_.push_back(point);
  }
}

std::array<LatticePoint, 4> BorderSearch::corners_of(const Leaf& leaf) const {
  const auto [x, y] = leaf.low;
  const auto size = leaf.size;
  return {{{x, y}, {x + size, y}, {x + size, y + size}, {x, y + size}}};
}

void BorderSearch::split(const Leaf& leaf) {
  const std::uint32_t half = leaf.size / 2;
  leaves_.erase(key_of(leaf.low));
  probed_.erase(key_of(leaf.low));
  for (const std::uint32_t dy : {0U, half}) {
    for (const std::uint32_t dx : {0U, half}) {
      const Leaf child{{leaf.low.x + dx, leaf.low.y + dy}, half};
      leaves_.emplace(key_of(child.low), half);
      for (const auto& corner : corners_of(child)) {
        request(corner);
      }
    }
  }
  is_any_split_ = true;
}

BorderSearch::Sides BorderSearch::sides_of(const Leaf& leaf) const {
  Sides sides;
  const auto corners = corners_of(leaf);
  for (std::size_t side = 0; side < sides.size(); ++side) {
    const bool is_along_x = side % 2 == 0;
    const bool is_forward = side < 2;
    const auto& from = corners[side];
    const std::uint32_t fixed = is_along_x ? from.y : from.x;
    const std::uint32_t begin = is_along_x ? leaf.low.x : leaf.low.y;
    const Line& line = is_along_x ? rows_.at(fixed) : columns_.at(fixed);
    for (auto low = line.find(begin); low->first < begin + leaf.size; ++low) {
      const auto high = std::next(low);
      if (low->second == high->second) {
        continue;
      }
      const BorderVertex vertex{
          is_along_x ? LatticePoint{low->first, fixed} : LatticePoint{fixed, low->first},
          is_along_x, low->second, high->second};
      sides[side].push_back({vertex, high->first - low->first, vertex.middle(),
                             is_forward ? high->second : low->second});
    }
    if (!is_forward) {
      std::reverse(sides[side].begin(), sides[side].end());
    }
  }
  return sides;
}

bool BorderSearch::is_complex(const Leaf& leaf, const Sides& sides) const {
  std::size_t count = 0;
  std::set<int> regions;
  for (const auto& side : sides) {
    count += side.size();
    for (const auto& crossing : side) {
      regions.insert(crossing.after);
    }
  }
  const bool is_corner = count == 3 && regions.size() == 3;
  return (count > 2 && leaf.size > grid_.cell() >> kSideHalvings) ||
         (is_corner && leaf.size > grid_.cell() >> kCornerHalvings);
}

bool BorderSearch::refine(const Leaf& leaf) {
  const auto sides = sides_of(leaf);
  bool is_mixed = false;
  for (const auto& side : sides) {
    for (const auto& crossing : side) {
      is_mixed = true;
      if (crossing.width > 1) {
        open_brackets_.push_back(crossing);
      }
    }
  }
  if (must_split_.erase(key_of(leaf.low)) > 0 || is_complex(leaf, sides)) {
    split(leaf);
    return false;
  }
  return is_mixed;
}

void BorderSearch::refine_all() {
  const std::vector<Leaf> candidates =
      std::exchange(is_any_split_, false) ? sorted_leaves() : std::exchange(mixed_, {});
  mixed_.clear();
  for (const Leaf& leaf : candidates) {
    if (refine(leaf)) {
      mixed_.push_back(leaf);
    }
  }
}

void BorderSearch::request_sections() {
  // A round costs as much as some hundred points: few brackets are divided into more parts.
  constexpr std::size_t kPointsWorthARound = 1000;
  constexpr std::uint32_t kMostParts = 16;
  std::uint32_t parts = 2;
  while (parts < kMostParts && open_brackets_.size() * (2 * parts - 1) < kPointsWorthARound) {
    parts *= 2;
  }
  for (const auto& bracket : open_brackets_) {
    const std::uint32_t own_parts = std::min(parts, bracket.width);
    for (std::uint32_t part = 1; part < own_parts; ++part) {
      LatticePoint point = bracket.vertex.low;
      (bracket.vertex.is_along_x ? point.x : point.y) +=
          static_cast<std::uint32_t>(std::uint64_t{bracket.width} * part / own_parts);
      request(point);
    }
  }
  open_brackets_.clear();
}

void BorderSearch::request_probes() {
  for (const Leaf& leaf : mixed_) {
    if (leaf.size <= grid_.cell() >> kSideHalvings || !probed_.insert(key_of(leaf.low)).second) {
      continue;
    }
    const Inside inside = inside_of(leaf);
    for (const auto& [a, b] : inside.chords) {
      const Position from = inside.crossings[a].at;
      const Position to = inside.crossings[b].at;
      const double step = kChordTolerance * leaf.size / distance(from, to);
      for (const double sign : {-1.0, 1.0}) {
        const Position at{(from.x + to.x) / 2 - sign * step * (to.y - from.y),
                          (from.y + to.y) / 2 + sign * step * (to.x - from.x)};
        const auto size = static_cast<double>(leaf.size);
        const auto low = position_of(leaf.low);
        if (at.x > low.x && at.y > low.y && at.x < low.x + size && at.y < low.y + size) {
          const LatticePoint point{static_cast<std::uint32_t>(std::lround(at.x)),
                                   static_cast<std::uint32_t>(std::lround(at.y))};
          probes_.push_back({leaf, point, region_in(inside, position_of(point))});
          requested_.push_back(point);
        }
      }
    }
  }
}

std::vector<LatticePoint> BorderSearch::next() {
  requested_.clear();
  is_requested_.clear();
  if (rows_.empty()) {
    for (std::uint32_t y = 0; y <= grid_.cells; ++y) {
      for (std::uint32_t x = 0; x <= grid_.cells; ++x) {
        requested_.push_back({x * grid_.cell(), y * grid_.cell()});
      }
    }
    return requested_;
  }
  do {  // a split whose corners are all known needs no point
    refine_all();
    request_sections();
  } while (requested_.empty() && is_any_split_);
  if (requested_.empty()) {
    request_probes();
  }
  return requested_;
}

void BorderSearch::set_regions(const std::vector<int>& regions) {
  if (!probes_.empty()) {
    for (std::size_t i = 0; i < probes_.size(); ++i) {
      if (regions[i] != probes_[i].expected) {
        must_split_.insert(key_of(probes_[i].leaf.low));
      }
    }
    probes_.clear();
    return;
  }
  for (std::size_t i = 0; i < requested_.size(); ++i) {
    const auto& point = requested_[i];
    rows_[point.y].emplace(point.x, regions[i]);
    columns_[point.x].emplace(point.y, regions[i]);
  }
}

// ---- Borders inside a leaf ----

std::vector<BorderSearch::Arc> BorderSearch::arcs_of(const Leaf& leaf, const Sides& sides) const {
  const auto corners = corners_of(leaf);
  std::vector<Arc> arcs;
  std::vector<Position> before_first;
  std::size_t number = 0;
  for (std::size_t side = 0; side < sides.size(); ++side) {
    auto& path = arcs.empty() ? before_first : arcs.back().path;
    path.push_back(position_of(corners[side]));
    for (const auto& crossing : sides[side]) {
      if (!arcs.empty()) {
        arcs.back().path.push_back(crossing.at);
        arcs.back().last = number;
      } else {
        before_first.push_back(crossing.at);
      }
      arcs.push_back({{crossing.at}, number, 0, crossing.after, 0.0});
      ++number;
    }
  }
  if (!arcs.empty()) {
    arcs.back().path.insert(arcs.back().path.end(), before_first.begin(), before_first.end());
  }
  for (auto& arc : arcs) {
    arc.length = length_of(arc.path);
  }
  return arcs;
}

BorderSearch::Inside BorderSearch::inside_of(const Leaf& leaf) const {
  Inside inside;
  const Sides sides = sides_of(leaf);
  for (const auto& side : sides) {
    inside.crossings.insert(inside.crossings.end(), side.begin(), side.end());
  }
  auto arcs = arcs_of(leaf, sides);
  if (arcs.empty()) {
    inside.rest = *find(leaf.low);
    return inside;
  }
  while (arcs.size() > 1) {
    // The shortest arc with the same region before and after it.
    const std::size_t n = arcs.size();
    std::size_t shortest = n;
    for (std::size_t i = 0; i < n; ++i) {
      if (arcs[(i + n - 1) % n].region == arcs[(i + 1) % n].region &&
          (shortest == n || arcs[i].length < arcs[shortest].length)) {
        shortest = i;
      }
    }
    if (shortest == n) {
      break;
    }
    const Arc arc = arcs[shortest];
    inside.chords.push_back({arc.first, arc.last});
    inside.pieces.push_back({arc.path, arc.region});
    Arc& before = arcs[(shortest + n - 1) % n];
    const Arc& behind = arcs[(shortest + 1) % n];
    if (n > 2) {
      before.path.insert(before.path.end(), behind.path.begin(), behind.path.end());
      before.length += arc.length + behind.length;
      before.last = behind.last;
      arcs.erase(arcs.begin() + static_cast<std::ptrdiff_t>((shortest + 1) % n));
    }
    const auto place = std::find_if(arcs.begin(), arcs.end(), [&arc](const Arc& each) {
      return each.first == arc.first && each.last == arc.last && each.region == arc.region;
    });
    arcs.erase(place);
  }
  inside.rest = arcs.front().region;
  if (arcs.size() > 1) {
    inside.has_corner = true;
    for (const auto& arc : arcs) {
      inside.corner.x += inside.crossings[arc.first].at.x / static_cast<double>(arcs.size());
      inside.corner.y += inside.crossings[arc.first].at.y / static_cast<double>(arcs.size());
    }
    for (auto& arc : arcs) {
      inside.meeting.push_back(arc.first);
      arc.path.push_back(inside.corner);
      inside.pieces.push_back({std::move(arc.path), arc.region});
    }
  }
  return inside;
}

int BorderSearch::region_in(const Inside& inside, const Position& at) {
  for (const auto& piece : inside.pieces) {
    if (is_inside(piece.polygon, at)) {
      return piece.region;
    }
  }
  return inside.rest;
}

BorderSearch::Leaf BorderSearch::leaf_at(const Position& at) const {
  const auto clamped = [this](double value) {
    return static_cast<std::uint32_t>(std::clamp(value, 0.0, grid_.last() - 1.0));
  };
  const LatticePoint point{clamped(at.x), clamped(at.y)};
  for (std::uint32_t size = grid_.cell();; size /= 2) {
    const LatticePoint low{point.x / size * size, point.y / size * size};
    const auto found = leaves_.find(key_of(low));
    if (found != leaves_.end() && found->second == size) {
      return {low, size};
    }
  }
}

std::vector<BorderSearch::Leaf> BorderSearch::sorted_leaves() const {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted(leaves_.begin(), leaves_.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<Leaf> leaves;
  leaves.reserve(sorted.size());
  for (const auto& [key, size] : sorted) {
    leaves.push_back(
        {{static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(key >> 32U)}, size});
  }
  return leaves;
}

int BorderSearch::region_at(const Position& at) const {
  return region_in(inside_of(leaf_at(at)), at);
}

std::map<int, double> BorderSearch::areas() const {
  std::map<int, double> areas;
  const double cell_area = static_cast<double>(grid_.cell()) * grid_.cell();
  for (const Leaf& leaf : sorted_leaves()) {
    const Inside inside = inside_of(leaf);
    double rest = static_cast<double>(leaf.size) * leaf.size / cell_area;
    for (const auto& piece : inside.pieces) {
      const double area = area_of(piece.polygon) / cell_area;
      areas[piece.region] += area;
      rest -= area;
    }
    if (!inside.has_corner) {
      areas[inside.rest] += rest;
    }
  }
  return areas;
}

// ---- Curves ----

namespace {

/// Chords as a graph, whose nodes are vertices with one or two neighbours each.
struct ChordGraph {
  struct Neighbour {
    bool is_corner;
    std::size_t number;
  };
  std::vector<std::vector<Neighbour>> neighbours = {};

  /// Follows the chords from a vertex, at first to its neighbour of that number, and removes them.
  BorderCurve followed(std::size_t vertex, std::size_t neighbour) {
    BorderCurve curve{.vertices = {vertex}};
    for (;;) {
      const Neighbour next = neighbours[vertex][neighbour];
      neighbours[vertex].erase(neighbours[vertex].begin() + static_cast<std::ptrdiff_t>(neighbour));
      if (next.is_corner) {
        curve.ends_at = next.number;
        return curve;
      }
      auto& back = neighbours[next.number];
      back.erase(std::find_if(back.begin(), back.end(), [vertex](const Neighbour& each) {
        return !each.is_corner && each.number == vertex;
      }));
      curve.vertices.push_back(next.number);
      vertex = next.number;
      neighbour = 0;
      if (neighbours[vertex].empty()) {
        return curve;
      }
    }
  }

  std::vector<BorderCurve> curves() {
    std::vector<BorderCurve> curves;
    const auto corner_of = [this](std::size_t vertex) {
      const auto& all = neighbours[vertex];
      return static_cast<std::size_t>(
          std::find_if(all.begin(), all.end(),
                       [](const Neighbour& each) { return each.is_corner; }) -
          all.begin());
    };
    for (std::size_t vertex = 0; vertex < neighbours.size(); ++vertex) {
      while (corner_of(vertex) < neighbours[vertex].size()) {
        const auto place = corner_of(vertex);
        const std::size_t corner = neighbours[vertex][place].number;
        neighbours[vertex].erase(neighbours[vertex].begin() + static_cast<std::ptrdiff_t>(place));
        curves.push_back(neighbours[vertex].empty() ? BorderCurve{.vertices = {vertex}}
                                                    : followed(vertex, 0));
        curves.back().begins_at = corner;
      }
      if (neighbours[vertex].size() == 1) {
        curves.push_back(followed(vertex, 0));
      }
    }
    for (std::size_t vertex = 0; vertex < neighbours.size(); ++vertex) {
      if (!neighbours[vertex].empty()) {
        curves.push_back(followed(vertex, 0));  // a closed one
      }
    }
    return curves;
  }
};

}  // namespace

Borders BorderSearch::borders() const {
  Borders borders;
  ChordGraph graph;
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
  for (const Leaf& leaf : sorted_leaves()) {
    const Inside inside = inside_of(leaf);
    for (const auto& [a, b] : inside.chords) {
      const auto one = number_of(inside.crossings[a].vertex);
      const auto other = number_of(inside.crossings[b].vertex);
      graph.neighbours[one].push_back({false, other});
      graph.neighbours[other].push_back({false, one});
    }
    if (inside.has_corner) {
      BorderCorner corner{.middle = inside.corner, .size = leaf.size};
      for (const auto crossing : inside.meeting) {
        corner.regions.push_back(inside.crossings[crossing].after);
        graph.neighbours[number_of(inside.crossings[crossing].vertex)].push_back(
            {true, borders.corners.size()});
      }
      borders.corners.push_back(std::move(corner));
    }
  }
  borders.curves = graph.curves();
  return borders;
}

// ---- Shifts ----

ShiftSearch::ShiftSearch(const MapGrid& grid, const Borders& borders, std::size_t every)
    : grid_(grid) {
  for (std::size_t curve = 0; curve < borders.curves.size(); ++curve) {
    const auto& vertices = borders.curves[curve].vertices;
    for (std::size_t i = std::min(every, vertices.size()) / 2; i < vertices.size(); i += every) {
      samples_.push_back({.vertex = borders.vertices[vertices[i]],
                          .result = {.vertex = vertices[i], .curve = curve}});
    }
  }
}

LatticePoint ShiftSearch::point_of(const Sample& sample, std::uint32_t place) const {
  return sample.vertex.is_along_x ? LatticePoint{place, sample.vertex.low.y}
                                  : LatticePoint{sample.vertex.low.x, place};
}

double ShiftSearch::shift_of(const Sample& sample) const {
  const auto& low = sample.vertex.low;
  const double before = sample.vertex.is_along_x ? low.x : low.y;
  return std::abs((static_cast<double>(sample.low) + sample.high - 1.0) / 2.0 - before) /
         grid_.last();
}

std::vector<LatticePoint> ShiftSearch::next() {
  std::vector<LatticePoint> points;
  for (auto& sample : samples_) {
    sample.places.clear();
    if (!sample.is_bracketed && !sample.is_done) {
      // Ever further from the vertex, up to an eighth of the axis to both sides.
      const std::int64_t own = sample.vertex.is_along_x ? sample.vertex.low.x : sample.vertex.low.y;
      std::set<std::int64_t> places{own, own + 1};
      for (std::int64_t reach = grid_.cell() / 64; reach <= grid_.last() / 8; reach *= 4) {
        places.insert(std::max<std::int64_t>(own - reach, 0));
        places.insert(std::min<std::int64_t>(own + reach, grid_.last()));
      }
      sample.places.assign(places.begin(), places.end());
    } else if (!sample.is_done) {
      sample.places = {sample.low + (sample.high - sample.low) / 2};
    }
    for (const auto place : sample.places) {
      points.push_back(point_of(sample, place));
    }
  }
  return points;
}

void ShiftSearch::choose_bracket(Sample& sample, const std::vector<int>& regions,
                                 std::size_t first) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < sample.places.size(); ++i) {
    const Sample candidate{.vertex = sample.vertex,
                           .result = {},
                           .low = sample.places[i - 1],
                           .high = sample.places[i]};
    if (regions[first + i - 1] == sample.vertex.from && regions[first + i] == sample.vertex.to &&
        shift_of(candidate) < nearest) {
      nearest = shift_of(candidate);
      sample.low = candidate.low;
      sample.high = candidate.high;
      sample.is_bracketed = true;
    }
  }
  sample.is_done = !sample.is_bracketed;
}

void ShiftSearch::set_regions(const std::vector<int>& regions) {
  constexpr double kPrecision = 1.0 / 16;  // of a shift, which is an estimate of an error
  std::size_t first = 0;
  for (auto& sample : samples_) {
    if (sample.is_done) {
      continue;
    }
    if (!sample.is_bracketed) {
      choose_bracket(sample, regions, first);
    } else if (regions[first] == sample.vertex.from) {
      sample.low = sample.places.front();
    } else {
      sample.high = sample.places.front();
    }
    first += sample.places.size();
    if (sample.is_bracketed) {
      const double width = static_cast<double>(sample.high - sample.low) / grid_.last();
      sample.result.shift = shift_of(sample);
      sample.is_done = sample.high - sample.low <= 1 || width < kPrecision * *sample.result.shift;
    }
  }
}

std::vector<ShiftSearch::Shift> ShiftSearch::shifts() const {
  std::vector<Shift> shifts;
  for (const auto& sample : samples_) {
    shifts.push_back(sample.result);
  }
  return shifts;
}

}  // namespace oblique::client
