#include "client/python/results.h"

#include <algorithm>
#include <limits>
#include <span>
#include <variant>

#include <pybind11/stl.h>

namespace oblique::python {
namespace {

namespace py = pybind11;
using solver::CaseResult;
using solver::Cell;
using solver::Member;

py::str text_of(std::string_view text) {
  return {text.data(), text.size()};
}

}  // namespace

void ResultArrays::Texts::set(std::size_t point, std::string_view text) {
  auto place = known.find(text);
  if (place == known.end()) {
    place = known.emplace(text, static_cast<std::int32_t>(texts.size())).first;
    texts.emplace_back(text);
  }
  codes[point] = place->second;
}

py::tuple ResultArrays::Texts::tuple() const {
  return py::make_tuple(texts, array_of(std::vector(codes)));
}

ResultArrays::ResultArrays(std::size_t points) : errors_(points) {
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

void ResultArrays::set(std::size_t point, const CaseResult& result) {
  const auto fields = solver::result_fields();
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto& value = fields[i].value;
    if (const auto* real = std::get_if<Member<double>>(&value); real && real->of(result)) {
      numbers_[i][point] = *real->of(result);
    }
    if (const auto* whole = std::get_if<Member<std::int64_t>>(&value); whole && whole->of(result)) {
      numbers_[i][point] = static_cast<double>(*whole->of(result));
    }
    if (const auto* text = std::get_if<Member<std::string>>(&value); text && text->of(result)) {
      texts_.at(i).set(point, *text->of(result));
    }
  }
  for (Elements& elements : lists_) {
    elements.begin[point] = elements.members.front().size();
    elements.list->each(result, [&](std::span<const Cell> element) {
      for (std::size_t i = 0; i < element.size(); ++i) {
        elements.members[i].push_back(number_of(elements, element[i]));
      }
      ++elements.count[point];
    });
  }
}

double ResultArrays::number_of(Elements& elements, const Cell& cell) {
  if (const auto* number = std::get_if<double>(&cell)) {
    return *number;
  }
  if (const auto* flag = std::get_if<bool>(&cell)) {
    return *flag ? 1.0 : 0.0;
  }
  const auto text = std::get<std::string_view>(cell);
  const auto found = std::find(elements.texts.begin(), elements.texts.end(), text);
  const auto place = found - elements.texts.begin();
  if (found == elements.texts.end()) {
    elements.texts.emplace_back(text);
  }
  return static_cast<double>(place);
}

// The elements are brought into the order of the points.
py::dict ResultArrays::dict_of(const Elements& elements) {
  const std::size_t points = elements.begin.size();
  std::vector<std::int64_t> offsets{0};
  for (const std::uint32_t count : elements.count) {
    offsets.push_back(offsets.back() + count);
  }
  py::dict named;
  for (std::size_t member = 0; member < elements.members.size(); ++member) {
    std::vector<double> values;
    values.reserve(static_cast<std::size_t>(offsets.back()));
    for (std::size_t i = 0; i < points; ++i) {
      const auto begin =
          elements.members[member].begin() + static_cast<std::ptrdiff_t>(elements.begin[i]);
      values.insert(values.end(), begin, begin + elements.count[i]);
    }
    named[text_of(elements.list->members[member])] = array_of(std::move(values));
  }
  named["offsets"] = array_of(std::move(offsets));
  named["texts"] = py::cast(elements.texts);
  return named;
}

py::dict ResultArrays::dict() {
  py::dict all;
  const auto fields = solver::result_fields();
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto& value = fields[i].value;
    if (std::holds_alternative<solver::ListPart>(value)) {
      continue;
    }
    const py::str group = text_of(fields[i].group);
    if (!fields[i].group.empty() && !all.contains(group)) {
      all[group] = py::dict();
    }
    py::dict named = fields[i].group.empty() ? all : py::dict(all[group]);
    if (std::holds_alternative<Member<std::string>>(value)) {
      named[text_of(fields[i].name)] = texts_.at(i).tuple();
    } else {
      named[text_of(fields[i].name)] = array_of(std::move(numbers_[i]));
    }
  }
  py::dict lists;
  for (const Elements& list : lists_) {
    lists[text_of(list.list->column)] = dict_of(list);
  }
  all["lists"] = lists;
  all["error"] = errors_.tuple();
  return all;
}

}  // namespace oblique::python
