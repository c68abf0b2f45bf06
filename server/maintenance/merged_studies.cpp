#include "server/maintenance/merged_studies.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/written/study_name.h"
#include "proto/recipe/written/study_terms.h"
#include "server/store/rows/row_columns.h"
#include "server/study/study_table.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

/// A row of `studies`.
struct StudyRow {
  std::uint64_t id;
  std::string name;
  StudyTable table;
  bool mixes_versions;
};

constexpr const char* kStudyColumns =
    "study_id, name, recipe, points, mixes_versions, state, created_at, changed_at, priority,"
    " weight";
constexpr int kCreatedAt = 6;
constexpr int kChangedAt = 7;
constexpr int kPriority = 8;
constexpr int kWeight = 9;

std::uint64_t number_in(const Statement& row, int column) {
  return static_cast<std::uint64_t>(row.integer(column));
}

StudyRow study_in(const Statement& row) {
  return {number_in(row, 0), row.text(1), StudyTable(row.text(2), number_in(row, 3)),
          row.integer(4) != 0};
}

/// Why no server would have stored the study in that row, or an empty text. Such a study could keep
/// a server from starting, or could not be shown.
std::string objection_to(const StudyRow& study, const Statement& row) {
  constexpr std::size_t kLongestTime = 64;
  if (std::max(row.text(kCreatedAt).size(), row.text(kChangedAt).size()) > kLongestTime) {
    return "its times are not valid";
  }
  for (const std::string& objection : {protocol::objection_to_study_name(study.name),
                                       protocol::objection_to_priority(row.integer(kPriority)),
                                       protocol::objection_to_weight(row.real(kWeight))}) {
    if (!objection.empty()) {
      return objection;
    }
  }
  try {
    (void)study.table.get();
  } catch (const solver::InputError&) {
    // Another version accepted the recipe. It is merged unchanged.
  } catch (const std::runtime_error& error) {
    return fmt::format("its recipe cannot be read: {}", error.what());
  }
  return {};
}

std::optional<StudyRow> study_named(sqlite3* database, const std::string& name) {
  Statement find(database,
                 fmt::format("SELECT {} FROM main.studies WHERE name = ?", kStudyColumns));
  find.bind(1, std::string_view(name));
  return find.step() ? std::optional(study_in(find)) : std::nullopt;
}

/// Of the study's first row that a worker solved; empty: there is none.
std::string solver_version_of(sqlite3* database, std::uint64_t study) {
  Statement find(database,
                 "SELECT w.solver_version FROM main.packed_results AS r"
                 " JOIN main.workers AS w ON w.worker_id = r.worker"
                 " WHERE r.study_id = ? ORDER BY r.point LIMIT 1");
  find.bind(1, study);
  return find.step() ? find.text(0) : std::string();
}

/// How the recipe of `study` relates to that of the one with its name, if any.
Growth growth_of(const std::optional<StudyRow>& known, const StudyRow& study) {
  if (!known || known->table.is_of_the_recipe_of(study.table)) {
    return {Growth::Kind::kSame, {}};
  }
  try {
    return known->table.growth_to(study.table);
  } catch (const std::runtime_error& error) {
    return {Growth::Kind::kOther, error.what()};
  }
}

class StudyMerge {
 public:
  StudyMerge(sqlite3* database, const MergeSettings& settings, Merged& merged)
      : database_(database),
        settings_(settings),
        merged_(merged),
        list_(database,
              fmt::format("SELECT {} FROM source.studies ORDER BY study_id", kStudyColumns)) {}

  std::vector<StudyPlace> run() {
    std::vector<StudyPlace> places;
    while (list_.step()) {
      const StudyRow study = study_in(list_);
      if (const std::string objection = objection_to(study, list_); !objection.empty()) {
        throw StorageError(fmt::format("its study number {} is none that a server stores: {}",
                                       study.id, objection));
      }
      if (auto place = place_of(study)) {
        places.push_back(std::move(*place));
      }
      study.table.release();
    }
    refuse_conflicts();
    return places;
  }

