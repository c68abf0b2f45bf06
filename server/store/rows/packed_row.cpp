#include "server/store/rows/packed_row.h"

#include <charconv>
#include <chrono>
#include <cmath>

#include <spdlog/fmt/fmt.h>

#include "server/store/rows/packed_lists.h"
#include "server/store/rows/row_columns.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

constexpr double kLargestExact = 9007199254740992.0;  // 2^53

void set(PackedValue& value, std::int64_t whole) {
  value.type = PackedValue::Type::kWhole;
  value.whole = whole;
}

void set(PackedValue& value, double real) {
  value.type = PackedValue::Type::kReal;
  value.real = real;
}

void set(PackedValue& value, std::string_view text) {
  value.type = PackedValue::Type::kText;
  value.text.assign(text);
}

void clear(PackedValue& value) {
  value.type = PackedValue::Type::kNull;
}

/// A multiple of the unit, whole where that is fine enough.
void set(PackedValue& value, const StoredUnit& unit, double number, const StoredDigits& digits) {
  const double multiple = number * unit.per_unit;
  // Nought is whole however fine it is to be.
  if ((multiple == 0.0 || digits.decimals(unit) == 0) && std::abs(multiple) < kLargestExact) {
    set(value, static_cast<std::int64_t>(std::round(multiple)));
  } else {
    set(value, multiple);
  }
}

/// So many digits of `text` from `at` on as a number; -1: they are none.
int digits_at(std::string_view text, std::size_t at, std::size_t count) {
  int number = -1;
  const char* const end = text.data() + at + count;
  const auto [rest, error] = std::from_chars(text.data() + at, end, number);
  return error == std::errc() && rest == end ? number : -1;
}

/// Milliseconds since 1970 of "2026-01-31T12:34:56.789Z"; nothing for any other text.
std::optional<std::int64_t> milliseconds_of(std::string_view text) {
  constexpr std::string_view kForm = "0000-00-00T00:00:00.000Z";
  if (text.size() != kForm.size()) {
    return std::nullopt;
  }
  for (std::size_t i = 0; i < kForm.size(); ++i) {
    const bool is_digit = text[i] >= '0' && text[i] <= '9';
    if (kForm[i] == '0' ? !is_digit : text[i] != kForm[i]) {
      return std::nullopt;
    }
  }
  namespace chrono = std::chrono;
  const chrono::year_month_day day{chrono::year(digits_at(text, 0, 4)),
                                   chrono::month(static_cast<unsigned>(digits_at(text, 5, 2))),
                                   chrono::day(static_cast<unsigned>(digits_at(text, 8, 2)))};
  const int hour = digits_at(text, 11, 2);
  const int minute = digits_at(text, 14, 2);
  const int second = digits_at(text, 17, 2);
  if (!day.ok() || hour > 23 || minute > 59 || second > 59) {
    return std::nullopt;
  }
  const auto instant = chrono::sys_days(day) + chrono::hours(hour) + chrono::minutes(minute) +
                       chrono::seconds(second) + chrono::milliseconds(digits_at(text, 20, 3));
  return chrono::duration_cast<chrono::milliseconds>(instant.time_since_epoch()).count();
}

}  // namespace

bool PackedValue::operator==(const PackedValue& other) const {
  if (type != other.type) {
    return false;
  }
  switch (type) {
    case Type::kWhole:
      return whole == other.whole;
    case Type::kReal:
      return real == other.real;
    case Type::kText:
      return text == other.text;
    case Type::kNull:
      break;
  }
  return true;
}

PackedRow::PackedRow() : values_(packed_columns().size()) {}

void PackedRow::pack(const RowContext& context, const solver::CaseResult* result,
                     std::string_view error, TextNumbers& texts) {
  next_ = 0;
  set(next(), static_cast<std::int64_t>(context.study_id));
  set(next(), static_cast<std::int64_t>(context.number));
  set(next(), context.model_id);
  for (const double input : {context.point.H_m, context.point.mu, context.point.e_star}) {
    PackedValue& value = next();
    if (std::isnan(input)) {
      clear(value);  // as SQLite has it; the table refuses the row
    } else {
      set(value, input);
    }
  }
  PackedValue& failure = next();
  if (result != nullptr) {
    clear(failure);
    pack_outputs(*result, context.accuracy, texts);
  } else {
    set(failure, error);
    const std::size_t end = static_cast<std::size_t>(packed_column("worker"));
    while (next_ < end) {
      clear(next());
    }
  }
  PackedValue& worker = next();
  if (context.worker_id == 0) {
    clear(worker);
  } else {
    set(worker, static_cast<std::int64_t>(context.worker_id));
  }
  set(next(), std::int64_t{context.attempt});
  PackedValue& solved_at = next();
  if (const auto instant_ms = milliseconds_of(context.solved_at)) {
    set(solved_at, *instant_ms);
  } else {
    set(solved_at, context.solved_at);
  }
  clear(next());  // taken_from: it was solved for this point
}

