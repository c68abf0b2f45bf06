#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/web/answers/fields.h"
#include "server/web/answers/study_answers.h"
#include "server/web/http/json_answer.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

using nlohmann::ordered_json;

constexpr std::uint64_t kUsualBins = 64;
/// Values this close to an end, relative to it, are in the bins: people type 0.2 for 0.6 / 3.
constexpr double kEndTolerance = 1e-12;

double real_of(const protocol::Cell& cell) {
  return cell.kind == protocol::CellKind::kInteger ? static_cast<double>(cell.integer) : cell.real;
}

/// A number in SQL.
std::string sql_number(double value) {
  return fmt::format("({})", solver::exact_real(value));
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

  /// Rows that have a place on this side.
  std::string has_place_sql() const {
    return fmt::format("{} {}", column.name, is_logarithmic ? "> 0" : "IS NOT NULL");
  }
  std::string is_inside_sql() const {
    const double slack = kEndTolerance * std::max(std::abs(least), std::abs(most));
    return fmt::format("{} BETWEEN {} AND {}", column.name,
                       sql_number(is_logarithmic ? least * (1.0 - kEndTolerance) : least - slack),
                       sql_number(most + slack));
  }
  /// The number of a row's bin.
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
  /// Takes the ends that were not typed from the range of the column; `range` is empty if no row
  /// has a place. Throws std::invalid_argument for wrong ends.
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

/// What lies where.
struct Bins {
  std::vector<std::uint32_t> counts;
  std::vector<float> means;      ///< of the third column
  std::uint64_t inside = 0;      ///< rows in the bins
  std::uint64_t with_place = 0;  ///< rows in and beside them
};

/// Two queries: the ranges of the columns, then the bins.
class BinQuery {
 public:
  BinQuery(const JobContext& context, const ServedStudy& study, std::string condition,
           std::vector<BinSide>& sides)
      : context_(context), study_(study), condition_(std::move(condition)), sides_(sides) {}

  Bins run(const std::optional<PictureColumn>& z) {
    const std::uint64_t with_place = find_ranges();
    const std::size_t size = sides_[0].bins * (sides_.size() > 1 ? sides_[1].bins : 1);
    Bins bins{std::vector<std::uint32_t>(size),
              std::vector<float>(z ? size : 0, std::numeric_limits<float>::quiet_NaN()), 0,
              with_place};
    protocol::StudyQuery query = base_query();
    query.add_select(sides_.size() > 1 ? fmt::format("{} + {} * {} AS bin", sides_[0].bin_sql(),
                                                     sides_[0].bins, sides_[1].bin_sql())
                                       : fmt::format("{} AS bin", sides_[0].bin_sql()));
    query.add_select("count(*)");
    if (z) {
      query.add_select(fmt::format("avg({})", z->name));
    }
    query.set_group("bin");
    for (const BinSide& side : sides_) {
      query.set_where(query.where() + " AND " + side.is_inside_sql());
    }
    context_.query(query, [&](const protocol::ChunkRows& row) {
      const auto bin = static_cast<std::size_t>(row.cell(0).integer);
      bins.counts.at(bin) = static_cast<std::uint32_t>(row.cell(1).integer);
      bins.inside += bins.counts[bin];
      if (z && row.cell(2).kind != protocol::CellKind::kNull) {
        bins.means[bin] = static_cast<float>(real_of(row.cell(2)));
      }
    });
    return bins;
  }

 private:
  protocol::StudyQuery base_query() const {
    protocol::StudyQuery query;
    query.set_study(study_.name);
    query.set_where(condition_.empty() ? "error IS NULL"
                                       : fmt::format("({}) AND error IS NULL", condition_));
    for (const BinSide& side : sides_) {
      query.set_where(query.where() + " AND " + side.has_place_sql());
    }
    return query;
  }

  /// Sets the ends of the sides. Returns how many rows have a place on all of them.
  std::uint64_t find_ranges() {
    protocol::StudyQuery query = base_query();
    query.add_select("count(*)");
    for (const BinSide& side : sides_) {
      query.add_select(fmt::format("min({0}), max({0})", side.column.name));
    }
    std::uint64_t rows = 0;
    query_with_condition(context_, query, condition_, [&](const protocol::ChunkRows& row) {
      rows = static_cast<std::uint64_t>(row.cell(0).integer);
      for (std::size_t i = 0; i < sides_.size(); ++i) {
        sides_[i].set_ends(rows == 0 ? std::nullopt
                                     : std::optional(std::pair(real_of(row.cell(1 + 2 * i)),
                                                               real_of(row.cell(2 + 2 * i)))));
      }
    });
    return rows;
  }

  const JobContext& context_;
  const ServedStudy& study_;
  const std::string condition_;
  std::vector<BinSide>& sides_;
};

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
  const Bins bins = BinQuery(context, study, condition, sides).run(z);
  std::string numbers(reinterpret_cast<const char*>(bins.counts.data()),
                      bins.counts.size() * sizeof bins.counts[0]);
  numbers.append(reinterpret_cast<const char*>(bins.means.data()),
                 bins.means.size() * sizeof(float));
  return numbers_answer({{"study", id},
                         {"x", sides[0].json()},
                         {"y", sides.size() > 1 ? sides[1].json() : ordered_json(nullptr)},
                         {"z", z ? ordered_json(z->name) : ordered_json(nullptr)},
                         {"points", bins.inside},
                         {"outside", bins.with_place - bins.inside},
                         {"most", *std::max_element(bins.counts.begin(), bins.counts.end())}},
                        numbers);
}

}  // namespace

AnswerPool::Job bins_job(std::uint64_t study, const Fields& fields) {
  return [study, fields](const JobContext& context) { return bins_answer(context, study, fields); };
}

}  // namespace oblique::server
