#include "server/web/answers/point_filter.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/axes.h"
#include "server/query/columns.h"
#include "server/query/point_ranges.h"
#include "server/query/sql_text.h"
#include "server/web/answers/fields.h"
#include "server/web/answers/grid.h"
#include "worker/solver/model/errors.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

using solver::exact_number;

/// As questions call an axis; empty: they have no column that is it.
std::string column_of_axis(const std::string& key) {
  const std::string column = column_of_key(key);
  const bool is_of_point = key == "H" || key == "mu" || key == "e";
  const auto source = column_source(column);
  return is_of_point || (source && source->is_of_model) ? column : std::string();
}

/// Empty: all values of the axis are looked at.
std::string side_sql(const GridSide& side) {
  const std::string column = column_of_axis(side.key);
  if (column.empty() || side.last - side.first + 1 == side.of) {
    return {};
  }
  const auto [least, most] = std::minmax_element(side.values.begin(), side.values.end());
  return fmt::format(" AND {} BETWEEN {} AND {}", column, exact_number(*least),
                     exact_number(*most));
}

/// What keeps a reader from looking at what a slice does not show. It need not leave out all of it.
std::string narrowing(const protocol::PointTable& table, const GridSlice& slice) {
  std::string sql = side_sql(slice.x) + side_sql(slice.y);
  for (const GridPlace& place : slice.at) {
    const std::string column = column_of_axis(place.key);
    if (!column.empty() && place.of > 1) {
      sql += fmt::format(" AND {} = {}", column, exact_number(place.value));
    }
  }
  if (table.recipe().blocks_size() > 1) {
    const auto& block = table.block(slice.block);
    sql += fmt::format(" AND point BETWEEN {} AND {}", block.first_point,
                       block.first_point + std::max<std::uint64_t>(block.points, 1) - 1);
  }
  return sql;
}

/// Whether reading what the narrowed condition leaves costs much less than reading all that the
/// condition leaves, which serves every slice of the study. Points that lie apart are read with
/// what lies between them.
bool is_worth_it(const LookedAtStudy& study, const FilterQuestion& question) {
  constexpr std::uint64_t kMuch = 8;
  constexpr int kManyBlocks = 1000;  // too many to look through
  const auto points_read = [&](const std::string& condition) {
    return points_in(point_ranges(study.table->recipe(), condition));
  };
  return study.points > ColumnStore::kMostPoints ||
         study.table->recipe().blocks_size() > kManyBlocks ||
         points_read(question.narrowed) <= points_read(question.condition) / kMuch;
}

HttpAnswer filter_answer(const AnswerDesk& desk, std::uint64_t id, const Fields& asked,
                         bool is_slice, FilterQuestion& question) {
  const LookedAtStudy study = desk.studies.study(desk.database, id);
  const FieldReader fields(asked);
  question.condition = fields.text("where").value_or("");
  try {
    check_sql_part("--where", question.condition, SqlPart::kCondition);
  } catch (const solver::InputError& error) {
    throw std::invalid_argument(error.what());
  }
  question.narrowed = question.condition;
  if (is_slice) {
    static_cast<void>(picture_column(fields, "z", true));
    question.narrowed = fmt::format("({}){}", question.condition,
                                    narrowing(*study.table, grid_slice(*study.table, fields)));
    if (!is_worth_it(study, question)) {
      question.narrowed = question.condition;
    }
  } else {
    for (const std::string name : {"x", "y", "z"}) {
      if (name == "x" || fields.text(name)) {
        static_cast<void>(picture_column(fields, name, false));
      }
    }
  }
  return {AnswerPool::kStep, {}, {}};
}

}  // namespace

AnswerPool::Job filter_job(std::uint64_t study, const Fields& fields, bool is_slice,
                           std::shared_ptr<FilterQuestion> question) {
  return [study, fields, is_slice, question = std::move(question)](const AnswerDesk& desk) {
    return filter_answer(desk, study, fields, is_slice, *question);
  };
}

}  // namespace oblique::server
