#include "proto/recipe/expressions/expression.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include <muParserBase.h>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/exact_math/exponentials.h"
#include "proto/recipe/expressions/functions.h"
#include "worker/solver/model/errors.h"

namespace oblique::expressions {
namespace {

using solver::InputError;

/// From the weakest; what muParser calls them does not matter, for its own operators are off.
enum Priority { kOr = 1, kAnd, kNot, kComparison, kSum, kProduct, kSign, kPower };

double truth(bool value) {
  return value ? 1.0 : 0.0;
}
bool is_none(double a, double b) {
  return std::isnan(a) || std::isnan(b);
}
/// What follows from no number is none, also where it is compared: it must not pass for false.
double unless_none(double a, double b, bool value) {
  return is_none(a, b) ? std::numeric_limits<double>::quiet_NaN() : truth(value);
}

double sum(double a, double b) {
  return a + b;
}
double difference(double a, double b) {
  return a - b;
}
double product(double a, double b) {
  return a * b;
}
double quotient(double a, double b) {
  return a / b;
}
double negative(double a) {
  return -a;
}
double same(double a) {
  return a;
}
double negation(double a) {
  return unless_none(a, a, a == 0.0);
}
double conjunction(double a, double b) {
  return unless_none(a, b, a != 0.0 && b != 0.0);
}
double disjunction(double a, double b) {
  return unless_none(a, b, a != 0.0 || b != 0.0);
}
double less(double a, double b) {
  return unless_none(a, b, a < b);
}
double less_or_equal(double a, double b) {
  return unless_none(a, b, a <= b);
}
double greater(double a, double b) {
  return unless_none(a, b, a > b);
}
double greater_or_equal(double a, double b) {
  return unless_none(a, b, a >= b);
}
double equal(double a, double b) {
  return unless_none(a, b, a == b);
}
double unequal(double a, double b) {
  return unless_none(a, b, a != b);
}

/// muParser's way of reading a number: how many characters it took are added to `position`.
int read_value(const char* text, int* position, double* value) {
  const std::string_view rest(text);
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), *value);
  if (error != std::errc() || !(rest[0] == '.' || (rest[0] >= '0' && rest[0] <= '9'))) {
    return 0;
  }
  *position += static_cast<int>(end - rest.data());
  return 1;
}

}  // namespace

/// Has our operators, functions and numbers, and none of muParser's own.
class Expression::Parser : public mu::ParserBase {
 public:
  Parser() {
    InitCharSets();
    EnableBuiltInOprt(false);
    EnableOptimizer(false);
    InitFun();
    InitConst();
    InitOprt();
    AddValIdent(read_value);
  }

  void InitCharSets() override {
    DefineNameChars("0123456789_abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ");
    DefineOprtChars("+-*/^<>=!&|");
    DefineInfixOprtChars("+-!");
  }

  void InitFun() override {
    for (const Function& function : functions()) {
      const std::string name(function.name);
      if (function.of_one != nullptr) {
        DefineFun(name, function.of_one);
      } else if (function.of_two != nullptr) {
        DefineFun(name, function.of_two);
      } else {
        DefineFun(name, function.of_three);
      }
    }
  }

  void InitConst() override { DefineConst(std::string(kPiName), std::numbers::pi); }

  void InitOprt() override {
    DefineOprt("||", disjunction, kOr, mu::oaLEFT);
    DefineOprt("&&", conjunction, kAnd, mu::oaLEFT);
    DefineOprt("<", less, kComparison, mu::oaLEFT);
    DefineOprt("<=", less_or_equal, kComparison, mu::oaLEFT);
    DefineOprt(">", greater, kComparison, mu::oaLEFT);
    DefineOprt(">=", greater_or_equal, kComparison, mu::oaLEFT);
    DefineOprt("==", equal, kComparison, mu::oaLEFT);
    DefineOprt("!=", unequal, kComparison, mu::oaLEFT);
    DefineOprt("+", sum, kSum, mu::oaLEFT);
    DefineOprt("-", difference, kSum, mu::oaLEFT);
    DefineOprt("*", product, kProduct, mu::oaLEFT);
    DefineOprt("/", quotient, kProduct, mu::oaLEFT);
    DefineOprt("^", exact_math::pow_of, kPower, mu::oaRIGHT);
    DefineInfixOprt("-", negative, kSign);
    DefineInfixOprt("+", same, kSign);
    DefineInfixOprt("!", negation, kNot);
  }
};

Expression::Expression(std::string_view text)
    : text_(read_expression(text)),
      values_(text_.names.size(), 1.0),
      parser_(std::make_unique<Parser>()) {
  try {
    for (std::size_t i = 0; i < values_.size(); ++i) {
      parser_->DefineVar(text_.names[i], &values_[i]);
    }
    parser_->SetExpr(text_.canonical);
    int results = 0;
    parser_->Eval(results);
    if (results != 1) {
      throw InputError("it is a list of values: `,` stands between the arguments of a function");
    }
  } catch (const mu::ParserError& error) {
    throw InputError(fmt::format("it makes no expression: {}", error.GetMsg()));
  }
}

Expression::~Expression() = default;
Expression::Expression(Expression&&) noexcept = default;
Expression& Expression::operator=(Expression&&) noexcept = default;

double Expression::value_at(std::span<const double> values) {
  std::copy_n(values.begin(), values_.size(), values_.begin());
  try {
    return parser_->Eval();
  } catch (const mu::ParserError& error) {
    throw InputError(fmt::format("it has no value: {}", error.GetMsg()));
  }
}

}  // namespace oblique::expressions
