#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/recipe/expression.h"
#include "worker/solver/model/errors.h"

namespace {

using oblique::expressions::Expression;

bool is_same(double a, double b) {
  return a == b || (a != a && b != b);
}

using Names = std::vector<std::string>;

/// Returns the value of an expression in which each name has the value 0.75, or nothing if the
/// expression is invalid. Appends the names to `names` in their order in the text.
std::optional<double> value_of(const std::string& text, Names& names) {
  try {
    const Expression expression(text, [&](std::string_view name) {
      names.emplace_back(name);
      return std::size_t{0};
    });
    return expression.value_at(std::vector{0.75});
  } catch (const oblique::solver::InputError&) {
    return std::nullopt;
  }
}

}  // namespace

/// Checks that an expression or filter has a value or causes an InputError. In brackets the same
/// text must have the same names and value, unless the brackets exceed a limit of length or depth.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  Names names;
  Names names_again;
  const std::optional<double> value = value_of(text, names);
  const std::optional<double> again = value_of("(" + text + ")", names_again);
  if (value && again && (names != names_again || !is_same(*value, *again))) {
    std::abort();
  }
  return 0;
}
