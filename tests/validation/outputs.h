#pragma once

#include <functional>
#include <string>
#include <vector>

#include "worker/solver/model/case_result.h"

namespace oblique::validation {

/// One output of a case, and what an error in it is measured against.
struct Output {
  std::string name;
  std::string relative_to;
  std::function<std::vector<double>(const solver::CaseResult&)> values;
  /// The scale of value i; one for all of an output, or each value's own.
  std::function<double(const solver::CaseResult&, double value)> scale;
  /// False where the number of values depends on ripples.
  bool is_headline;
};

/// All outputs of a case that are numbers.
std::vector<Output> outputs();

/// Largest difference of one output between two results, relative to its scale in `right`. The
/// results must have equally many values.
double difference(const Output& output, const std::vector<double>& values,
                  const solver::CaseResult& right);

/// The same order of states, so that every output has equally many values.
bool have_same_turns(const solver::CaseResult& a, const solver::CaseResult& b);

}  // namespace oblique::validation
