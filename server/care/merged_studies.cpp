#include "server/care/merged_studies.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/written/study_name.h"
#include "proto/recipe/written/study_terms.h"
#include "server/care/merged_origins.h"
#include "server/store/rows/row_columns.h"
#include "server/store/rows/settled_runs.h"
#include "server/study/study_table.h"
#include "worker/solver/model/errors.h"

namespace oblique::server {
namespace {

/// A study as a database has it.
struct StudyRow {
  std::uint64_t id;
  std::string name;
  StudyTable table;
  bool mixes_versions;
  bool is_sound;
};

// Where they stand in what `study_columns_sql` asks for.
constexpr int kCreatedAt = 7;
constexpr int kChangedAt = 8;
constexpr int kPriority = 9;
constexpr int kWeight = 10;

std::uint64_t number_in(const Statement& row, int column) {
  return static_cast<std::uint64_t>(row.integer(column));
}

std::string study_columns_sql() {
  return "study_id, name, recipe, points, mixes_versions, checksum IS NULL OR checksum = " +
         study_checksum_sql() + ", state, created_at, changed_at, priority, weight";
}

StudyRow study_in(const Statement& row) {
  return {number_in(row, 0), row.text(1), StudyTable(row.text(2), number_in(row, 3)),
          row.integer(4) != 0, row.integer(5) != 0};
}

/// Why no server would have stored the study in that row, or an empty text. It would keep a server
/// from starting, or could not be shown.
std::string objection_to(const StudyRow& study, const Statement& row) {
  constexpr std::size_t kLongestTime = 64;
  std::string objection = protocol::objection_to_study_name(study.name);
  if (objection.empty() &&
      std::max(row.text(kCreatedAt).size(), row.text(kChangedAt).size()) > kLongestTime) {
    objection = "its times are none";
  }
  if (objection.empty()) {
    objection = protocol::objection_to_priority(row.integer(kPriority));
  }
  if (objection.empty()) {
    objection = protocol::objection_to_weight(row.real(kWeight));
  }
  try {
    (void)study.table.get();
  } catch (const solver::InputError&) {
    // Another version took it. This one leaves it as it is.
  } catch (const std::runtime_error& error) {
    objection = fmt::format("its recipe cannot be read: {}", error.what());
  }
  study.table.release();
  return objection;
}

/// So many numbers its points have, those too that a filter leaves out; as many as it has points
/// where only another version can tell.
std::uint64_t numbers_of(const StudyTable& table) {
  try {
    const std::uint64_t numbers = table.numbers();
    table.release();
    return numbers;
  } catch (const std::runtime_error&) {
    return table.size();
  }
}

std::optional<StudyRow> study_named(sqlite3* target, const std::string& name) {
  Statement find(target, "SELECT " + study_columns_sql() + " FROM studies WHERE name = ?");
  find.bind(1, std::string_view(name));
  return find.step() ? std::optional(study_in(find)) : std::nullopt;
}

/// Of the study's first row that a worker solved; empty: there is none.
std::string solver_version_of(sqlite3* target, std::uint64_t study) {
  Statement find(target,
                 "SELECT solver_version FROM results WHERE study_id = ?"
                 " AND solver_version IS NOT NULL ORDER BY point LIMIT 1");
  find.bind(1, study);
  return find.step() ? find.text(0) : std::string();
}

class Placing {
 public:
  Placing(sqlite3* source, sqlite3* target, const MergeSettings& settings)
      : target_(target),
        settings_(settings),
        list_(source, "SELECT " + study_columns_sql() + " FROM studies ORDER BY study_id"),
        insert_(target,
                "INSERT INTO studies (study_id, name, recipe, points, state, created_at,"
                " changed_at, priority, weight, mixes_versions, checksum)"
                " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10,"
                " row_checksum(?1, ?2, ?3, ?4, ?6))"),
        mix_(target, "UPDATE studies SET mixes_versions = 1 WHERE study_id = ?"),
        grow_(target,
              "UPDATE studies SET recipe = ?2, points = ?3,"
              " checksum = row_checksum(study_id, name, ?2, ?3, created_at) WHERE study_id = ?1") {
    Statement last(target, "SELECT " + last_study_id_sql());
    last_id_ = last.step() ? number_in(last, 0) : 0;
  }