 private:
  /// Nothing, and one more conflict, when the study has no place.
  std::optional<StudyPlace> place_of(const StudyRow& study) {
    std::string name = study.name;
    auto known = study_named(database_, name);
    Growth growth = growth_of(known, study);
    if (growth.kind == Growth::Kind::kOther && !settings_.rename_prefix.empty()) {
      name = settings_.rename_prefix + name;
      known = study_named(database_, name);
      growth = growth_of(known, study);
    }
    if (growth.kind == Growth::Kind::kOther) {
      std::replace(growth.difference.begin(), growth.difference.end(), '\n', ';');
      conflicts_.push_back(fmt::format("there is a study called \"{}\" with another recipe ({})",
                                       name, growth.difference));
      return std::nullopt;
    }
    if (std::string objection = protocol::objection_to_study_name(name); !objection.empty()) {
      conflicts_.push_back(std::move(objection));
      return std::nullopt;
    }
    return known ? unite(study, *known, growth) : add(study, name);
  }

  StudyPlace unite(const StudyRow& study, const StudyRow& known, const Growth& growth) {
    ++merged_.studies_united;
    const bool mixes = known.mixes_versions || study.mixes_versions || settings_.mixes_versions;
    Statement mix(database_, "UPDATE main.studies SET mixes_versions = ?2 WHERE study_id = ?1");
    mix.bind(1, known.id);
    mix.bind(2, std::int64_t{mixes});
    mix.run();
    if (growth.kind == Growth::Kind::kLonger) {
      ++merged_.studies_grown;
      Statement grow(
          database_,
          "UPDATE main.studies SET recipe = ?2, points = ?3,"
          " checksum = row_checksum(study_id, name, ?2, ?3, created_at) WHERE study_id = ?1");
      grow.bind(1, known.id);
      grow.bind_blob(2, study.table.recipe_bytes());
      grow.bind(3, study.table.size());
      grow.run();
    }
    return {
        study.id, known.id, known.name, study.table.size(), solver_version_of(database_, known.id),
        mixes};
  }

  StudyPlace add(const StudyRow& study, const std::string& name) {
    ++merged_.studies_added;
    Statement insert(
        database_,
        fmt::format("INSERT INTO main.studies (study_id, name, recipe, points, mixes_versions,"
                    " state, created_at, changed_at, priority, weight) SELECT 1 + {}, ?1, recipe,"
                    " points, mixes_versions, state, created_at, changed_at, priority, weight"
                    " FROM source.studies WHERE study_id = ?2",
                    last_study_id_sql()));
    insert.bind(1, std::string_view(name));
    insert.bind(2, study.id);
    insert.run();
    const auto id = static_cast<std::uint64_t>(sqlite3_last_insert_rowid(database_));
    Statement seal(database_,
                   fmt::format("UPDATE main.studies SET checksum = {} WHERE study_id = ?",
                               study_checksum_sql()));
    seal.bind(1, id);
    seal.run();
    return {study.id, id, name, study.table.size(), {}, true};
  }

  /// Throws MergeRefused when there are conflicts, and names the first ten.
  void refuse_conflicts() const {
    if (conflicts_.empty()) {
      return;
    }
    constexpr std::size_t kMostNamed = 10;
    const auto named = static_cast<std::ptrdiff_t>(std::min(conflicts_.size(), kMostNamed));
    std::string text =
        fmt::format("{}", fmt::join(conflicts_.begin(), conflicts_.begin() + named, "; "));
    if (conflicts_.size() > kMostNamed) {
      text += fmt::format("; and {} more", conflicts_.size() - kMostNamed);
    }
    throw MergeRefused(text + (settings_.rename_prefix.empty()
                                   ? ". --rename-prefix PREFIX gives such studies other names"
                                   : ". Another --rename-prefix gives other names"));
  }

  sqlite3* database_;
  const MergeSettings& settings_;
  Merged& merged_;
  Statement list_;
  std::vector<std::string> conflicts_;
};

}  // namespace

std::vector<StudyPlace> place_studies(sqlite3* database, const MergeSettings& settings,
                                      Merged& merged) {
  return StudyMerge(database, settings, merged).run();
}

}  // namespace oblique::server
