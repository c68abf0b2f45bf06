#include "proto/recipe/expression.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include <strings.h>

#include <spdlog/fmt/fmt.h>

#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::expressions {
namespace {

using solver::InputError;

constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kLongestQuoted = 40;
constexpr const char* kComma = "`,` is allowed only between the arguments of a function";

/// Returns NaN if x[0] or x[1] is NaN, because an undefined condition must not count as false.
double truth(const double* x, bool value) {
  return std::isnan(x[0]) || std::isnan(x[1]) ? kUndefined : static_cast<double>(value);
}

constexpr std::array<Function, 23> kFunctions{{
    {"abs", 1, [](const double* x) { return std::abs(x[0]); }},
    {"sqrt", 1, [](const double* x) { return std::sqrt(x[0]); }},
    {"exp", 1, [](const double* x) { return std::exp(x[0]); }},
    {"log", 1, [](const double* x) { return std::log(x[0]); }},
    {"ln", 1, [](const double* x) { return std::log(x[0]); }},
    {"log2", 1, [](const double* x) { return std::log2(x[0]); }},
    {"log10", 1, [](const double* x) { return std::log10(x[0]); }},
    {"sin", 1, [](const double* x) { return std::sin(x[0]); }},
    {"cos", 1, [](const double* x) { return std::cos(x[0]); }},
    {"tan", 1, [](const double* x) { return std::tan(x[0]); }},
    {"asin", 1, [](const double* x) { return std::asin(x[0]); }},
    {"acos", 1, [](const double* x) { return std::acos(x[0]); }},
    {"atan", 1, [](const double* x) { return std::atan(x[0]); }},
    {"sinh", 1, [](const double* x) { return std::sinh(x[0]); }},
    {"cosh", 1, [](const double* x) { return std::cosh(x[0]); }},
    {"tanh", 1, [](const double* x) { return std::tanh(x[0]); }},
    {"pow", 2, [](const double* x) { return std::pow(x[0], x[1]); }},
    {"floor", 1, [](const double* x) { return std::floor(x[0]); }},
    {"ceil", 1, [](const double* x) { return std::ceil(x[0]); }},
    {"round", 1, [](const double* x) { return std::round(x[0]); }},
    {"min", 2, [](const double* x) { return std::isnan(x[0]) || x[0] < x[1] ? x[0] : x[1]; }},
    {"max", 2, [](const double* x) { return std::isnan(x[0]) || x[0] > x[1] ? x[0] : x[1]; }},
    {"if", 3, [](const double* x) { return std::isnan(x[0]) ? x[0]
                                           : x[0] != 0.0    ? x[1]
                                                            : x[2]; }},
}};

/// Precedence from the weakest to the strongest. `not` and signs apply to the value that follows.
enum Priority { kOr = 1, kAnd, kNot, kComparison, kSum, kProduct, kSign, kPower };

struct Operator {
  std::string_view sign;
  Priority priority;
  double (*compute)(const double* x);
};

/// Binary operators. The first match is used, so `<=` must precede `<`.
constexpr std::array<Operator, 15> kOperators{{
    {"||", kOr, [](const double* x) { return truth(x, x[0] != 0.0 || x[1] != 0.0); }},
    {"or", kOr, [](const double* x) { return truth(x, x[0] != 0.0 || x[1] != 0.0); }},
    {"&&", kAnd, [](const double* x) { return truth(x, x[0] != 0.0 && x[1] != 0.0); }},
    {"and", kAnd, [](const double* x) { return truth(x, x[0] != 0.0 && x[1] != 0.0); }},
    {"<=", kComparison, [](const double* x) { return truth(x, x[0] <= x[1]); }},
    {">=", kComparison, [](const double* x) { return truth(x, x[0] >= x[1]); }},
    {"==", kComparison, [](const double* x) { return truth(x, x[0] == x[1]); }},
    {"!=", kComparison, [](const double* x) { return truth(x, x[0] != x[1]); }},
    {"<", kComparison, [](const double* x) { return truth(x, x[0] < x[1]); }},
    {">", kComparison, [](const double* x) { return truth(x, x[0] > x[1]); }},
    {"+", kSum, [](const double* x) { return x[0] + x[1]; }},
    {"-", kSum, [](const double* x) { return x[0] - x[1]; }},
    {"*", kProduct, [](const double* x) { return x[0] * x[1]; }},
    {"/", kProduct, [](const double* x) { return x[1] == 0.0 ? kUndefined : x[0] / x[1]; }},
    {"^", kPower, [](const double* x) { return std::pow(x[0], x[1]); }},
}};

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
bool begins_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

/// Returns whether `word` is the operator `name`, ignoring case, as SQL does.
bool is_word(std::string_view word, std::string_view name) {
  return word.size() == name.size() && strncasecmp(word.data(), name.data(), name.size()) == 0;
}

std::string_view name_at(std::string_view text) {
  if (text.empty() || !begins_name(text[0])) {
    return {};
  }
  const auto* end = std::find_if_not(text.begin(), text.end(),
                                     [](char c) { return begins_name(c) || is_digit(c); });
  return text.substr(0, static_cast<std::size_t>(end - text.begin()));
}

}  // namespace

