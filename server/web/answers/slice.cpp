#include <algorithm>
#include <bit>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/web/answers/fields.h"
#include "server/web/answers/grid.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/http_message.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;

/// Why a cell has no value. In numbers a mark is the NaN with the bits kNan + mark, in categories
/// the code 0xffff - mark.
enum class Mark : std::uint8_t { kNotSolved, kFailed, kLeftOut, kNoValue, kFiltered, kHasValue };
constexpr std::uint32_t kNan = 0x7fc00000;
constexpr std::uint16_t kLastCode = 0xffff;

/// The cells of a picture, row by row.
struct SliceCells {
  std::vector<Mark> marks;
  std::vector<float> numbers;                              ///< values of a column of numbers
  std::map<std::string, std::vector<std::size_t>> places;  ///< of categories: cells by text
};

template <typename Number>
void append(const std::vector<Number>& numbers, std::string& bytes) {
  if (!numbers.empty()) {
    bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
  }
}

/// The offset of the point number for each cell along a side, as a JSON array.
std::string offsets_json(const GridSide& side, std::uint64_t first) {
  std::vector<std::uint64_t> offsets;
  for (const std::uint64_t number : side.numbers) {
    offsets.push_back(first + number * side.stride);
  }
  return fmt::format("[{}]", fmt::join(offsets, ","));
}

/// Selects point, value and mark of the cells that have a row. SQLite looks each point up by key.
protocol::StudyQuery slice_query(const ServedStudy& study, const GridSlice& slice,
                                 const std::string& column, const std::string& condition) {
  protocol::StudyQuery query;
  query.set_study(study.name);
  query.add_select("point");
  query.add_select(column);
  query.add_select(
      fmt::format("CASE {}WHEN error IS NOT NULL THEN {} WHEN {} IS NULL THEN {} ELSE {} END",
                  condition.empty() ? ""
                                    : fmt::format("WHEN ({}) IS NOT TRUE THEN {} ", condition,
                                                  static_cast<int>(Mark::kFiltered)),
                  static_cast<int>(Mark::kFailed), column, static_cast<int>(Mark::kNoValue),
                  static_cast<int>(Mark::kHasValue)));
  query.set_where(fmt::format(
      "point IN (SELECT y.value + x.value FROM json_each('{}') AS y, json_each('{}') AS x)",
      offsets_json(slice.y, slice.first_point), offsets_json(slice.x, 0)));
  return query;
}

/// Point and cell of all cells, by rising point.
std::vector<std::pair<std::uint64_t, std::size_t>> points_of(const GridSlice& slice) {
  std::vector<std::pair<std::uint64_t, std::size_t>> points;
  for (std::size_t row = 0; row < slice.y.numbers.size(); ++row) {
    for (std::size_t column = 0; column < slice.x.numbers.size(); ++column) {
      points.emplace_back(slice.point(column, row), points.size());
    }
  }
  std::sort(points.begin(), points.end());
  return points;
}

SliceCells read_cells(const JobContext& context, const ServedStudy& study, const GridSlice& slice,
                      const PictureColumn& column, const std::string& condition) {
  const auto points = points_of(slice);
  SliceCells read{std::vector<Mark>(points.size()), std::vector<float>(points.size()), {}};
  auto place = points.begin();
  const auto take = [&](const protocol::ChunkRows& row) {
    const auto point = static_cast<std::uint64_t>(row.cell(0).integer);
    place =
        std::find_if(place, points.end(), [&](const auto& each) { return each.first >= point; });
    if (place == points.end() || place->first != point) {
      throw std::runtime_error("a reader process returned another point than it was asked for");
    }
    const std::size_t cell = place->second;
    read.marks[cell] = static_cast<Mark>(row.cell(2).integer);
    if (read.marks[cell] == Mark::kHasValue && column.is_category) {
      read.places[std::string(row.cell(1).text)].push_back(cell);
    } else if (read.marks[cell] == Mark::kHasValue) {
      read.numbers[cell] = static_cast<float>(real_of(row.cell(1)));
    }
  };
  context.query(slice_query(study, slice, column.name, condition), condition, take);
  if (study.table->has_filter()) {
    for (const auto& [point, cell] : points) {
      context.throw_if_over();  // evaluating filters may take long
      if (read.marks[cell] == Mark::kNotSolved && study.leaves_out(point)) {
        read.marks[cell] = Mark::kLeftOut;
      }
    }
  }
  return read;
}