  StudyPlaces run(Merged& merged) {
    StudyPlaces places;
    while (list_.step()) {
      const StudyRow study = study_in(list_);
      if (!study.is_sound) {
        throw StorageError(fmt::format(
            "its study {} is not as it was stored: `oblique check` tells more", study.name));
      }
      if (const std::string objection = objection_to(study, list_); !objection.empty()) {
        throw StorageError(fmt::format("its study number {} is none that a server stores: {}",
                                       study.id, objection));
      }
      if (auto place = place_of(study)) {
        note_sharing(places, *place);
        ++(place->is_new ? merged.studies_added : merged.studies_united);
        merged.studies_grown += place->has_grown ? 1U : 0U;
        places.emplace(study.id, std::move(*place));
      }
    }
    return places;
  }
  const std::vector<std::string>& conflicts() const { return conflicts_; }

 private:
  /// Two studies of the source may become one by another name: neither is alone with its rows then.
  static void note_sharing(StudyPlaces& places, const StudyPlace& place) {
    for (auto& [from, other] : places) {
      if (!place.is_new && other.id == place.id) {
        other.is_new = false;
        other.points = place.points;
      }
    }
  }

  /// Nothing, and a conflict more, when there is none.
  std::optional<StudyPlace> place_of(const StudyRow& study) {
    std::string name = study.name;
    auto known = study_named(target_, name);
    Growth growth = growth_of_known(known, study);
    if (growth.kind == Growth::Kind::kOther && !settings_.rename_prefix.empty()) {
      name = settings_.rename_prefix + name;
      known = study_named(target_, name);
      growth = growth_of_known(known, study);
    }
    if (growth.kind == Growth::Kind::kOther) {
      std::replace(growth.difference.begin(), growth.difference.end(), '\n', ';');
      conflicts_.push_back(fmt::format("there is a study called \"{}\" with another recipe ({})",
                                       name, growth.difference));
      return std::nullopt;
    }
    if (const std::string objection =
            name == study.name ? "" : protocol::objection_to_study_name(name);
        !objection.empty()) {
      conflicts_.push_back(objection);
      return std::nullopt;
    }
    if (!known) {
      return added(study, name);
    }
    StudyPlace place = united(study, *known);
    if (growth.kind == Growth::Kind::kLonger) {
      grow_.bind(1, place.id);
      grow_.bind_blob(2, study.table.recipe_bytes());
      grow_.bind(3, study.table.size());
      grow_.run();
      place.points = study.table.size();
      place.has_grown = true;
    }
    return place;
  }

  /// What the study is to the one that is there, if any.
  static Growth growth_of_known(const std::optional<StudyRow>& known, const StudyRow& study) {
    if (!known || known->table.is_of_the_recipe_of(study.table)) {
      return {Growth::Kind::kSame, {}};
    }
    try {
      return known->table.growth_to(study.table);
    } catch (const std::runtime_error& error) {
      return {Growth::Kind::kOther, error.what()};
    }
  }

  StudyPlace united(const StudyRow& study, const StudyRow& known) {
    const bool mixes = known.mixes_versions || study.mixes_versions || settings_.mixes_versions;
    if (mixes && !known.mixes_versions) {
      mix_.bind(1, known.id);
      mix_.run();
    }
    return {known.id,
            known.name,
            false,
            known.table.size(),
            numbers_of(study.table),
            solver_version_of(target_, known.id),
            mixes};
  }

