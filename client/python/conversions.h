#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "client/python/given_keys.h"
#include "client/python/result_arrays.h"

namespace oblique::python {

/// The keys that a dict has: texts, numbers, `lengths` a list, arrays of `points` doubles.
GivenKeys keys_of(const pybind11::dict& keys, std::size_t points);

/// One result as `oblique solve --json` has it, but for H, mu and e.
pybind11::dict dict_of(const CaseResult& result);

/// The same of many: an array for each number, a list of str and None for each text. Lists are
/// under `lists`, by the names that they have in a database: members, and `offsets` of each point.
pybind11::dict dict_of(ResultArrays&& arrays);

/// An array that takes the values over.
template <class T>
pybind11::array_t<T> array_of(std::vector<T>&& values) {
  auto* const owned = new std::vector<T>(std::move(values));  // the capsule deletes it
  const pybind11::capsule owner(owned,
                                [](void* kept) { delete static_cast<std::vector<T>*>(kept); });
  return pybind11::array_t<T>(static_cast<pybind11::ssize_t>(owned->size()), owned->data(), owner);
}

}  // namespace oblique::python