ordered_json side_json(const GridSide& side) {
  if (side.key.empty()) {
    return nullptr;
  }
  return {
      {"key", side.key},       {"of", side.of},
      {"first", side.first},   {"last", side.last},
      {"stride", side.stride}, {"all_lines", side.numbers.size() == side.last - side.first + 1}};
}

/// Adds the least and the largest value to `head`, and the values of the cells to `numbers`.
void append_numbers(const SliceCells& read, ordered_json& head, std::string& numbers) {
  std::vector<std::uint32_t> bits;
  std::optional<std::pair<float, float>> range;
  for (std::size_t cell = 0; cell < read.marks.size(); ++cell) {
    const float number = read.numbers[cell];
    const bool has_value = read.marks[cell] == Mark::kHasValue;
    bits.push_back(has_value ? std::bit_cast<std::uint32_t>(number)
                             : kNan + static_cast<std::uint32_t>(read.marks[cell]));
    if (has_value) {
      range = std::pair(std::min(range ? range->first : number, number),
                        std::max(range ? range->second : number, number));
    }
  }
  head["least"] = range ? ordered_json(range->first) : nullptr;
  head["most"] = range ? ordered_json(range->second) : nullptr;
  append(bits, numbers);
}

/// Adds the dictionary to `head`, and the codes of the cells to `numbers`. Texts are sorted by
/// falling frequency, then alphabetically, as in `oblique plot`.
void append_codes(const SliceCells& read, ordered_json& head, std::string& numbers) {
  std::vector<std::uint16_t> codes;
  for (const Mark mark : read.marks) {
    codes.push_back(static_cast<std::uint16_t>(kLastCode - static_cast<int>(mark)));
  }
  std::vector<std::pair<std::string, std::vector<std::size_t>>> ranked(read.places.begin(),
                                                                       read.places.end());
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& one, const auto& other) {
    return one.second.size() > other.second.size();
  });
  head["dictionary"] = ordered_json::array();
  for (std::size_t code = 0; code < ranked.size(); ++code) {
    const auto& [text, places] = ranked[code];
    for (const std::size_t cell : places) {
      // A code above the limit would be a mark; only a file that was changed by hand has so many
      // texts.
      codes[cell] = static_cast<std::uint16_t>(std::min<std::size_t>(code, kLastCode - 5));
    }
    head["dictionary"].push_back({{"text", text}, {"cells", places.size()}});
  }
  append(codes, numbers);
}

HttpAnswer slice_answer(const JobContext& context, std::uint64_t id, const Fields& asked) {
  const FieldReader fields(asked);
  const std::string condition = fields.condition();
  const PictureColumn column = picture_column(fields, "z", true);
  const ServedStudy study = context.study(id);
  const GridSlice slice = grid_slice(*study.table, fields);
  const SliceCells read = read_cells(context, study, slice, column, condition);
  const auto count = [&](Mark mark) { return std::ranges::count(read.marks, mark); };
  ordered_json at = ordered_json::array();
  for (const GridPlace& place : slice.at) {
    at.push_back(
        {{"key", place.key}, {"of", place.of}, {"number", place.number}, {"value", place.value}});
  }
  ordered_json head{{"study", id},
                    {"block", slice.block},
                    {"z",
                     {{"name", column.name},
                      {"unit", column.unit},
                      {"kind", column.is_category ? "categories" : "numbers"}}},
                    {"x", side_json(slice.x)},
                    {"y", side_json(slice.y)},
                    {"at", std::move(at)},
                    {"nx", slice.x.numbers.size()},
                    {"ny", slice.y.numbers.size()},
                    {"first_point", slice.first_point},
                    {"solved", count(Mark::kHasValue) + count(Mark::kNoValue)},
                    {"failed", count(Mark::kFailed)},
                    {"left_out", count(Mark::kLeftOut)},
                    {"missing", count(Mark::kNotSolved)},
                    {"filtered", count(Mark::kFiltered)}};
  std::string numbers;
  append(slice.x.values, numbers);
  append(slice.y.values, numbers);
  if (column.is_category) {
    append_codes(read, head, numbers);
  } else {
    append_numbers(read, head, numbers);
  }
  return numbers_answer(head, numbers);
}

}  // namespace

AnswerPool::Job slice_job(std::uint64_t study, const Fields& fields) {
  return
      [study, fields](const JobContext& context) { return slice_answer(context, study, fields); };
}

}  // namespace oblique::server