/// A parser by precedence climbing. Each function appends the steps for the text that it reads.
class Expression::Parser {
 public:
  Parser(std::string_view text, Expression& to, const MeaningOf& meaning_of)
      : rest_(text), to_(to), meaning_of_(meaning_of) {}

  void read() {
    if (next() == '\0') {
      throw InputError("it is empty");
    }
    read_operations(kOr);
    if (next() != '\0') {
      throw InputError(next() == ')' ? "it has a closing bracket without an opening one" : kComma);
    }
  }

 private:
  /// Returns the next character that is not a space; 0 at the end.
  char next() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t"), rest_.size()));
    return rest_.empty() ? '\0' : rest_[0];
  }
  bool take(char c) {
    const bool is_next = next() == c;
    rest_.remove_prefix(is_next ? 1 : 0);
    return is_next;
  }

  /// Returns the operator after a value; null at a bracket, a comma or the end.
  const Operator* next_operator() {
    const char c = next();
    const std::string_view word = name_at(rest_);
    const auto* found = std::find_if(kOperators.begin(), kOperators.end(), [&](const auto& o) {
      return word.empty() ? rest_.starts_with(o.sign) : is_word(word, o.sign);
    });
    if (found != kOperators.end()) {
      return found;
    }
    if (c == '\0' || c == ')' || c == ',') {
      return nullptr;
    }
    throw InputError(c == '='   ? "`=` is not an operator: use `==` to compare"
                     : c == '?' ? "`?` is not an operator: write if(e > 0.5, 0.4, 0.6)"
                                : fmt::format("an operator is missing before {}", quoted_next()));
  }

  /// Reads a value, and all operations after it that bind at least as strongly as `weakest`.
  void read_operations(int weakest) {
    read_value(weakest);
    bool is_compared = false;
    for (const Operator* op = next_operator(); op != nullptr && op->priority >= weakest;
         op = next_operator()) {
      if (op->priority == kComparison && is_compared) {
        throw InputError("a comparison has two values: write a < b && b < c");
      }
      is_compared = op->priority == kComparison;
      rest_.remove_prefix(op->sign.size());
      read_operations(op->priority == kPower ? kPower : op->priority + 1);
      to_.steps_.push_back({op->compute, 2});
    }
  }

  void read_value(int weakest) {
    const char c = next();
    const std::string_view word = name_at(rest_);
    if (is_digit(c) || c == '.') {
      read_number();
    } else if (take('(')) {
      read_operations(kOr);
      close();
    } else if (take('-')) {
      read_operations(kSign);
      to_.steps_.push_back({[](const double* x) { return 0.0 - *x; }, 1});
    } else if (take('+')) {
      read_operations(kSign);
    } else if ((c == '!' && !rest_.starts_with("!=")) || is_word(word, "not")) {
      if (weakest > kNot) {
        throw InputError("`not` after an operator needs brackets");
      }
      rest_.remove_prefix(std::max<std::size_t>(word.size(), 1));
      read_operations(kNot);
      to_.steps_.push_back({[](const double* x) { return std::isnan(*x) ? *x : *x == 0.0; }, 1});
    } else if (word.empty() || is_word(word, "and") || is_word(word, "or")) {
      throw InputError(c == '\0' ? "a value is missing at its end"
                                 : fmt::format("a value is missing before {}", quoted_next()));
    } else {
      read_name(word);
    }
  }

  /// Returns the next name or character, for a message.
  std::string quoted_next() const {
    const std::size_t bytes =
        std::max(name_at(rest_).size(), protocol::first_character(rest_).bytes);
    return fmt::format("`{}`", protocol::excerpt(rest_.substr(0, std::max<std::size_t>(bytes, 1)),
                                                 kLongestQuoted));
  }

  void close() {
    if (!take(')')) {
      throw InputError(next() == ',' ? kComma : "a bracket is not closed");
    }
  }

  void read_number() {
    double value = 0.0;
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (error != std::errc() || !std::isfinite(value)) {
      throw InputError(error == std::errc::result_out_of_range
                           ? "it has an invalid number: it is too small or too large"
                           : "it has an invalid number");
    }
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    if (!rest_.empty() && (begins_name(rest_[0]) || is_digit(rest_[0]) || rest_[0] == '.')) {
      throw InputError("an operator or a space is missing after a number");
    }
    to_.steps_.push_back({nullptr, 0, value});
  }

  void read_name(std::string_view name) {
    rest_.remove_prefix(name.size());
    const auto* function = std::find_if(kFunctions.begin(), kFunctions.end(),
                                        [&](const Function& f) { return f.name == name; });
    if (take('(')) {
      if (function == kFunctions.end()) {
        std::vector<std::string_view> known;
        std::ranges::transform(kFunctions, std::back_inserter(known), &Function::name);
        throw InputError(fmt::format("there is no function `{}`{}; the functions are {}",
                                     name.substr(0, kLongestQuoted),
                                     protocol::did_you_mean(name, known), protocol::joined(known)));
      }
      read_arguments(*function);
    } else if (function != kFunctions.end()) {
      throw InputError(fmt::format("`{}` is a function: put its arguments in brackets", name));
    } else if (name == "pi") {
      to_.steps_.push_back({nullptr, 0, std::numbers::pi});
    } else {
      to_.steps_.push_back({nullptr, 0, meaning_of_(name)});
    }
  }

  void read_arguments(const Function& function) {
    std::size_t count = 0;
    if (next() != ')') {
      do {
        read_operations(kOr);
        ++count;
      } while (take(','));
    }
    close();
    if (count != function.arguments) {
      throw InputError(fmt::format("`{}` takes {} argument{} and has {}", function.name,
                                   function.arguments, function.arguments == 1 ? "" : "s", count));
    }
    to_.steps_.push_back({function.compute, function.arguments});
  }

  std::string_view rest_;
  Expression& to_;
  const MeaningOf& meaning_of_;
};

std::span<const Function> functions() {
  return kFunctions;
}

Expression::Expression(std::string_view text, const MeaningOf& meaning_of) {
  if (text.size() > kLongestText) {
    throw InputError(
        fmt::format("it has {} bytes, and at most {} are allowed", text.size(), kLongestText));
  }
  Parser(text, *this, meaning_of).read();
}

double Expression::value_at(std::span<const double> values) const {
  std::array<double, kLongestText> stack;
  double* end = stack.data();
  for (const Step& step : steps_) {
    if (step.compute != nullptr) {
      end -= step.arguments;
      *end = step.compute(end);
    } else {
      const auto* number = std::get_if<double>(&step.pushed);
      *end = number != nullptr ? *number : values[*std::get_if<std::size_t>(&step.pushed)];
    }
    ++end;
  }
  const double value = stack.front();
  // A NaN may have a sign; this one has none.
  return std::isnan(value) ? kUndefined : value;
}

}  // namespace oblique::expressions
