#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "proto/recipe/expressions/expression.h"
#include "worker/solver/model/errors.h"

namespace {

using oblique::expressions::Expression;

bool is_same(double a, double b) {
  return a == b || (a != a && b != b);
}

std::optional<Expression> read(const std::string& text) {
  try {
    return Expression(text);
  } catch (const oblique::solver::InputError&) {
    return std::nullopt;
  }
}

}  // namespace

/// An expression or a filter, as study files and recipes have them: a value or an InputError when
/// it is read. Its canonical text has the same value and is its own canonical text; it cannot be
/// read where it is longer than a text may be, as numbers may be longer in it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::optional<Expression> expression = read(text);
  if (!expression || expression->canonical().size() > oblique::expressions::kLongestText) {
    return 0;
  }
  Expression again(expression->canonical());
  const std::vector<double> values(expression->names().size(), 0.75);
  if (again.canonical() != expression->canonical() || again.names() != expression->names() ||
      !is_same(expression->value_at(values), again.value_at(values))) {
    std::abort();
  }
  return 0;
}
