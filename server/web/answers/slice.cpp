#include <algorithm>
#include <cstring>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/web/answers/fields.h"
#include "server/web/answers/grid.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/json_answer.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;

/// Why a cell has no value. As a number it is the NaN with the bits kNan + mark, as a category the
/// code 0xffff - mark.
enum class Mark : std::uint8_t { kNotSolved, kFailed, kLeftOut, kNoValue, kFiltered, kHasValue };
constexpr std::uint32_t kNan = 0x7fc00000;
constexpr std::uint16_t kLastCode = 0xffff;

/// A cell of the picture.
struct Cell {
  Mark mark = Mark::kNotSolved;
  float number = 0.0F;
  std::size_t text = 0;  ///< index into SliceCells::texts
};

struct SliceCells {
  std::vector<Cell> cells;  ///< row by row
  std::vector<std::string> texts = {};
};

template <typename Number>
void append(const std::vector<Number>& numbers, std::string& bytes) {
  if (!numbers.empty()) {
    bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
  }
}

/// What is added to the number of a point for each cell along a side, as a JSON array.
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

/// The cells by rising point.
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
  SliceCells read{std::vector<Cell>(points.size())};
  std::map<std::string, std::size_t, std::less<>> known;
  auto place = points.begin();
  const auto take = [&](const protocol::ChunkRows& row) {
    const auto point = static_cast<std::uint64_t>(row.cell(0).integer);
    while (place != points.end() && place->first < point) {
      ++place;
    }
    if (place == points.end() || place->first != point) {
      throw std::runtime_error("a reader process returned another point than it was asked for");
    }
    Cell& cell = read.cells[place->second];
    cell.mark = static_cast<Mark>(row.cell(2).integer);
    const protocol::Cell& value = row.cell(1);
    if (cell.mark == Mark::kHasValue && column.is_category) {
      auto text = known.find(value.text);
      if (text == known.end()) {
        text = known.emplace(value.text, read.texts.size()).first;
        read.texts.emplace_back(value.text);
      }
      cell.text = text->second;
    } else if (cell.mark == Mark::kHasValue) {
      cell.number = static_cast<float>(value.kind == protocol::CellKind::kInteger
                                           ? static_cast<double>(value.integer)
                                           : value.real);
    }
  };
  query_with_condition(context, slice_query(study, slice, column.name, condition), condition, take);
  if (study.table->has_filter()) {
    for (const auto& [point, number] : points) {
      context.throw_if_over();  // a filter may take long
      if (read.cells[number].mark == Mark::kNotSolved && !study.table->is_left_in(point)) {
        read.cells[number].mark = Mark::kLeftOut;
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

/// Adds least and most to the head, and the cells to the numbers.
void append_numbers(const SliceCells& read, ordered_json& head, std::string& numbers) {
  head["least"] = nullptr;
  head["most"] = nullptr;
  for (const Cell& cell : read.cells) {
    std::uint32_t bits = kNan + static_cast<std::uint32_t>(cell.mark);
    if (cell.mark == Mark::kHasValue) {
      std::memcpy(&bits, &cell.number, sizeof bits);
      const auto value = static_cast<double>(cell.number);
      head["least"] =
          head["least"].is_null() ? value : std::min(head["least"].get<double>(), value);
      head["most"] = head["most"].is_null() ? value : std::max(head["most"].get<double>(), value);
    }
    numbers.append(reinterpret_cast<const char*>(&bits), sizeof bits);
  }
}

/// Adds the dictionary to the head, the most frequent text first, of equally frequent ones the
/// first in the alphabet, as `oblique plot` orders them; and the codes of the cells to the numbers.
void append_codes(const SliceCells& read, ordered_json& head, std::string& numbers) {
  std::vector<std::uint64_t> counts(read.texts.size());
  for (const Cell& cell : read.cells) {
    if (cell.mark == Mark::kHasValue) {
      ++counts[cell.text];
    }
  }
  std::vector<std::size_t> ranked(counts.size());
  std::iota(ranked.begin(), ranked.end(), std::size_t{0});
  std::sort(ranked.begin(), ranked.end(), [&](std::size_t one, std::size_t other) {
    return counts[one] != counts[other] ? counts[one] > counts[other]
                                        : read.texts[one] < read.texts[other];
  });
  std::vector<std::uint16_t> code_of(counts.size());
  head["dictionary"] = ordered_json::array();
  for (std::size_t code = 0; code < ranked.size(); ++code) {
    // 2^16 cells have fewer texts than that, but for a picture in which each has another one.
    code_of[ranked[code]] = static_cast<std::uint16_t>(std::min<std::size_t>(code, kLastCode - 5));
    head["dictionary"].push_back(
        {{"text", read.texts[ranked[code]]}, {"cells", counts[ranked[code]]}});
  }
  for (const Cell& cell : read.cells) {
    const std::uint16_t code =
        cell.mark == Mark::kHasValue
            ? code_of[cell.text]
            : static_cast<std::uint16_t>(kLastCode - static_cast<int>(cell.mark));
    numbers.append(reinterpret_cast<const char*>(&code), sizeof code);
  }
}

HttpAnswer slice_answer(const JobContext& context, std::uint64_t id, const Fields& asked) {
  const FieldReader fields(asked);
  const std::string condition = fields.condition();
  const PictureColumn column = picture_column(fields, "z", true);
  const ServedStudy study = context.study(id);
  const GridSlice slice = grid_slice(*study.table, fields);
  const SliceCells read = read_cells(context, study, slice, column, condition);
  const auto count = [&](Mark mark) { return std::ranges::count(read.cells, mark, &Cell::mark); };
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

void query_with_condition(const JobContext& context, const protocol::StudyQuery& query,
                          const std::string& condition, const JobContext::OnRow& on_row) {
  try {
    context.query(query, on_row);
  } catch (const JobError& error) {
    if (error.answer().status == 400 && !condition.empty()) {
      protocol::StudyQuery as_written;
      as_written.set_study(query.study());
      as_written.add_select("point");
      as_written.set_where(condition);
      as_written.set_limit(1);
      context.query(as_written, [](const auto&) {});
    }
    throw;
  }
}

AnswerPool::Job slice_job(std::uint64_t study, const Fields& fields) {
  return
      [study, fields](const JobContext& context) { return slice_answer(context, study, fields); };
}

}  // namespace oblique::server
