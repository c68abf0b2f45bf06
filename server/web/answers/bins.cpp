#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/web/answers/fields.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/http_message.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;

constexpr std::uint64_t kUsualBins = 64;
/// Values within this relative distance of an end count as inside: users type 0.2 for 0.6 / 3.
constexpr double kEndTolerance = 1e-12;

/// A number as SQL text.
std::string sql_number(double value) {
  constexpr double kMost = std::numeric_limits<double>::max();
  return fmt::format("({})", solver::exact_real(std::clamp(value, -kMost, kMost)));
}

/// The bins along one column.
struct BinSide {
  std::string name;  ///< x or y
  PictureColumn column;
  std::uint64_t bins = kUsualBins;
  bool is_logarithmic = false;
  std::optional<double> typed_least = {};
  std::optional<double> typed_most = {};
  double least = 0.0;
  double most = 0.0;

  bool has_typed_ends() const { return typed_least && typed_most; }
  /// The SQL condition for rows whose value can be in a bin of this side.
  std::string has_place_sql() const {
    return fmt::format("{} {}", column.name, is_logarithmic ? "> 0" : "IS NOT NULL");
  }
  std::string is_inside_sql() const {
    const double slack_below =
        kEndTolerance * (is_logarithmic ? least : std::max(std::abs(least), std::abs(most)));
    const double slack_above = kEndTolerance * std::max(std::abs(least), std::abs(most));
    return fmt::format("{} BETWEEN {} AND {}", column.name, sql_number(least - slack_below),
                       sql_number(most + slack_above));
  }
  /// The SQL expression for the number of a row's bin.
  std::string bin_sql() const {
    const double first = place_of(least);
    const double width = place_of(most) - first;
    if (!(width > 0.0)) {
      return "0";
    }
    const std::string place = is_logarithmic ? fmt::format("ln({})", column.name) : column.name;
    return fmt::format("max(min(CAST(({} - {}) * {} AS INTEGER), {}), 0)", place, sql_number(first),
                       sql_number(static_cast<double>(bins) / width), bins - 1);
  }
  /// Sets the ends that the user did not give to those of `range`, the range of the column; it is
  /// empty if no row has a value. Equal ends make one bin. Throws std::invalid_argument for wrong
  /// ends.
  void set_ends(std::optional<std::pair<double, double>> range) {
    least = typed_least.value_or(range ? range->first : typed_most.value_or(0.0));
    most = typed_most.value_or(range ? range->second : least);
    const bool has_ends = range || typed_least || typed_most;
    if (least > most || (is_logarithmic && has_ends && least <= 0.0)) {
      throw std::invalid_argument(fmt::format(
          "{0}0 must be at most {0}1, and above 0 where the scale is logarithmic", name));
    }
    bins = most > least ? bins : 1;
  }
  ordered_json json() const {
    return {{"column", column.name}, {"unit", column.unit}, {"least", least},
            {"most", most},          {"bins", bins},        {"log", is_logarithmic}};
  }

 private:
  double place_of(double value) const {
    return is_logarithmic ? std::log(std::max(value, std::numeric_limits<double>::min())) : value;
  }
};

BinSide side_of(const FieldReader& fields, const std::string& name) {
  return {name,
          picture_column(fields, name, false),
          fields.cells("n" + name, kUsualBins),
          fields.text(name + "log").value_or("") == "1",
          fields.number(name + "0"),
          fields.number(name + "1")};
}

class BinsAnswer : public StudyAnswer {
 public:
  explicit BinsAnswer(const Fields& asked);

  Next next(const ServedStudy& study) override;
  void take_row(const protocol::ChunkRows& row) override;

 private:
  protocol::StudyQuery query() const;
  protocol::StudyQuery ends_query() const;
  protocol::StudyQuery counts_query();
  void take_ends(const protocol::ChunkRows& row);
  HttpAnswer answer(std::uint64_t study) const;

  std::vector<BinSide> sides_;
  std::optional<PictureColumn> z_;  // whose mean is requested
  bool has_ends_ = false;
  std::vector<std::uint32_t> counts_;  // empty while the ends are read
  std::vector<float> means_;
  std::uint64_t outside_ = 0;
};

