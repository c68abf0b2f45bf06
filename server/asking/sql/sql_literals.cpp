#include "server/asking/sql/sql_literals.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>

#include <spdlog/fmt/fmt.h>

#include "server/asking/sql/sql_tokens.h"
#include "worker/solver/model/number.h"

namespace oblique::server {
namespace {

/// What SQLite makes of a number; nothing where it is none.
std::optional<double> as_sqlite_reads(sqlite3* database, std::string_view number) {
  sqlite3_stmt* raw = nullptr;
  const std::string sql = fmt::format("SELECT {}", number);
  sqlite3_prepare_v2(database, sql.c_str(), -1, &raw, nullptr);
  const std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> statement(raw, &sqlite3_finalize);
  if (raw == nullptr || sqlite3_step(raw) != SQLITE_ROW ||
      sqlite3_column_type(raw, 0) != SQLITE_FLOAT) {
    return std::nullopt;
  }
  return sqlite3_column_double(raw, 0);
}

/// A whole number of 53 bits over powers of two: every step is exact. Empty where it would not be.
std::string as_fraction(double value) {
  constexpr int kDigits = 53;
  constexpr int kMostShift = 60;
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);
  const auto whole = static_cast<std::int64_t>(std::ldexp(mantissa, kDigits));
  int shift = kDigits - exponent;
  if (shift < 0 || shift > 2 * kMostShift) {
    return {};
  }
  std::string text = fmt::format("({} * 1.0", whole);
  for (; shift > 0; shift -= kMostShift) {
    text += fmt::format(" / (1 << {})", std::min(shift, kMostShift));
  }
  return text + ")";
}

}  // namespace

std::string with_exact_numbers(sqlite3* database, std::string_view text) {
  std::string exact;
  std::size_t copied = 0;
  for (const SqlToken& token : sql_tokens(text)) {
    const bool may_be_rounded =
        token.kind == SqlToken::Kind::kLiteral &&
        token.text.find_first_of(".eE") != std::string_view::npos &&
        token.text.find_first_not_of("0123456789.eE+-") == std::string_view::npos;
    const auto nearest = may_be_rounded ? solver::number_of(token.text) : std::nullopt;
    const auto read = nearest ? as_sqlite_reads(database, token.text) : std::nullopt;
    const std::string fraction = read && *read != *nearest ? as_fraction(*nearest) : "";
    if (!fraction.empty()) {
      const auto begin = static_cast<std::size_t>(token.text.data() - text.data());
      exact += text.substr(copied, begin - copied);
      exact += fraction;
      copied = begin + token.text.size();
    }
  }
  exact += text.substr(copied);
  return exact;
}

}  // namespace oblique::server
