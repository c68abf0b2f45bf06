#include "server/store/result_copy.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "server/store/rows/row_columns.h"

namespace oblique::server {
namespace {

std::string read_sql() {
  std::vector<std::string> columns;
  for (const std::string_view column : packed_columns()) {
    columns.push_back(fmt::format("r.{}", column));
  }
  return fmt::format(
      "SELECT r.checksum, {} FROM packed_results AS r CROSS JOIN workers AS w ON w.worker_id = "
      "r.worker"
      " WHERE r.study_id = ?1 AND r.point >= ?2 AND r.point < ?3 AND r.error IS NULL"
      " AND w.solver_version = ?4 ORDER BY r.point",
      fmt::join(columns, ", "));
}

void set_whole(PackedValue& value, std::uint64_t whole) {
  value.type = PackedValue::Type::kWhole;
  value.whole = static_cast<std::int64_t>(whole);
}

}  // namespace

ResultCopy::ResultCopy(sqlite3* database, SettledRuns& settled)
    : settled_(settled),
      name_(database, "SELECT name FROM studies WHERE study_id = ?"),
      read_(database, read_sql()),
      name_origin_(database, "INSERT OR IGNORE INTO origins (origin_id, name) VALUES (?, ?)"),
      count_(database,
             "INSERT INTO taken_points (study_id, origin_id, points) VALUES (?1, ?2, ?3)"
             " ON CONFLICT DO UPDATE SET points = points + excluded.points"),
      end_(database, "UPDATE studies SET takes_over = 0 WHERE study_id = ?"),
      insert_(database),
      models_(database, "SELECT 1 FROM models WHERE model_id = ?"),
      workers_(database,
               "SELECT 1 FROM workers WHERE worker_id = ? AND checksum = " + worker_checksum_sql()),
      texts_(database,
             "SELECT 1 FROM texts WHERE text_id = ? AND checksum = " + text_checksum_sql()) {}

bool ResultCopy::SoundNumbers::has(const PackedValue& number) {
  if (number.type == PackedValue::Type::kNull) {
    return true;
  }
  const auto [known, is_new] = known_.emplace(number.whole, false);
  if (is_new) {
    is_sound_.bind(1, number.whole);
    known->second = is_sound_.step();
    is_sound_.reset();
  }
  return known->second;
}

/// Whether the row that was read is the one that was stored.
bool ResultCopy::is_sound() {
  static const int kModel = packed_column("model_id");
  static const int kWorker = packed_column("worker");
  static const std::array<int, 3> kTexts{packed_column("mode"), packed_column("major_mode"),
                                         packed_column("margin_event")};
  return !read_.is_null(0) && read_.integer(0) == row_.checksum(checksum_) &&
         models_.has(row_.at(kModel)) && workers_.has(row_.at(kWorker)) &&
         std::all_of(kTexts.begin(), kTexts.end(),
                     [&](int column) { return texts_.has(row_.at(column)); });
}

/// Empty: there is none of that number any more.
std::string ResultCopy::name_of(std::uint64_t study_id) {
  name_.bind(1, study_id);
  std::string name = name_.step() ? name_.text(0) : std::string();
  name_.reset();
  return name;
}

void ResultCopy::run(const TakeResults& change) {
  *change.taken = {};
  if (name_of(change.study_id).empty()) {
    return;
  }
  change.taken->origin = name_of(change.source_id);
  if (change.taken->origin.empty()) {
    return;
  }
  models_.forget();
  workers_.forget();
  texts_.forget();
  for (const SharedRun& run : change.runs) {
    copy(change, run);
  }
  if (!change.taken->points.empty()) {
    name_origin_.bind(1, change.source_id);
    name_origin_.bind(2, change.taken->origin);
    name_origin_.run();
    count_.bind(1, change.study_id);
    count_.bind(2, change.source_id);
    count_.bind(3, change.taken->points.size());
    count_.run();
  }
}

void ResultCopy::end(const EndTaking& change) {
  end_.bind(1, change.study_id);
  end_.run();
}

void ResultCopy::copy(const TakeResults& change, const SharedRun& run) {
  static const int kStudy = packed_column("study_id");
  static const int kPoint = packed_column("point");
  static const int kTakenFrom = packed_column("taken_from");
  read_.reset();
  read_.bind(1, change.source_id);
  read_.bind(2, run.source_point);
  read_.bind(3, run.source_point + run.count);
  read_.bind(4, change.solver_version);
  while (read_.step()) {
    row_.read(read_, 1);
    if (!is_sound()) {
      continue;
    }
    const auto source_point = static_cast<std::uint64_t>(row_.at(kPoint).whole);
    const std::uint64_t point = run.point + (source_point - run.source_point);
    set_whole(row_.at(kStudy), change.study_id);
    set_whole(row_.at(kPoint), point);
    PackedValue& origin = row_.at(kTakenFrom);
    origin.type = PackedValue::Type::kText;
    origin.text = fmt::format("{}/{}", change.source_id, source_point);
    if (insert_.run(row_)) {
      change.taken->points.insert(point);
      settled_.add(change.study_id, point);
    }
  }
  read_.reset();
}

}  // namespace oblique::server
