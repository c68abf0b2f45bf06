#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "server/web/answers/fields.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/json_answer.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;

constexpr std::uint64_t kUsualBins = 64;

/// The bins along one column.
struct BinSide {
  ColumnSource source;
  std::vector<float> values;  ///< of all points
  std::uint64_t bins = 1;
  bool is_logarithmic = false;
  double least = 0.0;
  double most = 0.0;

  double place_of(double value) const { return is_logarithmic ? std::log(value) : value; }
  bool takes(double value) const {
    return value >= least && value <= most && (!is_logarithmic || value > 0.0);
  }
  /// Both ends are in.
  std::uint64_t bin_of(double value) const {
    const double from = place_of(least);
    const double width = place_of(most) - from;
    const double share = width > 0.0 ? (place_of(value) - from) / width : 0.0;
    return std::min(static_cast<std::uint64_t>(share * static_cast<double>(bins)), bins - 1);
  }
};

std::vector<float> whole_column(const AnswerDesk& desk, const LookedAtStudy& study,
                                const ColumnSource& source) {
  const auto column = desk.columns.read(desk.database, study.id, source, study.points);
  if (!column) {
    throw std::invalid_argument(
        fmt::format("the study has {} points, and bins are made of at most {}: ask for rows",
                    study.points, ColumnStore::kMostPoints));
  }
  std::vector<float> values;
  column->look([&](std::span<const float> all) { values.assign(all.begin(), all.end()); });
  return values;
}

ColumnSource numbers_source(const FieldReader& fields, const std::string& name) {
  const std::string column = fields.text(name).value_or("");
  auto source = column_source(column);
  if (!source || source->is_category) {
    throw std::invalid_argument(fmt::format("{} must be a column of numbers; \"{}\" is none", name,
                                            protocol::visible(column)));
  }
  return *std::move(source);
}

BinSide side_of(const AnswerDesk& desk, const LookedAtStudy& study, const FieldReader& fields,
                const std::string& name) {
  BinSide side{numbers_source(fields, name), {}, 1, false, 0.0, 0.0};
  side.values = whole_column(desk, study, side.source);
  side.bins = fields.pixels("n" + name, kUsualBins);
  side.is_logarithmic = fields.text(name + "log").value_or("") == "1";
  bool has_any = false;
  for (const float stored : side.values) {
    const auto value = static_cast<double>(stored);
    if (std::isfinite(value) && (!side.is_logarithmic || value > 0.0)) {
      side.least = has_any ? std::min(side.least, value) : value;
      side.most = has_any ? std::max(side.most, value) : value;
      has_any = true;
    }
  }
  side.least = fields.number(name + "0").value_or(side.least);
  side.most = fields.number(name + "1").value_or(side.most);
  if (side.least > side.most || (side.is_logarithmic && has_any && side.least <= 0.0)) {
    throw std::invalid_argument(
        fmt::format("{0}0 must be at most {0}1, and above 0 where the scale is logarithmic", name));
  }
  return side;
}

ordered_json side_json(const BinSide& side) {
  return {{"column", side.source.name}, {"unit", side.source.unit}, {"least", side.least},
          {"most", side.most},          {"bins", side.bins},        {"log", side.is_logarithmic}};
}

HttpAnswer bins_answer(const AnswerDesk& desk, std::uint64_t id, const Fields& asked) {
  const LookedAtStudy study = desk.studies.study(desk.database, id);
  const FieldReader fields(asked);
  const BinSide x = side_of(desk, study, fields, "x");
  const bool has_y = fields.text("y").has_value();
  const bool has_z = fields.text("z").has_value();
  const BinSide y = has_y ? side_of(desk, study, fields, "y") : BinSide{{}, {}, 1, false, 0.0, 0.0};
  std::vector<float> z;
  if (has_z) {
    z = whole_column(desk, study, numbers_source(fields, "z"));
  }
  std::vector<std::uint32_t> counts(x.bins * y.bins, 0);
  std::vector<double> sums(has_z ? counts.size() : 0, 0.0);
  std::vector<std::uint32_t> summed(sums.size(), 0);
  std::uint64_t inside = 0;
  std::uint64_t outside = 0;
  for (std::size_t i = 0; i < x.values.size(); ++i) {
    const auto x_value = static_cast<double>(x.values[i]);
    const double y_value = has_y ? static_cast<double>(y.values[i]) : 0.0;
    if (!std::isfinite(x_value) || !std::isfinite(y_value)) {
      continue;
    }
    if (!x.takes(x_value) || (has_y && !y.takes(y_value))) {
      ++outside;
      continue;
    }
    const std::uint64_t row = has_y ? y.bin_of(y_value) : 0;
    const std::uint64_t bin = row * x.bins + x.bin_of(x_value);
    ++counts[bin];
    ++inside;
    if (has_z && std::isfinite(z[i])) {
      sums[bin] += static_cast<double>(z[i]);
      ++summed[bin];
    }
  }
  std::string numbers(counts.size() * sizeof(counts[0]), '\0');
  std::memcpy(numbers.data(), counts.data(), numbers.size());
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const float mean =
        summed[i] > 0 ? static_cast<float>(sums[i] / static_cast<double>(summed[i])) : no_result();
    numbers.append(reinterpret_cast<const char*>(&mean), sizeof mean);
  }
  return numbers_answer(
      {{"study", id},
       {"x", side_json(x)},
       {"y", has_y ? side_json(y) : ordered_json(nullptr)},
       {"z", has_z ? ordered_json(*fields.text("z")) : ordered_json(nullptr)},
       {"points", inside},
       {"outside", outside},
       {"most", counts.empty() ? 0 : *std::max_element(counts.begin(), counts.end())}},
      numbers);
}

}  // namespace

AnswerPool::Job bins_job(std::uint64_t study, const Fields& fields) {
  return [study, fields](const AnswerDesk& desk) { return bins_answer(desk, study, fields); };
}

}  // namespace oblique::server
