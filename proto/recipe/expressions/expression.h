#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/recipe/expressions/expression_text.h"

namespace oblique::expressions {

/// An expression made fit for computing. Arithmetic is that of doubles, functions and powers are
/// those of exact_math: the result is the same bits on every machine. Not thread-safe: one for each
/// thread.
class Expression {
 public:
  /// Throws solver::InputError as `read_expression` does, and for tokens that make no expression.
  explicit Expression(std::string_view text);
  ~Expression();
  Expression(Expression&&) noexcept;
  Expression& operator=(Expression&&) noexcept;

  const std::string& canonical() const { return text_.canonical; }
  /// What `value_at` wants values for, in this order.
  const std::vector<std::string>& names() const { return text_.names; }

  /// May be NaN or infinite. A comparison is 1 or 0.
  double value_at(std::span<const double> values);

 private:
  class Parser;
  ExpressionText text_;
  std::vector<double> values_;  // the parser reads them
  std::unique_ptr<Parser> parser_;
};

}  // namespace oblique::expressions
