#include "client/python/conversions.h"

#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <variant>

#include "worker/solver/model/result_fields.h"

namespace oblique::python {
namespace {

namespace py = pybind11;
using solver::Cell;
using solver::Member;

py::str text_of(std::string_view text) {
  return {text.data(), text.size()};
}

py::dict group_of(py::dict& all, std::string_view group) {
  if (group.empty()) {
    return all;
  }
  const py::str name = text_of(group);
  if (!all.contains(name)) {
    all[name] = py::dict();
  }
  return all[name];
}

py::object object_of(const Cell& cell) {
  if (const auto* text = std::get_if<std::string_view>(&cell)) {
    return text_of(*text);
  }
  if (const auto* flag = std::get_if<bool>(&cell)) {
    return py::bool_(*flag);
  }
  return py::float_(std::get<double>(cell));
}

py::object object_of(const solver::ResultList& list, std::span<const Cell> element) {
  py::dict named;
  py::list plain;
  for (std::size_t i = 0; i < element.size(); ++i) {
    if (list.has_names) {
      named[text_of(list.members[i])] = object_of(element[i]);
    } else {
      plain.append(object_of(element[i]));
    }
  }
  return list.has_names ? py::object(std::move(named)) : py::object(std::move(plain));
}

std::size_t place_of(const solver::ResultList& list, std::string_view member) {
  std::size_t place = 0;
  while (list.members[place] != member) {
    ++place;
  }
  return place;
}

py::object object_of(const CaseResult& result, const solver::ListPart& part) {
  py::list elements;
  part.list->each(result, [&](std::span<const Cell> element) {
    if (part.where.empty() || std::get<bool>(element[place_of(*part.list, part.where)])) {
      elements.append(part.member.empty() ? object_of(*part.list, element)
                                          : object_of(element[place_of(*part.list, part.member)]));
    }
  });
  return elements;
}

template <class T>
py::object object_of(const CaseResult& result, const Member<T>& member) {
  const T* value = member.of(result);
  return value == nullptr ? py::object(py::none()) : py::cast(*value);
}

py::list texts_of(const Texts& texts) {
  std::vector<py::str> each;
  for (const std::string& text : texts.texts()) {
    each.push_back(text_of(text));
  }
  py::list list(texts.codes().size());
  std::size_t place = 0;
  for (const std::uint32_t code : texts.codes()) {
    list[place++] = code == Texts::kNone ? py::object(py::none()) : py::object(each[code]);
  }
  return list;
}

/// Element behind element in the order of the points.
py::dict list_of(const ListArrays& arrays) {
  const std::size_t points = arrays.begin.size();
  std::vector<std::int64_t> offsets{0};
  for (const std::uint32_t count : arrays.count) {
    offsets.push_back(offsets.back() + count);
  }
  py::dict named;
  for (std::size_t member = 0; member < arrays.members.size(); ++member) {
    std::vector<double> values;
    values.reserve(static_cast<std::size_t>(offsets.back()));
    for (std::size_t i = 0; i < points; ++i) {
      const auto begin =
          arrays.members[member].begin() + static_cast<std::ptrdiff_t>(arrays.begin[i]);
      values.insert(values.end(), begin, begin + arrays.count[i]);
    }
    named[text_of(arrays.list->members[member])] = array_of(std::move(values));
  }
  named["offsets"] = array_of(std::move(offsets));
  named["texts"] = py::cast(arrays.texts);
  return named;
}

}  // namespace

GivenKeys keys_of(const py::dict& keys, std::size_t points) {
  GivenKeys given;
  given.points = points;
  for (const auto& [key, value] : keys) {
    const auto name = key.cast<std::string>();
    if (name == "preset") {
      given.preset = value.cast<std::string>();
    } else if (name == "lengths") {
      given.lengths_m = value.cast<std::vector<double>>();
    } else if (py::isinstance<py::str>(value)) {
      given.texts[name] = value.cast<std::string>();
    } else if (py::isinstance<py::array>(value)) {
      given.arrays[name] = value.cast<std::vector<double>>();
    } else {
      given.numbers[name] = value.cast<double>();
    }
  }
  return given;
}

py::dict dict_of(const CaseResult& result) {
  py::dict all;
  for (const auto& field : solver::result_fields()) {
    group_of(all, field.group)[text_of(field.name)] =
        std::visit([&](const auto& value) { return object_of(result, value); }, field.value);
  }
  return all;
}

py::dict dict_of(ResultArrays&& arrays) {
  py::dict all;
  const auto fields = solver::result_fields();
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto& value = fields[i].value;
    if (std::holds_alternative<solver::ListPart>(value)) {
      continue;
    }
    py::object column;
    if (std::holds_alternative<Member<std::string>>(value)) {
      column = texts_of(arrays.texts(i));
    } else {
      column = array_of(std::move(arrays.numbers(i)));
    }
    group_of(all, fields[i].group)[text_of(fields[i].name)] = column;
  }
  py::dict lists;
  for (const ListArrays& list : arrays.lists()) {
    lists[text_of(list.list->column)] = list_of(list);
  }
  all["lists"] = lists;
  all["error"] = texts_of(arrays.errors());
  return all;
}

}  // namespace oblique::python
