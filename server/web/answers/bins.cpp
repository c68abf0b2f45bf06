#include <algorithm>
#include <cmath>
#include <limits>
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
  /// empty if no row has a value. Throws std::invalid_argument for wrong ends.
  void set_ends(std::optional<std::pair<double, double>> range) {
    least = typed_least.value_or(range ? range->first : typed_most.value_or(0.0));
    most = typed_most.value_or(range ? range->second : least);
    const bool has_ends = range || typed_least || typed_most;
    if (least > most || (is_logarithmic && has_ends && least <= 0.0)) {
      throw std::invalid_argument(fmt::format(
          "{0}0 must be at most {0}1, and above 0 where the scale is logarithmic", name));
    }
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

struct Bins {
  std::vector<std::uint32_t> counts;
  std::vector<float> means;  ///< of the third column
  std::uint64_t outside = 0;
};

/// A query of the solved points that meet the condition and have a value on all sides.
protocol::StudyQuery query_of(const ServedStudy& study, const std::string& condition,
                              const std::vector<BinSide>& sides) {
  protocol::StudyQuery query;
  query.set_study(study.name);
  std::string where =
      condition.empty() ? "error IS NULL" : fmt::format("({}) AND error IS NULL", condition);
  for (const BinSide& side : sides) {
    where += " AND " + side.has_place_sql();
  }
  query.set_where(where);
  return query;
}

/// Sets the ends of the sides, by a query unless the user gave all of them.
void find_ends(const JobContext& context, const ServedStudy& study, const std::string& condition,
               std::vector<BinSide>& sides) {
  if (std::ranges::all_of(sides, &BinSide::has_typed_ends)) {
    std::ranges::for_each(sides, [](BinSide& side) { side.set_ends(std::nullopt); });
    return;
  }
  protocol::StudyQuery query = query_of(study, condition, sides);
  for (const BinSide& side : sides) {
    query.add_select(fmt::format("min({0}), max({0})", side.column.name));
  }
  context.query(query, condition, [&](const protocol::ChunkRows& row) {
    for (std::size_t i = 0; i < sides.size(); ++i) {
      const protocol::Cell& least = row.cell(2 * i);
      sides[i].set_ends(
          least.kind == protocol::CellKind::kNull
              ? std::nullopt
              : std::optional(std::pair(real_of(least), real_of(row.cell(2 * i + 1)))));
    }
  });
}

/// Counts by a query with one row per bin. Rows beyond the ends have the bin NULL.
Bins count_bins(const JobContext& context, const ServedStudy& study, const std::string& condition,
                const std::vector<BinSide>& sides, const std::optional<PictureColumn>& z) {
  std::size_t size = 1;
  std::string bin;
  std::string is_inside;
  for (const BinSide& side : sides) {
    bin += fmt::format("{}{} * {}", bin.empty() ? "" : " + ", size, side.bin_sql());
    is_inside += (is_inside.empty() ? "" : " AND ") + side.is_inside_sql();
    size *= side.bins;
  }
  Bins bins{std::vector<std::uint32_t>(size),
            std::vector<float>(z ? size : 0, std::numeric_limits<float>::quiet_NaN())};
  protocol::StudyQuery query = query_of(study, condition, sides);
  query.add_select(fmt::format("CASE WHEN {} THEN {} END AS bin", is_inside, bin));
  query.add_select("count(*)");
  if (z) {
    query.add_select(fmt::format("avg({})", z->name));
  }
  query.set_group("bin");
  context.query(query, condition, [&](const protocol::ChunkRows& row) {
    const auto count = static_cast<std::uint64_t>(row.cell(1).integer);
    if (row.cell(0).kind == protocol::CellKind::kNull) {
      bins.outside = count;
      return;
    }
    const auto place = static_cast<std::size_t>(row.cell(0).integer);
    bins.counts.at(place) = static_cast<std::uint32_t>(count);
    if (z && row.cell(2).kind != protocol::CellKind::kNull) {
      bins.means[place] = static_cast<float>(real_of(row.cell(2)));
    }
  });
  return bins;
}

HttpAnswer bins_answer(const JobContext& context, std::uint64_t id, const Fields& asked) {
  const FieldReader fields(asked);
  const std::string condition = fields.condition();
  std::vector<BinSide> sides{side_of(fields, "x")};
  if (fields.text("y")) {
    sides.push_back(side_of(fields, "y"));
  }
  std::optional<PictureColumn> z;
  if (fields.text("z")) {
    z = picture_column(fields, "z", false);
  }
  const ServedStudy study = context.study(id);
  find_ends(context, study, condition, sides);
  const Bins bins = count_bins(context, study, condition, sides, z);
  std::string numbers(reinterpret_cast<const char*>(bins.counts.data()),
                      bins.counts.size() * sizeof bins.counts[0]);
  numbers.append(reinterpret_cast<const char*>(bins.means.data()),
                 bins.means.size() * sizeof(float));
  return numbers_answer(
      {{"study", id},
       {"x", sides[0].json()},
       {"y", sides.size() > 1 ? sides[1].json() : ordered_json(nullptr)},
       {"z", z ? ordered_json(z->name) : ordered_json(nullptr)},
       {"points", std::accumulate(bins.counts.begin(), bins.counts.end(), std::uint64_t{0})},
       {"outside", bins.outside},
       {"most", *std::max_element(bins.counts.begin(), bins.counts.end())}},
      numbers);
}

}  // namespace

AnswerPool::Job bins_job(std::uint64_t study, const Fields& fields) {
  return [study, fields](const JobContext& context) { return bins_answer(context, study, fields); };
}

}  // namespace oblique::server