  StudyPlace added(const StudyRow& study, const std::string& name) {
    const std::uint64_t id = ++last_id_;
    insert_.bind(1, id);
    insert_.bind(2, std::string_view(name));
    insert_.bind_blob(3, study.table.recipe_bytes());
    insert_.bind(4, study.table.size());
    for (int i = 0; i < 5; ++i) {  // state, created_at, changed_at, priority, weight
      insert_.bind_column(5 + i, list_, 6 + i);
    }
    insert_.bind(10, std::int64_t{study.mixes_versions});
    insert_.run();
    return {id, name, true, study.table.size(), numbers_of(study.table), {}, true};
  }

  sqlite3* target_;
  const MergeSettings& settings_;
  Statement list_;
  Statement insert_;
  Statement mix_;
  Statement grow_;
  std::uint64_t last_id_ = 0;
  std::vector<std::string> conflicts_;
};

/// What earlier failures say of attempts.
class Retries {
 public:
  Retries(sqlite3* source, sqlite3* target)
      : read_(source,
              "SELECT first_point, points, attempt, retried_at FROM retries WHERE study_id = ?"
              " ORDER BY rowid"),
        insert_(target,
                "INSERT INTO retries (study_id, first_point, points, attempt, retried_at)"
                " SELECT ?1, ?2, ?3, ?4, ?5 WHERE NOT EXISTS (SELECT 1 FROM retries"
                " WHERE study_id = ?1 AND first_point = ?2 AND points = ?3 AND attempt = ?4"
                " AND retried_at = ?5)") {}

  void bring(std::uint64_t from, std::uint64_t to) {
    read_.bind(1, from);
    while (read_.step()) {
      insert_.bind(1, to);
      for (int column = 0; column < 4; ++column) {
        insert_.bind_column(2 + column, read_, column);
      }
      insert_.run();
    }
    read_.reset();
  }

 private:
  Statement read_;
  Statement insert_;
};

}  // namespace

StudyPlaces place_studies(sqlite3* source, sqlite3* target, const MergeSettings& settings,
                          Merged& merged) {
  Placing placing(source, target, settings);
  StudyPlaces places = placing.run(merged);
  const auto& conflicts = placing.conflicts();
  if (conflicts.empty()) {
    return places;
  }
  constexpr std::size_t kMostNamed = 10;
  const auto named = static_cast<std::ptrdiff_t>(std::min(conflicts.size(), kMostNamed));
  std::string text =
      fmt::format("{}", fmt::join(conflicts.begin(), conflicts.begin() + named, "; "));
  if (conflicts.size() > kMostNamed) {
    text += fmt::format("; and {} more", conflicts.size() - kMostNamed);
  }
  throw MergeRefused(text + (settings.rename_prefix.empty()
                                 ? ". --rename-prefix PREFIX gives such studies other names"
                                 : ". Another --rename-prefix gives other names"));
}

void settle_studies(sqlite3* source, sqlite3* target, const StudyPlaces& places) {
  Retries retries(source, target);
  for (const auto& [from, place] : places) {
    retries.bring(from, place.id);
  }
  SettledRuns settled(target);
  Statement count(target, "SELECT sum(points) FROM settled_points WHERE study_id = ?");
  Statement set(target,
                "UPDATE studies SET state = ?2,"
                " changed_at = strftime('%Y-%m-%dT%H:%M:%fZ', 'now')"
                " WHERE study_id = ?1 AND (state = 'done') <> (?2 = 'done')");
  for (const auto& [from, place] : places) {
    if (!place.is_new && !place.has_grown && place.rows_changed == 0) {
      continue;
    }
    settled.count_again(place.id);
    count_taken_points(target, place.id);
    count.bind(1, place.id);
    count.step();
    const bool is_done = number_in(count, 0) == place.points;
    count.reset();
    // A study that lacks rows keeps its state unless that says that it does not.
    set.bind(1, place.id);
    set.bind(2, std::string_view(is_done ? "done" : "running"));
    set.run();
  }
}

}  // namespace oblique::server
