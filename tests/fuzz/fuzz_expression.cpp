#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "proto/recipe/expression.h"
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

/// An expression or a filter, as study files and recipes have them, gives a value or an InputError.
/// In brackets it has the same names and value, unless it then is too long or too deep.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::optional<Expression> expression = read(text);
  if (!expression) {
    return 0;
  }
  const std::vector<double> values(expression->names().size(), 0.75);
  const double value = expression->value_at(values);
  std::optional<Expression> again = read("(" + text + ")");
  if (again &&
      (again->names() != expression->names() || !is_same(value, again->value_at(values)))) {
    std::abort();
  }
  return 0;
}
