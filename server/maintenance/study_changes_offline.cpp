#include "server/maintenance/study_changes_offline.h"

#include <optional>
#include <string_view>
#include <thread>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/checks.h"
#include "proto/recipe/written.h"
#include "server/database/open_for_reading.h"
#include "server/database/sqlite.h"
#include "server/store/store.h"

namespace oblique::server {
namespace {

/// Number of rows that are deleted in one transaction.
constexpr std::size_t kRowsAtOnce = 4096;
std::string gone_from(const std::string& path) {
  return fmt::format("the study is no longer in {}", path);
}

/// The store of the database that has this study.
class StoreWithStudy {
 public:
  StoreWithStudy(const std::string& path, std::uint64_t study_id) {
    (void)open_stored(path);  // throws if there is no file, which the store would create
    store_.emplace(path);
    database_ = open_database(path, SQLITE_OPEN_READONLY);
    Statement find(database_.get(), "SELECT 1 FROM studies WHERE study_id = ?");
    find.bind(1, study_id);
    if (!find.step()) {
      throw StudyRefused(gone_from(path));
    }
  }

  Store& store() { return *store_; }
  bool has_study_named(const std::string& name) {
    Statement find(database_.get(), "SELECT 1 FROM studies WHERE name = ?");
    find.bind(1, std::string_view(name));
    return find.step();
  }
  void commit(const Change& change) { store_->commit({&change, 1}); }

 private:
  std::optional<Store> store_;
  DatabaseHandle database_;
};

}  // namespace

void rename_study(const std::string& path, std::uint64_t study_id, const std::string& name) {
  if (const std::string objection = protocol::objection_to_study_name(name); !objection.empty()) {
    throw StudyRefused(objection);
  }
  StoreWithStudy at(path, study_id);
  if (at.has_study_named(name)) {
    throw StudyRefused(fmt::format(
        "there is a study called \"{}\" in {} already: choose another name", name, path));
  }
  at.commit(RenameStudy{study_id, name});
  at.store().merge_log();
}

bool delete_study(const std::string& path, std::uint64_t study_id, const RowsDeleted& deleted) {
  StoreWithStudy at(path, study_id);
  at.commit(DeleteStudy{study_id});
  return clear_all_away(at.store(), [&] { deleted(at.store().cleared_rows()); }) &&
         at.store().merge_log();
}

bool clear_all_away(Storage& storage, const std::function<void()>& part_is_done,
                    const Patience& patience) {
  for (int waits = 0; waits < patience.waits;) {
    switch (storage.clear_away(kRowsAtOnce)) {
      case ClearedAway::kAll:
        return true;
      case ClearedAway::kPart:
        waits = 0;
        part_is_done();
        break;
      case ClearedAway::kMustWait:
        ++waits;
        std::this_thread::sleep_for(patience.pause);
        break;
    }
  }
  return false;
}

protocol::Recipe stored_recipe(const std::string& path, std::uint64_t study_id) {
  const OpenedForReading opened = open_stored(path);
  Statement find(opened.database.get(), "SELECT recipe FROM studies WHERE study_id = ?");
  find.bind(1, study_id);
  if (!find.step()) {
    throw StudyRefused(gone_from(path));
  }
  protocol::Recipe recipe;
  if (!protocol::parse_recipe(find.bytes(0), recipe)) {
    throw StorageError(fmt::format(
        "the recipe of the study cannot be read: `oblique check --db {}` tells more", path));
  }
  return recipe;
}

}  // namespace oblique::server
