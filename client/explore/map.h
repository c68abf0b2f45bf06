#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

// Borders between the regions of a plane, found from the regions of single points. Nothing here
// solves a point: the caller does, round by round.
namespace oblique::client {

/// A point of the lattice, which has 2^halvings steps a cell along each axis.
struct LatticePoint {
  std::uint32_t x = 0;
  std::uint32_t y = 0;

  bool operator==(const LatticePoint&) const = default;
};

/// A position in steps of the lattice.
struct Position {
  double x = 0.0;
  double y = 0.0;
};

/// A point of a border: it lies in the bracket of one step from `low` along one axis.
struct BorderVertex {
  LatticePoint low;
  bool is_along_x = true;  ///< else along y
  int from = 0;            ///< region at the lower end of the bracket
  int to = 0;              ///< region at its upper end

  Position middle() const;
};

/// A point where three or more regions meet, somewhere in a cell.
struct BorderCorner {
  Position middle;
  std::uint32_t size = 0;  ///< of the cell, in steps
  std::vector<int> regions = {};
};

/// A border of two regions. A closed one ends with its first vertex.
struct BorderCurve {
  std::vector<std::size_t> vertices = {};
  std::optional<std::size_t> begins_at = {};  ///< a corner
  std::optional<std::size_t> ends_at = {};

  bool is_closed() const { return vertices.size() > 1 && vertices.front() == vertices.back(); }
};

struct Borders {
  std::vector<BorderVertex> vertices = {};
  std::vector<BorderCorner> corners = {};
  std::vector<BorderCurve> curves = {};
};

struct MapGrid {
  std::uint32_t cells = 64;    ///< along each axis
  std::uint32_t halvings = 0;  ///< of a cell's side, until a bracket is short enough

  /// The grid whose brackets are at most `bracket` times an axis.
  static MapGrid of(std::uint32_t cells, double bracket);
  std::uint32_t cell() const { return std::uint32_t{1} << halvings; }
  std::uint32_t last() const { return cells << halvings; }  ///< largest coordinate
};

/// Finds borders: a coarse grid; cells are halved where a side has two borders, where borders meet
/// and where the middle of a border is not close to the chord between its ends; and each side is
/// bisected where its ends are in different regions.
///
/// A region is a number from 0. An island or sliver without a point of the coarse grid is missed
/// where no bisection happens to meet it.
class BorderSearch {
 public:
  explicit BorderSearch(const MapGrid& grid);

  /// The points whose regions the search needs next; empty at the end. First the grid, row by row
  /// with rising y. `set_regions` must be called before the next call.
  std::vector<LatticePoint> next();
  /// Their regions, in that order.
  void set_regions(const std::vector<int>& regions);

  // At the end:

  Borders borders() const;
  /// The region at a position, by the curves inside its cell.
  int region_at(const Position& at) const;
  /// Area of each region in cells of the coarse grid.
  std::map<int, double> areas() const;

 private:
  /// A square that is not halved (yet).
  struct Leaf {
    LatticePoint low;
    std::uint32_t size;
  };
  /// A change of region on the way around a leaf, counterclockwise.
  struct Crossing {
    BorderVertex vertex;  ///< its `low` is valid only if the ends are one step apart
    std::uint32_t width;  ///< distance of its ends, in steps
    Position at;
    int after;  ///< region behind it
  };
  /// A part of the way around a leaf in one region, from one crossing to the next.
  struct Arc {
    std::vector<Position> path;
    std::size_t first;  ///< number of the crossing at its beginning
    std::size_t last;
    int region;
    double length;
  };
  struct Piece {
    std::vector<Position> polygon;
    int region;
  };
  /// How the borders run inside a leaf.
  struct Inside {
    std::vector<Crossing> crossings = {};
    std::vector<std::array<std::size_t, 2>> chords = {};  ///< pairs of crossings
    bool has_corner = false;
    std::vector<std::size_t> meeting = {};  ///< crossings whose borders meet at `corner`
    Position corner = {};
    std::vector<Piece> pieces = {};  ///< an earlier one lies over a later one
    int rest = 0;                    ///< region of what no piece has
  };
  struct Probe {
    Leaf leaf;
    LatticePoint at;
    int expected;
  };
  using Sides = std::array<std::vector<Crossing>, 4>;  ///< counterclockwise from the lowest
  using Line = std::map<std::uint32_t, int>;           ///< regions of points by one coordinate

