#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "worker/solver/model/case_result.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::python {

/// Texts of many points, each different one kept once.
class Texts {
 public:
  explicit Texts(std::size_t points) : codes_(points, kNone) {}

  void set(std::size_t point, std::string_view text);
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  const std::vector<std::uint32_t>& codes() const { return codes_; }  ///< kNone: there is none
  const std::vector<std::string>& texts() const { return texts_; }    ///< by code

 private:
  std::vector<std::uint32_t> codes_;
  std::map<std::string, std::uint32_t, std::less<>> known_;
  std::vector<std::string> texts_;
};

/// One list of many points, element behind element in the order in which points came.
struct ListArrays {
  const solver::ResultList* list;
  std::vector<std::uint64_t> begin;  ///< of each point
  std::vector<std::uint32_t> count;
  /// One a member; a text is the place of its first element with the same text in `texts`.
  std::vector<std::vector<double>> members;
  std::vector<std::string> texts;
};

/// The outputs of many points, one array each: NaN and no text where there is none.
class ResultArrays {
 public:
  explicit ResultArrays(std::size_t points);

  /// Not from two threads at once.
  void set(std::size_t point, const solver::CaseResult& result);
  void set_error(std::size_t point, std::string_view error) { errors_.set(point, error); }

  std::size_t points() const { return points_; }
  /// By the place of the field in result_fields(); empty for fields of other kinds.
  std::vector<double>& numbers(std::size_t field) { return numbers_[field]; }
  const Texts& texts(std::size_t field) const { return texts_.at(field); }
  const std::vector<ListArrays>& lists() const { return lists_; }
  const Texts& errors() const { return errors_; }

 private:
  void set_lists(std::size_t point, const solver::CaseResult& result);

  std::size_t points_;
  std::vector<std::vector<double>> numbers_;
  std::map<std::size_t, Texts> texts_;
  std::vector<ListArrays> lists_;
  Texts errors_;
};

}  // namespace oblique::python
