#include "server/store/rows/old_rows.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/result_message.h"
#include "server/store/rows/model_rows.h"
#include "server/store/rows/row_columns.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::server {
namespace {

constexpr int kLastSchema = kFirstPacked - 1;

const std::vector<std::string_view>& names() {
  static const std::vector<std::string_view> all = result_columns(kLastSchema);
  return all;
}

int place_of(std::string_view name) {
  return static_cast<int>(std::find(names().begin(), names().end(), name) - names().begin());
}

/// Where the columns that every row has stand.
struct Places {
  int study_id = place_of("study_id");
  int point = place_of("point");
  int model_id = place_of("model_id");
  int H = place_of("H");
  int mu = place_of("mu");
  int e = place_of("e");
  int error = place_of("error");
  int peaks = place_of("peaks");
  int ft_peaks = place_of("ft_peaks");
  int phases = place_of("phases");
  int stick_intervals = place_of("stick_intervals");
  int reaction_peaks = place_of("reaction_peaks");
  int worker = place_of("worker");
  int solver_version = place_of("solver_version");
  int instruction_set = place_of("instruction_set");
  int attempt = place_of("attempt");
  int solved_at = place_of("solved_at");
};

const Places& places() {
  static const Places all;
  return all;
}

/// Where the scalars stand, in the order in which results are walked.
const std::vector<int>& scalar_places() {
  static const std::vector<int> all = [] {
    std::vector<int> found;
    const auto add = [&](const solver::ResultField& field, const auto&) {
      found.push_back(place_of(field.column));
    };
    solver::for_each_sent<double>(add);
    solver::for_each_sent<std::int64_t>(add);
    solver::for_each_sent<std::string>(add);
    return found;
  }();
  return all;
}

bool is_storable(double number) {
  return std::abs(number) <= protocol::kLargestOutput;  // no NaN is
}

/// Reads the JSON of a list: arrays of so many values in an array. The name of a kind of phase
/// becomes its number.
class ListText {
 public:
  ListText(std::string_view text, std::size_t per_element) : rest_(text), size_(per_element) {}

  /// False when the text is no such list.
  bool read(std::vector<double>& numbers) {
    numbers.clear();
    if (!take('[')) {
      return false;
    }
    if (take(']')) {
      return is_at_end();
    }
    do {
      if (!read_element(numbers)) {
        return false;
      }
    } while (take(','));
    return take(']') && is_at_end();
  }

 private:
  void pass_spaces() {
    while (!rest_.empty() && (rest_.front() == ' ' || rest_.front() == '\n')) {
      rest_.remove_prefix(1);
    }
  }
  bool take(char letter) {
    pass_spaces();
    const bool is_there = !rest_.empty() && rest_.front() == letter;
    rest_.remove_prefix(is_there ? 1 : 0);
    return is_there;
  }
  bool is_at_end() {
    pass_spaces();
    return rest_.empty();
  }
  bool read_element(std::vector<double>& numbers) {
    if (!take('[')) {
      return false;
    }
    for (std::size_t i = 0; i < size_; ++i) {
      if ((i > 0 && !take(',')) || !read_value(numbers)) {
        return false;
      }
    }
    return take(']');
  }
  bool read_value(std::vector<double>& numbers) {
    pass_spaces();
    if (rest_.starts_with('"')) {
      return read_kind(numbers);
    }
    double number = 0.0;
    const char* const end = rest_.data() + rest_.size();
    const auto [behind, error] = std::from_chars(rest_.data(), end, number);
    if (error != std::errc() || !is_storable(number)) {
      return false;
    }
    rest_.remove_prefix(static_cast<std::size_t>(behind - rest_.data()));
    numbers.push_back(number);
    return true;
  }

  bool read_kind(std::vector<double>& numbers) {
    rest_.remove_prefix(1);
    for (const auto kind : {solver::PhaseKind::kCompression, solver::PhaseKind::kRestitution}) {
      const std::string_view word = solver::phase_kind_name(kind);
      if (rest_.starts_with(word) && rest_.substr(word.size()).starts_with('"')) {
        rest_.remove_prefix(word.size() + 1);
        numbers.push_back(static_cast<double>(kind));
        return true;
      }
    }
    return false;
  }

  std::string_view rest_;
  std::size_t size_;
};

/// Phases follow each other from 0 to the end of the contact, compressions and restitutions in
/// turn: only then does what is stored tell them.
bool set_phases(const std::vector<double>& numbers, solver::CaseResult& result) {
  constexpr double kRounding = 1e-9;
  result.phases.clear();
  double end_s = 0.0;
  for (std::size_t i = 0; i < numbers.size(); i += 3) {
    const auto kind =
        (i / 3) % 2 == 0 ? solver::PhaseKind::kCompression : solver::PhaseKind::kRestitution;
    if (numbers[i] != static_cast<double>(kind) || numbers[i + 1] != end_s) {
      return false;
    }
    result.phases.push_back({kind, end_s, numbers[i + 2]});
    end_s = numbers[i + 2];
  }
  return result.phases.empty() ||
         std::abs(end_s - result.duration_s) <= kRounding * std::abs(result.duration_s);
}

}  // namespace

