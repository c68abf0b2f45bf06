#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "server/web/answers/fields.h"
#include "server/web/answers/grid.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/json_answer.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;

/// Rows that lie so near to each other are read in one go.
constexpr std::uint64_t kNear = 4;

template <typename Number>
void append(const std::vector<Number>& numbers, std::string& bytes) {
  if (!numbers.empty()) {
    bytes.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
  }
}

/// Values of points, read by key. Neighbours are read together.
std::vector<float> read_by_key(const AnswerDesk& desk, std::uint64_t study,
                               const ColumnSource& source,
                               const std::vector<std::uint64_t>& points) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto is_before = [&](std::size_t a, std::size_t b) { return points[a] < points[b]; };
  if (!std::is_sorted(order.begin(), order.end(), is_before)) {
    std::sort(order.begin(), order.end(), is_before);
  }
  std::vector<float> values(points.size(), no_result());
  const auto settled =
      settled_between(desk.database, study, points[order.front()], points[order.back()]);
  std::size_t run = 0;
  ColumnReader reader(desk.database, study, source);
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin + 1;
    while (end < order.size() && points[order[end]] - points[order[end - 1]] <= kNear) {
      ++end;
    }
    std::size_t next = begin;
    while (settled && run < settled->size() && (*settled)[run].end <= points[order[begin]]) {
      ++run;
    }
    if (settled && (run == settled->size() || points[order[end - 1]] < (*settled)[run].begin)) {
      begin = end;  // no row is there, and none is looked for
      continue;
    }
    reader.read(points[order[begin]], points[order[end - 1]],
                [&](std::uint64_t point, float value) {
                  while (next < end && points[order[next]] < point) {
                    ++next;
                  }
                  if (next < end && points[order[next]] == point) {
                    values[order[next]] = value;
                  }
                });
    begin = end;
  }
  return values;
}

struct Tally {
  std::uint64_t solved = 0;
  std::uint64_t failed = 0;
  std::uint64_t left_out = 0;
  std::uint64_t missing = 0;
  std::uint64_t filtered = 0;
  double least = 0.0;
  double most = 0.0;
  bool has_value = false;
};

/// Marks what a filter of the study leaves out, and results that are not `chosen`, and counts.
Tally tally(const AnswerDesk& desk, const LookedAtStudy& study,
            const std::vector<std::uint64_t>& points, std::vector<float>& values,
            const PointSet* chosen) {
  Tally tally;
  std::size_t near = 0;
  const bool has_filter = study.table->has_filter();
  constexpr std::uint64_t kFiltersBetweenLooks = 64;  // one may take as long as its author likes
  constexpr std::uint64_t kPointsBetweenLooks = 65'536;
  for (std::size_t i = 0; i < values.size(); ++i) {
    desk.end_in_time(i, has_filter ? kFiltersBetweenLooks : kPointsBetweenLooks);
    float& value = values[i];
    if (is_same_mark(value, no_result()) && has_filter && !study.table->is_left_in(points[i])) {
      value = left_out();
      ++tally.left_out;
    } else if (is_same_mark(value, no_result())) {
      ++tally.missing;
    } else if (chosen != nullptr && !chosen->has(points[i], near)) {
      value = filtered_out();
      ++tally.filtered;
    } else if (is_same_mark(value, failed_point())) {
      ++tally.failed;
    } else {
      ++tally.solved;
    }
    if (std::isfinite(value)) {
      const auto number = static_cast<double>(value);
      tally.least = tally.has_value ? std::min(tally.least, number) : number;
      tally.most = tally.has_value ? std::max(tally.most, number) : number;
      tally.has_value = true;
    }
  }
  return tally;
}

constexpr std::uint16_t kFirstMark = 0xfffb;

