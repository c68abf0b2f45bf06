#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/web/answers/fields.h"
#include "server/web/answers/result_sample.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/json_answer.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;

constexpr std::uint64_t kUsualBins = 64;

/// Columns are looked at in parts, so that no second copy of them is held.
constexpr std::size_t kPart = 65'536;

/// Values of a study's column, as it is held or as a sample of it has them.
class BinColumn {
 public:
  BinColumn() = default;
  BinColumn(ColumnSource source, ColumnStore::Shared stored)
      : source_(std::move(source)), stored_(std::move(stored)) {}
  BinColumn(ColumnSource source, std::shared_ptr<const ResultSample> sample, std::size_t number)
      : source_(std::move(source)), sample_(std::move(sample)), number_(number) {}

  explicit operator bool() const { return stored_ || sample_; }
  const ColumnSource& source() const { return source_; }
  std::uint64_t size() const { return stored_ ? stored_->points() : sample_->points.size(); }
  std::uint64_t point(std::uint64_t place) const {
    return stored_ ? place : sample_->points[place];
  }
  std::vector<float> part(std::uint64_t first, std::size_t count) const {
    if (stored_) {
      return stored_->part(first, count);
    }
    const auto& all = sample_->columns[number_];
    const std::size_t end = std::min<std::size_t>(first + count, all.size());
    return {all.begin() + static_cast<std::ptrdiff_t>(first),
            all.begin() + static_cast<std::ptrdiff_t>(end)};
  }

 private:
  ColumnSource source_;
  ColumnStore::Shared stored_;
  std::shared_ptr<const ResultSample> sample_;
  std::size_t number_ = 0;
};

/// The bins along one column, both ends in.
struct BinSide {
  BinColumn column;  ///< none: there is one bin
  std::uint64_t bins = 1;
  bool is_logarithmic = false;
  double least = 0.0;
  double most = 0.0;
  // The ends as values are kept: the end that was typed is the float32 next to it.
  float first = 0.0F;
  float last = 0.0F;
  double from = 0.0;   ///< place of `first`
  double width = 0.0;  ///< up to that of `last`

  void place_ends() {
    first = as_kept(least);
    last = as_kept(most);
    from = place_of(first);
    width = place_of(last) - from;
  }
  bool takes(float value) const { return !column || (value >= first && value <= last); }
  /// Of a value that it takes.
  std::uint64_t bin_of(float value) const {
    const double share = column && width > 0.0 ? (place_of(value) - from) / width : 0.0;
    return std::min(static_cast<std::uint64_t>(share * static_cast<double>(bins)), bins - 1);
  }

 private:
  using Kept = std::numeric_limits<float>;
  float as_kept(double end) const {
    const auto kept = static_cast<float>(
        std::clamp(end, static_cast<double>(Kept::lowest()), static_cast<double>(Kept::max())));
    return is_logarithmic ? std::max(kept, Kept::denorm_min()) : kept;
  }
  double place_of(float value) const {
    const auto number = static_cast<double>(value);
    return is_logarithmic ? std::log(number) : number;
  }
};

/// Columns that are asked for, and what there is of their study.
struct BinColumns {
  std::vector<BinColumn> columns;
  std::shared_ptr<const ResultSample> sample;  ///< null: all is held
};

BinColumns read_columns(const AnswerDesk& desk, const LookedAtStudy& study,
                        const std::vector<ColumnSource>& sources) {
  BinColumns read;
  if (study.points > ColumnStore::kMostPoints) {
    read.sample = desk.samples.sample(desk, study.id, sources);
  }
  for (const ColumnSource& source : sources) {
    if (read.sample) {
      read.columns.emplace_back(source, read.sample, read.columns.size());
    } else {
      read.columns.emplace_back(
          source, desk.columns.read(desk.database, study.id, source, study.points, desk.is_over));
    }
  }
  return read;
}

/// Which points are counted: those that meet a condition, or all.
class Chosen {
 public:
  explicit Chosen(const PointSet* points) : points_(points) {}
  bool has(std::uint64_t point) { return points_ == nullptr || points_->has(point, near_); }

 private:
  const PointSet* points_;
  std::size_t near_ = 0;
};

/// The least and the largest value that can be shown; nothing: there is none.
std::optional<std::pair<double, double>> range_of(const AnswerDesk& desk, const BinSide& side,
                                                  const PointSet* chosen) {
  Chosen is_chosen(chosen);
  std::optional<std::pair<double, double>> range;
  for (std::uint64_t first = 0; first < side.column.size(); first += kPart) {
    desk.end_in_time(first);
    const std::vector<float> part = side.column.part(first, kPart);
    for (std::size_t i = 0; i < part.size(); ++i) {
      const auto value = static_cast<double>(part[i]);
      if (std::isfinite(value) && (!side.is_logarithmic || value > 0.0) &&
          is_chosen.has(side.column.point(first + i))) {
        range = range ? std::pair(std::min(range->first, value), std::max(range->second, value))
                      : std::pair(value, value);
      }
    }
  }
  return range;
}