OldRows::OldRows(sqlite3* database, int schema)
    : schema_(schema), definition_(database, "SELECT definition FROM models WHERE model_id = ?") {}

std::string OldRows::columns_sql(int schema) {
  const auto there = result_columns(schema);
  std::string columns;
  for (const std::string_view name : names()) {
    const bool is_there = std::find(there.begin(), there.end(), name) != there.end();
    columns += fmt::format("{}{}", columns.empty() ? "" : ", ", is_there ? name : "NULL");
  }
  return columns;
}

std::string OldRows::solver_version(const Statement& row, int first) {
  return row.text(first + places().solver_version);
}

void OldRows::name_worker(const Statement& row, int first, OldWorkers& workers, PackedRow& packed) {
  if (row.is_null(first + places().solver_version)) {
    return;
  }
  PackedValue& worker = packed.at(packed_column("worker"));
  const std::int64_t number = worker.type == PackedValue::Type::kWhole ? worker.whole : 0;
  worker.type = PackedValue::Type::kWhole;
  worker.whole = workers.number_of(number, row.text(first + places().solver_version),
                                   row.text(first + places().instruction_set));
}

bool OldRows::pack(const Statement& row, int first, TextNumbers& texts, PackedRow& to) {
  const Places& at = places();
  const bool is_failed = !row.is_null(first + at.error);
  if (!is_failed && !read_outputs(row, first)) {
    return false;
  }
  const std::int64_t model_id = row.integer(first + at.model_id);
  const std::string solved_at = row.text(first + at.solved_at);
  const RowContext context{
      static_cast<std::uint64_t>(row.integer(first + at.study_id)),
      model_id,
      accuracy_of_model(model_id),
      {0, row.real(first + at.H), row.real(first + at.mu), row.real(first + at.e)},
      static_cast<std::uint64_t>(row.integer(first + at.point)),
      static_cast<std::uint64_t>(row.integer(first + at.worker)),
      static_cast<std::uint32_t>(row.integer(first + at.attempt)),
      solved_at};
  to.pack(context, is_failed ? nullptr : &result_, row.bytes(first + at.error), texts);
  return true;
}

bool OldRows::read_outputs(const Statement& row, int first) {
  result_ = {};
  bool is_whole = true;
  const int* place = scalar_places().data();
  const auto read = [&](const solver::ResultField& field, const auto& member, const auto& value) {
    const int column = first + *place++;
    if (!row.is_null(column)) {
      member.in(result_) = value(column);
    } else {
      is_whole = is_whole && (member.may_be_absent || field.since_schema > 1);
    }
  };
  solver::for_each_sent<double>([&](const auto& field, const auto& member) {
    read(field, member, [&](int column) {
      const double number = row.real(column);
      is_whole = is_whole && is_storable(number);
      return number;
    });
  });
  solver::for_each_sent<std::int64_t>([&](const auto& field, const auto& member) {
    read(field, member, [&](int column) { return row.integer(column); });
  });
  solver::for_each_sent<std::string>([&](const auto& field, const auto& member) {
    read(field, member, [&](int column) { return row.text(column); });
  });
  return is_whole && read_lists(row, first);
}

bool OldRows::read_lists(const Statement& row, int first) {
  const Places& at = places();
  bool is_whole = true;
  // Calls `take` with the place of each element's numbers, unless this or an earlier list is none.
  const auto each = [&](int column, std::size_t per_element, const auto& take) {
    is_whole = is_whole && ListText(row.bytes(first + column), per_element).read(numbers_);
    for (std::size_t i = 0; is_whole && i < numbers_.size(); i += per_element) {
      take(&numbers_[i]);
    }
  };
  each(at.peaks, 4, [&](const double* of) {
    result_.peaks.push_back({of[0], of[1], of[2], of[3] != 0.0});
  });
  each(at.ft_peaks, 2, [&](const double* of) { result_.ft_peaks.push_back({of[0], of[1]}); });
  each(at.stick_intervals, 2, [&](const double* of) {
    result_.stick_intervals.push_back({of[0], of[1]});
  });
  if (!row.is_null(first + at.reaction_peaks)) {
    each(at.reaction_peaks, 2, [&](const double* of) {
      result_.reaction_peaks.push_back({of[0], of[1]});
    });
  }
  each(at.phases, 3, [](const double* /*of*/) {});
  return is_whole && set_phases(numbers_, result_);
}

double OldRows::accuracy_of_model(std::int64_t model_id) {
  constexpr std::size_t kMostKnown = 65536;
  if (const auto known = accuracies_.find(model_id); known != accuracies_.end()) {
    return known->second;
  }
  double accuracy = 0.0;
  definition_.bind(1, model_id);
  if (definition_.step()) {
    try {
      accuracy = accuracy_of(model_of_definition(definition_.text(0), schema_));
    } catch (const std::runtime_error&) {
      // Of a model that cannot be read nothing is known: every digit is kept.
    }
  }
  definition_.reset();
  if (accuracies_.size() >= kMostKnown) {
    accuracies_.clear();
  }
  accuracies_.emplace(model_id, accuracy);
  return accuracy;
}

}  // namespace oblique::server
