#include "client/python/result_arrays.h"

#include <algorithm>
#include <span>
#include <variant>

namespace oblique::python {
namespace {

using solver::Member;

double number_of_cell(ListArrays& arrays, const solver::Cell& cell) {
  if (const auto* number = std::get_if<double>(&cell)) {
    return *number;
  }
  if (const auto* flag = std::get_if<bool>(&cell)) {
    return *flag ? 1.0 : 0.0;
  }
  const auto text = std::get<std::string_view>(cell);
  const auto found = std::find(arrays.texts.begin(), arrays.texts.end(), text);
  const auto place = found - arrays.texts.begin();
  if (found == arrays.texts.end()) {
    arrays.texts.emplace_back(text);
  }
  return static_cast<double>(place);
}

}  // namespace

void Texts::set(std::size_t point, std::string_view text) {
  auto known = known_.find(text);
  if (known == known_.end()) {
    known = known_.emplace(text, static_cast<std::uint32_t>(texts_.size())).first;
    texts_.emplace_back(text);
  }
  codes_[point] = known->second;
}

ResultArrays::ResultArrays(std::size_t points) : points_(points), errors_(points) {
  const auto fields = solver::result_fields();
  numbers_.resize(fields.size());
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto& value = fields[i].value;
    if (std::holds_alternative<Member<std::string>>(value)) {
      texts_.emplace(i, Texts(points));
    } else if (!std::holds_alternative<solver::ListPart>(value)) {
      numbers_[i].assign(points, std::numeric_limits<double>::quiet_NaN());
    }
  }
  for (const solver::ResultList* list : solver::result_lists()) {
    lists_.push_back({list,
                      std::vector<std::uint64_t>(points),
                      std::vector<std::uint32_t>(points),
                      std::vector<std::vector<double>>(list->members.size()),
                      {}});
  }
}

void ResultArrays::set(std::size_t point, const solver::CaseResult& result) {
  const auto fields = solver::result_fields();
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto& value = fields[i].value;
    if (const auto* real = std::get_if<Member<double>>(&value)) {
      if (const double* number = real->of(result)) {
        numbers_[i][point] = *number;
      }
    } else if (const auto* whole = std::get_if<Member<std::int64_t>>(&value)) {
      if (const std::int64_t* number = whole->of(result)) {
        numbers_[i][point] = static_cast<double>(*number);
      }
    } else if (const auto* text = std::get_if<Member<std::string>>(&value)) {
      if (const std::string* here = text->of(result)) {
        texts_.at(i).set(point, *here);
      }
    }
  }
  set_lists(point, result);
}

void ResultArrays::set_lists(std::size_t point, const solver::CaseResult& result) {
  for (ListArrays& arrays : lists_) {
    arrays.begin[point] = arrays.members.front().size();
    arrays.list->each(result, [&](std::span<const solver::Cell> element) {
      for (std::size_t i = 0; i < element.size(); ++i) {
        arrays.members[i].push_back(number_of_cell(arrays, element[i]));
      }
      ++arrays.count[point];
    });
  }
}

}  // namespace oblique::python
