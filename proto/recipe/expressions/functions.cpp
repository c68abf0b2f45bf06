#include "proto/recipe/expressions/functions.h"

#include <array>
#include <cmath>

#include "proto/recipe/exact_math/exponentials.h"
#include "proto/recipe/exact_math/trigonometry.h"

namespace oblique::expressions {
namespace {

namespace exact = exact_math;

double absolute(double x) {
  return std::abs(x);
}
/// Of IEEE 754: rounded once wherever it is computed.
double root(double x) {
  return std::sqrt(x);
}
double floor_of(double x) {
  return std::floor(x);
}
double ceil_of(double x) {
  return std::ceil(x);
}
double round_of(double x) {
  return std::round(x);
}
/// What is no number stays visible, as in sums.
double least(double a, double b) {
  return std::isnan(a) || a < b ? a : b;
}
double greatest(double a, double b) {
  return std::isnan(a) || a > b ? a : b;
}
double choice(double condition, double a, double b) {
  return std::isnan(condition) ? condition : condition != 0.0 ? a : b;
}

constexpr std::array<Function, 22> kFunctions{{
    {"abs", absolute},          {"sqrt", root},
    {"exp", exact::exp_of},     {"log", exact::log_of},
    {"ln", exact::log_of},      {"log2", exact::log2_of},
    {"log10", exact::log10_of}, {"sin", exact::sin_of},
    {"cos", exact::cos_of},     {"tan", exact::tan_of},
    {"asin", exact::asin_of},   {"acos", exact::acos_of},
    {"atan", exact::atan_of},   {"sinh", exact::sinh_of},
    {"cosh", exact::cosh_of},   {"tanh", exact::tanh_of},
    {"floor", floor_of},        {"ceil", ceil_of},
    {"round", round_of},        {"min", nullptr, least},
    {"max", nullptr, greatest}, {"if", nullptr, nullptr, choice},
}};
}  // namespace

std::span<const Function> functions() {
  return kFunctions;
}

}  // namespace oblique::expressions