/// Codes of texts, the most frequent first, and these texts. Of those that are equally frequent the
/// first by the alphabet, as pictures of oblique plot have them.
std::vector<std::uint16_t> coded(const AnswerDesk& desk, const std::vector<float>& values,
                                 ordered_json& dictionary) {
  std::map<std::int64_t, std::uint64_t> counts;
  for (const float value : values) {
    if (std::isfinite(value)) {
      ++counts[static_cast<std::int64_t>(value)];
    }
  }
  struct Text {
    std::int64_t id;
    std::uint64_t count;
    std::string text;
  };
  std::vector<Text> ranked;
  Statement text(desk.database, "SELECT text FROM texts WHERE text_id = ?1");
  for (const auto& [id, count] : counts) {
    text.bind(1, id);
    ranked.push_back({id, count, text.step() ? text.text(0) : ""});
    text.reset();
  }
  std::sort(ranked.begin(), ranked.end(), [](const Text& a, const Text& b) {
    return a.count != b.count ? a.count > b.count : a.text < b.text;
  });
  std::map<std::int64_t, std::uint16_t> codes;
  for (Text& each : ranked) {
    if (codes.size() == kFirstMark) {
      break;
    }
    dictionary.push_back({{"text", std::move(each.text)}, {"cells", each.count}});
    codes.emplace(each.id, static_cast<std::uint16_t>(codes.size()));
  }
  std::vector<std::uint16_t> coded(values.size());
  std::transform(values.begin(), values.end(), coded.begin(), [&](float value) -> std::uint16_t {
    if (std::isfinite(value)) {
      const auto code = codes.find(static_cast<std::int64_t>(value));
      return code == codes.end() ? 0xfffc : code->second;
    }
    return is_same_mark(value, no_result())      ? 0xffff
           : is_same_mark(value, failed_point()) ? 0xfffe
           : is_same_mark(value, left_out())     ? 0xfffd
           : is_same_mark(value, no_value())     ? 0xfffc
                                                 : kFirstMark;
  });
  return coded;
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

HttpAnswer slice_answer(const AnswerDesk& desk, std::uint64_t id, const Fields& asked,
                        const PointSet* chosen) {
  const LookedAtStudy study = desk.studies.study(desk.database, id);
  const FieldReader fields(asked);
  const ColumnSource source = picture_column(fields, "z", true);
  const GridSlice slice = grid_slice(*study.table, fields);
  const std::size_t nx = slice.x.numbers.size();
  const std::size_t ny = slice.y.numbers.size();
  std::vector<std::uint64_t> points(nx * ny);
  for (std::size_t row = 0; row < ny; ++row) {
    for (std::size_t column = 0; column < nx; ++column) {
      points[row * nx + column] = slice.point(column, row);
    }
  }
  std::vector<float> values;
  // Looking up a row takes as long as reading sixteen that follow each other.
  const bool is_most_of_it = study.points / 16 <= points.size();
  const auto column = is_most_of_it
                          ? desk.columns.read(desk.database, id, source, study.points, desk.is_over)
                          : desk.columns.find(desk.database, id, source, study.points);
  if (column) {
    column->gather(points, values);
  } else {
    values = read_by_key(desk, id, source, points);
  }
  const Tally counts = tally(desk, study, points, values, chosen);
  ordered_json at = ordered_json::array();
  for (const GridPlace& place : slice.at) {
    at.push_back(
        {{"key", place.key}, {"of", place.of}, {"number", place.number}, {"value", place.value}});
  }
  ordered_json head{{"study", id},
                    {"block", slice.block},
                    {"z",
                     {{"name", source.name},
                      {"unit", source.unit},
                      {"kind", source.is_category ? "categories" : "numbers"}}},
                    {"x", side_json(slice.x)},
                    {"y", side_json(slice.y)},
                    {"at", std::move(at)},
                    {"nx", nx},
                    {"ny", ny},
                    {"first_point", slice.first_point},
                    {"solved", counts.solved},
                    {"failed", counts.failed},
                    {"left_out", counts.left_out},
                    {"missing", counts.missing},
                    {"filtered", counts.filtered}};
  std::string numbers;
  append(slice.x.values, numbers);
  append(slice.y.values, numbers);
  if (source.is_category) {
    ordered_json dictionary = ordered_json::array();
    append(coded(desk, values, dictionary), numbers);
    head["dictionary"] = std::move(dictionary);
  } else {
    head["least"] = counts.has_value ? ordered_json(counts.least) : nullptr;
    head["most"] = counts.has_value ? ordered_json(counts.most) : nullptr;
    append(values, numbers);
  }
  return numbers_answer(head, numbers);
}

}  // namespace

AnswerPool::Job slice_job(std::uint64_t study, const Fields& fields,
                          std::shared_ptr<const PointSet> chosen) {
  return [study, fields, chosen = std::move(chosen)](const AnswerDesk& desk) {
    return slice_answer(desk, study, fields, chosen.get());
  };
}

}  // namespace oblique::server
