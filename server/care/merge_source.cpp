#include "server/care/merge_source.h"

#include <array>

#include <spdlog/fmt/fmt.h>

#include "server/care/merged_origins.h"
#include "server/care/merged_references.h"
#include "server/care/table_columns.h"
#include "server/store/rows/old_rows.h"
#include "server/store/rows/old_workers.h"
#include "server/store/rows/row_columns.h"

namespace oblique::server {
namespace {

std::uint64_t number(sqlite3* database, const char* sql) {
  Statement statement(database, sql);
  return statement.step() ? static_cast<std::uint64_t>(statement.integer(0)) : 0;
}

/// Models and workers of the present row.
class References {
 public:
  References(sqlite3* source, sqlite3* target)
      : models_(source, target), workers_(source, target) {}

  void map(PackedRow& row) {
    PackedValue& model = row.at(model_id_);
    model.whole = models_.in_target(model.whole);
    PackedValue& worker = row.at(worker_);
    if (worker.type != PackedValue::Type::kNull) {
      worker.whole = workers_.in_target(worker.whole);
    }
  }

 private:
  const int model_id_ = packed_column("model_id");
  const int worker_ = packed_column("worker");
  MergedModels models_;
  MergedWorkers workers_;
};

class PackedSource final : public MergeSource {
 public:
  PackedSource(sqlite3* source, sqlite3* target, const StudyPlaces& places)
      : references_(source, target),
        origins_(source, target, places),
        target_texts_(target),
        texts_(source, target_texts_),
        read_(
            source,
            fmt::format("SELECT {}, checksum IS NOT NULL, (SELECT w.solver_version FROM workers AS"
                        " w WHERE w.worker_id = packed_results.worker), {} FROM packed_results"
                        " ORDER BY study_id, point",
                        result_soundness_sql(schema_of(source)) + " AND " + lists_are_sound_sql(),
                        fmt::join(packed_columns(), ", "))) {
    rows_ = number(source, "SELECT sum(points) FROM studies");
  }

  bool next() override {
    if (!read_.step()) {
      return false;
    }
    is_sound_ = read_.integer(0) != 0;
    has_checksum_ = read_.integer(1) != 0;
    solver_version_ = read_.text(2);
    row_.read(read_, 3);
    return true;
  }

  void take_references() override {
    references_.map(row_);
    if (PackedValue& origin = row_.at(taken_from_); origin.type != PackedValue::Type::kNull) {
      origin.text = origins_.in_target(origin.text);
    }
  }
  void take_texts() override {
    for (const int column : text_columns_) {
      if (PackedValue& text = row_.at(column); text.type != PackedValue::Type::kNull) {
        text.whole = texts_.in_target(text.whole);
      }
    }
  }

 private:
  const std::array<int, 3> text_columns_{packed_column("mode"), packed_column("major_mode"),
                                         packed_column("margin_event")};
  const int taken_from_ = packed_column("taken_from");
  References references_;
  MergedOrigins origins_;
  TextNumbers target_texts_;
  MergedTexts texts_;
  Statement read_;
};

class OldSource final : public MergeSource {
 public:
  OldSource(sqlite3* source, sqlite3* target)
      : references_(source, target),
        texts_(target),
        old_(source, schema_of(source)),
        workers_(target),
        read_(source,
              fmt::format("SELECT {}, {}, {} FROM results ORDER BY rowid",
                          result_soundness_sql(schema_of(source)),
                          schema_of(source) >= kFirstWithChecksums ? "checksum IS NOT NULL" : "0",
                          OldRows::columns_sql(schema_of(source)))) {
    rows_ = number(source, "SELECT max(rowid) FROM results");
  }

  bool next() override {
    if (!read_.step()) {
      return false;
    }
    is_sound_ = old_.pack(read_, kFirst, texts_, row_) && read_.integer(0) != 0;
    has_checksum_ = read_.integer(1) != 0;
    solver_version_ = OldRows::solver_version(read_, kFirst);
    return true;
  }

  void take_texts() override {}  // they are packed with the target's
  void take_references() override {
    references_.map(row_);
    OldRows::name_worker(read_, kFirst, workers_, row_);
  }

 private:
  static constexpr int kFirst = 2;

  References references_;
  TextNumbers texts_;
  OldRows old_;
  OldWorkers workers_;
  Statement read_;
};

}  // namespace

std::unique_ptr<MergeSource> MergeSource::of(sqlite3* source, sqlite3* target,
                                             const StudyPlaces& places) {
  if (schema_of(source) >= kFirstPacked) {
    return std::make_unique<PackedSource>(source, target, places);
  }
  return std::make_unique<OldSource>(source, target);
}

}  // namespace oblique::server
