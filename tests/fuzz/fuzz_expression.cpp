#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "proto/recipe/expressions/expression.h"
#include "worker/solver/model/errors.h"

namespace {

using oblique::expressions::Expression;

bool is_same(double a, double b) {
  return a == b || (a != a && b != b);
}

}  // namespace

/// An expression or a filter, as study files and recipes have them: a value or an InputError. Its
/// canonical text has the same value and is its own canonical text.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    Expression expression(text);
    Expression again(expression.canonical());
    const std::vector<double> values(expression.names().size(), 0.75);
    if (again.canonical() != expression.canonical() || again.names() != expression.names() ||
        !is_same(expression.value_at(values), again.value_at(values))) {
      std::abort();
    }
  } catch (const oblique::solver::InputError&) {
  }
  return 0;
}