BinsAnswer::BinsAnswer(const Fields& asked) : StudyAnswer(FieldReader(asked).condition()) {
  const FieldReader fields(asked);
  sides_.push_back(side_of(fields, "x"));
  if (fields.text("y")) {
    sides_.push_back(side_of(fields, "y"));
  }
  if (fields.text("z")) {
    z_ = picture_column(fields, "z", false);
  }
}

StudyAnswer::Next BinsAnswer::next(const ServedStudy& study) {
  if (!std::exchange(has_ends_, true)) {
    if (!std::ranges::all_of(sides_, &BinSide::has_typed_ends)) {
      return ends_query();
    }
    std::ranges::for_each(sides_, [](BinSide& side) { side.set_ends(std::nullopt); });
  }
  return counts_.empty() ? Next(counts_query()) : Next(answer(study.id));
}

/// A query of the solved points that meet the condition and have a value on all sides.
protocol::StudyQuery BinsAnswer::query() const {
  std::string where =
      condition().empty() ? "error IS NULL" : fmt::format("({}) AND error IS NULL", condition());
  for (const BinSide& side : sides_) {
    where += " AND " + side.has_place_sql();
  }
  protocol::StudyQuery query;
  query.set_where(where);
  return query;
}

protocol::StudyQuery BinsAnswer::ends_query() const {
  protocol::StudyQuery query = this->query();
  for (const BinSide& side : sides_) {
    query.add_select(fmt::format("min({0}), max({0})", side.column.name));
  }
  return query;
}

/// Counts by a query with one row per bin. Rows beyond the ends have the bin NULL.
protocol::StudyQuery BinsAnswer::counts_query() {
  std::size_t size = 1;
  std::string bin;
  std::string is_inside;
  for (const BinSide& side : sides_) {
    bin += fmt::format("{}{} * {}", bin.empty() ? "" : " + ", size, side.bin_sql());
    is_inside += (is_inside.empty() ? "" : " AND ") + side.is_inside_sql();
    size *= side.bins;
  }
  counts_.resize(size);
  means_.resize(z_ ? size : 0, std::numeric_limits<float>::quiet_NaN());
  protocol::StudyQuery query = this->query();
  query.add_select(fmt::format("CASE WHEN {} THEN {} END AS bin", is_inside, bin));
  query.add_select("count(*)");
  if (z_) {
    query.add_select(fmt::format("avg({})", z_->name));
  }
  query.set_group("bin");
  return query;
}

void BinsAnswer::take_row(const protocol::ChunkRows& row) {
  if (counts_.empty()) {
    take_ends(row);
    return;
  }
  const auto count = static_cast<std::uint64_t>(row.cell(1).integer);
  if (row.cell(0).kind == protocol::CellKind::kNull) {
    outside_ = count;
    return;
  }
  const auto place = static_cast<std::size_t>(row.cell(0).integer);
  counts_.at(place) = static_cast<std::uint32_t>(count);
  if (z_ && row.cell(2).kind != protocol::CellKind::kNull) {
    means_[place] = static_cast<float>(real_of(row.cell(2)));
  }
}

void BinsAnswer::take_ends(const protocol::ChunkRows& row) {
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    const protocol::Cell& least = row.cell(2 * i);
    sides_[i].set_ends(
        least.kind == protocol::CellKind::kNull
            ? std::nullopt
            : std::optional(std::pair(real_of(least), real_of(row.cell(2 * i + 1)))));
  }
}

HttpAnswer BinsAnswer::answer(std::uint64_t study) const {
  return numbers_answer(
      {{"study", study},
       {"x", sides_[0].json()},
       {"y", sides_.size() > 1 ? sides_[1].json() : ordered_json(nullptr)},
       {"z", z_ ? ordered_json(z_->name) : ordered_json(nullptr)},
       {"points", std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0})},
       {"outside", outside_},
       {"most", *std::ranges::max_element(counts_)}},
      bytes_of(counts_) + bytes_of(means_));
}

}  // namespace

PendingAnswer bins_answer(ServiceClient& service, std::uint64_t study, const Fields& fields) {
  return study_flow(service, study, std::make_unique<BinsAnswer>(fields));
}

}  // namespace oblique::server