  const int* find(const LatticePoint& point) const;
  void request(const LatticePoint& point);
  std::array<LatticePoint, 4> corners_of(const Leaf& leaf) const;
  void split(const Leaf& leaf);
  Sides sides_of(const Leaf& leaf) const;
  /// Whether the leaf must be halved because of the borders on its sides.
  bool is_complex(const Leaf& leaf, const Sides& sides) const;
  /// Requests what the leaf needs, or halves it. True if it stays and has crossings.
  bool refine(const Leaf& leaf);
  void refine_all();
  /// Requests points inside the brackets that are too wide.
  void request_sections();
  /// Requests points on both sides of the middles of chords, which show whether these are close to
  /// their borders.
  void request_probes();
  std::vector<Arc> arcs_of(const Leaf& leaf, const Sides& sides) const;
  /// Joins crossings by chords. A region between two crossings with the same region on both sides
  /// is cut off by a chord, the shortest first. If three or more regions remain, their borders meet
  /// in a corner.
  Inside inside_of(const Leaf& leaf) const;
  static int region_in(const Inside& inside, const Position& at);
  Leaf leaf_at(const Position& at) const;
  std::vector<Leaf> sorted_leaves() const;

  MapGrid grid_;
  std::unordered_map<std::uint32_t, Line> rows_;             ///< by y
  std::unordered_map<std::uint32_t, Line> columns_;          ///< by x
  std::unordered_map<std::uint64_t, std::uint32_t> leaves_;  ///< size by lower corner
  std::vector<Leaf> mixed_;                                  ///< leaves with crossings
  std::vector<Crossing> open_brackets_;                      ///< both leaves of a side have it
  bool is_any_split_ = true;                                 ///< since all leaves were looked at
  std::unordered_set<std::uint64_t> must_split_;             ///< lower corners of leaves
  std::unordered_set<std::uint64_t> probed_;                 ///< lower corners of leaves
  std::vector<Probe> probes_;                                ///< that are requested
  std::vector<LatticePoint> requested_;
  std::unordered_set<std::uint64_t> is_requested_;
};

/// Measures how far borders move when the same points are solved otherwise, for example on a finer
/// mesh. For a sample of the vertices it searches the border of the other solution nearby.
class ShiftSearch {
 public:
  struct Shift {
    std::size_t vertex;
    std::size_t curve;
    /// Part of the axis along which its bracket lies; nothing: no such border is near.
    std::optional<double> shift = {};
  };

  /// One of `every` vertices of each curve, and at least one.
  ShiftSearch(const MapGrid& grid, const Borders& borders, std::size_t every);

  /// The next points to solve, as for BorderSearch.
  std::vector<LatticePoint> next();
  void set_regions(const std::vector<int>& regions);
  std::vector<Shift> shifts() const;

 private:
  struct Sample {
    BorderVertex vertex;
    Shift result;
    std::vector<std::uint32_t> places = {};  ///< requested, along the axis of the bracket
    std::uint32_t low = 0;
    std::uint32_t high = 0;
    bool is_bracketed = false;
    bool is_done = false;
  };
  LatticePoint point_of(const Sample& sample, std::uint32_t place) const;
  double shift_of(const Sample& sample) const;
  void choose_bracket(Sample& sample, const std::vector<int>& regions, std::size_t first) const;

  MapGrid grid_;
  std::vector<Sample> samples_;
};

}  // namespace oblique::client