void PackedRow::pack_outputs(const solver::CaseResult& result, double accuracy,
                             TextNumbers& texts) {
  const StoredDigits digits(result, accuracy);
  const StoredUnit* unit = stored_units().data();  // they are in the order of the fields
  const auto put = [&](const auto* number, const auto& store) {
    PackedValue& value = next();
    if (number == nullptr) {
      clear(value);
    } else {
      store(value, *number);
    }
  };
  solver::for_each_stored<double>([&](const auto&, const auto& member) {
    put(member.of(result),
        [&](PackedValue& value, double number) { set(value, *unit, number, digits); });
    ++unit;
  });
  solver::for_each_stored<std::int64_t>([&](const auto&, const auto& member) {
    put(member.of(result), [](PackedValue& value, std::int64_t number) { set(value, number); });
  });
  solver::for_each_stored<std::string>([&](const auto&, const auto& member) {
    put(member.of(result),
        [&](PackedValue& value, const std::string& text) { set(value, texts.number_of(text)); });
  });
  pack_lists(result, digits);
}

void PackedRow::pack_lists(const solver::CaseResult& result, const StoredDigits& digits) {
  const auto list = [&](bool is_there, const auto& pack) {
    PackedValue& value = next();
    value.type = is_there ? PackedValue::Type::kText : PackedValue::Type::kNull;
    if (is_there) {
      pack(result, digits, value.text);
    }
  };
  list(true, pack_peaks);
  list(!ft_peaks_are_those_of_peaks(result), pack_ft_peaks);
  list(!result.phases.empty(), pack_phases);
  list(true, pack_stick_intervals);
  list(!result.reaction_peaks.empty(), pack_reaction_peaks);
}

void PackedRow::read(const Statement& row, int first) {
  for (PackedValue& value : values_) {
    switch (row.type(first)) {
      case SQLITE_INTEGER:
        set(value, row.integer(first));
        break;
      case SQLITE_FLOAT:
        set(value, row.real(first));
        break;
      case SQLITE_NULL:
        clear(value);
        break;
      default:
        set(value, row.bytes(first));
    }
    ++first;
  }
}

std::int64_t PackedRow::checksum(RowChecksum& sum) const {
  sum.clear();
  for (const PackedValue& value : values_) {
    switch (value.type) {
      case PackedValue::Type::kWhole:
        sum.add(value.whole);
        break;
      case PackedValue::Type::kReal:
        sum.add(value.real);
        break;
      case PackedValue::Type::kText:
        sum.add(std::string_view(value.text));
        break;
      case PackedValue::Type::kNull:
        sum.add_null();
    }
  }
  return sum.sum();
}

RowInsert::RowInsert(sqlite3* database)
    : database_(database), insert_(database, [] {
        std::string marks = "?1";
        for (std::size_t i = 2; i <= packed_columns().size() + 1; ++i) {
          marks += fmt::format(", ?{}", i);
        }
        // Only a point that is there already is passed over; any other conflict is an error.
        return fmt::format(
            "INSERT INTO packed_results ({}, checksum) VALUES ({})"
            " ON CONFLICT (study_id, point) DO NOTHING",
            fmt::join(packed_columns(), ", "), marks);
      }()) {}

bool RowInsert::run(const PackedRow& row, bool with_checksum) {
  insert_.reset();
  int index = 1;
  for (const PackedValue& value : row.values()) {
    switch (value.type) {
      case PackedValue::Type::kWhole:
        insert_.bind(index, value.whole);
        break;
      case PackedValue::Type::kReal:
        insert_.bind(index, value.real);
        break;
      case PackedValue::Type::kText:
        insert_.bind_lasting(index, value.text);
        break;
      case PackedValue::Type::kNull:
        break;
    }
    ++index;
  }
  if (with_checksum) {
    insert_.bind(index, row.checksum(checksum_));
  }
  insert_.run();
  return sqlite3_changes(database_) > 0;
}

}  // namespace oblique::server