BinSide side_of(const AnswerDesk& desk, BinColumn column, const FieldReader& fields,
                const std::string& name, const PointSet* chosen) {
  BinSide side;
  side.column = std::move(column);
  side.bins = fields.pixels("n" + name, kUsualBins);
  side.is_logarithmic = fields.text(name + "log").value_or("") == "1";
  const auto range = range_of(desk, side, chosen);
  const auto typed_least = fields.number(name + "0");
  const auto typed_most = fields.number(name + "1");
  side.least = typed_least.value_or(range ? range->first : typed_most.value_or(0.0));
  side.most = typed_most.value_or(range ? range->second : side.least);
  const bool has_ends = range || typed_least || typed_most;
  if (side.least > side.most || (side.is_logarithmic && has_ends && side.least <= 0.0)) {
    throw std::invalid_argument(
        fmt::format("{0}0 must be at most {0}1, and above 0 where the scale is logarithmic", name));
  }
  side.place_ends();
  return side;
}

/// What lies where.
struct Bins {
  std::vector<std::uint32_t> counts;
  std::vector<double> sums;           ///< of the third column; empty: none is wanted
  std::vector<std::uint32_t> summed;  ///< points with such a value
  std::uint64_t inside = 0;
  std::uint64_t outside = 0;
  std::uint64_t filtered = 0;
};

Bins bins_of(const AnswerDesk& desk, const BinSide& x, const BinSide& y, const BinColumn& z,
             const PointSet* chosen) {
  Chosen is_chosen(chosen);
  const std::size_t size = x.bins * y.bins;
  Bins bins{std::vector<std::uint32_t>(size), std::vector<double>(z ? size : 0),
            std::vector<std::uint32_t>(z ? size : 0)};
  for (std::uint64_t first = 0; first < x.column.size(); first += kPart) {
    desk.end_in_time(first);
    const std::vector<float> x_part = x.column.part(first, kPart);
    const std::vector<float> y_part = y.column ? y.column.part(first, kPart) : x_part;
    const std::vector<float> z_part = z ? z.part(first, kPart) : std::vector<float>();
    for (std::size_t i = 0; i < x_part.size(); ++i) {
      const float x_value = x_part[i];
      const float y_value = y_part[i];
      if (!std::isfinite(x_value) || !std::isfinite(y_value)) {
        continue;
      }
      if (!is_chosen.has(x.column.point(first + i))) {
        ++bins.filtered;
        continue;
      }
      if (!x.takes(x_value) || !y.takes(y_value)) {
        ++bins.outside;
        continue;
      }
      const std::uint64_t bin = y.bin_of(y_value) * x.bins + x.bin_of(x_value);
      ++bins.counts[bin];
      ++bins.inside;
      if (z && std::isfinite(z_part[i])) {
        bins.sums[bin] += static_cast<double>(z_part[i]);
        ++bins.summed[bin];
      }
    }
  }
  return bins;
}

ordered_json side_json(const BinSide& side) {
  const ColumnSource& source = side.column.source();
  return {{"column", source.name}, {"unit", source.unit}, {"least", side.least},
          {"most", side.most},     {"bins", side.bins},   {"log", side.is_logarithmic}};
}

HttpAnswer bins_answer(const AnswerDesk& desk, std::uint64_t id, const Fields& asked,
                       const PointSet* chosen) {
  const LookedAtStudy study = desk.studies.study(desk.database, id);
  const FieldReader fields(asked);
  const bool has_y = fields.text("y").has_value();
  std::vector<ColumnSource> sources{picture_column(fields, "x", false)};
  if (has_y) {
    sources.push_back(picture_column(fields, "y", false));
  }
  if (fields.text("z")) {
    sources.push_back(picture_column(fields, "z", false));
  }
  auto [columns, sample] = read_columns(desk, study, sources);
  const BinColumn z = fields.text("z") ? columns.back() : BinColumn();
  const BinSide x = side_of(desk, columns[0], fields, "x", chosen);
  const BinSide y = has_y ? side_of(desk, columns[1], fields, "y", chosen) : BinSide();
  const Bins bins = bins_of(desk, x, y, z, chosen);
  std::string numbers(bins.counts.size() * sizeof(bins.counts[0]), '\0');
  std::memcpy(numbers.data(), bins.counts.data(), numbers.size());
  for (std::size_t i = 0; i < bins.sums.size(); ++i) {
    const float mean = bins.summed[i] > 0
                           ? static_cast<float>(bins.sums[i] / static_cast<double>(bins.summed[i]))
                           : no_result();
    numbers.append(reinterpret_cast<const char*>(&mean), sizeof mean);
  }
  return numbers_answer(
      {{"study", id},
       {"x", side_json(x)},
       {"y", y.column ? side_json(y) : ordered_json(nullptr)},
       {"z", z ? ordered_json(z.source().name) : ordered_json(nullptr)},
       {"points", bins.inside},
       {"outside", bins.outside},
       {"filtered", bins.filtered},
       {"sample", sample && sample->points.size() < sample->of
                      ? ordered_json{{"results", sample->points.size()}, {"of", sample->of}}
                      : ordered_json(nullptr)},
       {"most", *std::max_element(bins.counts.begin(), bins.counts.end())}},
      numbers);
}

}  // namespace

AnswerPool::Job bins_job(std::uint64_t study, const Fields& fields,
                         std::shared_ptr<const PointSet> chosen) {
  return [study, fields, chosen = std::move(chosen)](const AnswerDesk& desk) {
    return bins_answer(desk, study, fields, chosen.get());
  };
}

}  // namespace oblique::server
