#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "worker/solver/model/case_result.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::python {

/// An array that takes over the values.
template <class T>
pybind11::array_t<T> array_of(std::vector<T>&& values) {
  auto* const owned = new std::vector<T>(std::move(values));  // the capsule deletes it
  const pybind11::capsule owner(owned,
                                [](void* kept) { delete static_cast<std::vector<T>*>(kept); });
  return pybind11::array_t<T>(static_cast<pybind11::ssize_t>(owned->size()), owned->data(), owner);
}

/// The outputs of many points, an array each: NaN and no text where there is none.
class ResultArrays {
 public:
  explicit ResultArrays(std::size_t points);

  /// Not from two threads at once; without the interpreter's lock.
  void set(std::size_t point, const solver::CaseResult& result);
  void set_error(std::size_t point, std::string_view error) { errors_.set(point, error); }

  /// The names of `oblique solve --json` with an array for each number, (texts, index of each
  /// point's text or -1) for each text, and `error`. `lists` has an array for each member of a
  /// list, and the `offsets` of the points. Moves the numbers out.
  pybind11::dict dict();

 private:
  /// Texts of many points; equal ones are stored once.
  struct Texts {
    explicit Texts(std::size_t points) : codes(points, -1) {}
    void set(std::size_t point, std::string_view text);
    pybind11::tuple tuple() const;

    std::vector<std::int32_t> codes;
    std::map<std::string, std::int32_t, std::less<>> known;
    std::vector<std::string> texts;
  };
  /// One list of many points, in the order in which the points came.
  struct Elements {
    const solver::ResultList* list;
    std::vector<std::uint64_t> begin;  ///< of each point
    std::vector<std::uint32_t> count;
    /// One a member; a text is the index of its first occurrence in `texts`.
    std::vector<std::vector<double>> members;
    std::vector<std::string> texts;
  };
  static double number_of(Elements& elements, const solver::Cell& cell);
  static pybind11::dict dict_of(const Elements& elements);

  std::vector<std::vector<double>> numbers_;  ///< by field; empty for fields of other kinds
  std::map<std::size_t, Texts> texts_;        ///< by field
  std::vector<Elements> lists_;
  Texts errors_;
};

}  // namespace oblique::python
