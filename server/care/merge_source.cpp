#include "server/care/merge_source.h"

#include <spdlog/fmt/fmt.h>

#include "server/care/table_columns.h"

namespace oblique::server {

MergeSource::MergeSource(sqlite3* source, sqlite3* target, const StudyPlaces& places)
    : models_(source, target),
      workers_(source, target),
      origins_(source, target, places),
      target_texts_(target),
      texts_(source, target_texts_),
      read_(source,
            fmt::format("SELECT {}, checksum IS NOT NULL, (SELECT w.solver_version FROM workers AS"
                        " w WHERE w.worker_id = packed_results.worker), {} FROM packed_results"
                        " ORDER BY study_id, point",
                        result_soundness_sql() + " AND " + lists_are_sound_sql(),
                        fmt::join(packed_columns(), ", "))) {
  Statement points(source, "SELECT sum(points) FROM studies");
  rows_ = points.step() ? static_cast<std::uint64_t>(points.integer(0)) : 0;
}

bool MergeSource::next() {
  if (!read_.step()) {
    return false;
  }
  is_sound_ = read_.integer(0) != 0;
  has_checksum_ = read_.integer(1) != 0;
  solver_version_ = read_.text(2);
  row_.read(read_, 3);
  return true;
}

void MergeSource::take_references() {
  PackedValue& model = row_.at(model_id_);
  model.whole = models_.in_target(model.whole);
  if (PackedValue& worker = row_.at(worker_); worker.type != PackedValue::Type::kNull) {
    worker.whole = workers_.in_target(worker.whole);
  }
  if (PackedValue& origin = row_.at(taken_from_); origin.type != PackedValue::Type::kNull) {
    origin.text = origins_.in_target(origin.text);
  }
}

void MergeSource::take_texts() {
  for (const int column : text_columns_) {
    if (PackedValue& text = row_.at(column); text.type != PackedValue::Type::kNull) {
      text.whole = texts_.in_target(text.whole);
    }
  }
}

}  // namespace oblique::server
