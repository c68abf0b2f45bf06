#include "server/maintenance/study_changes_offline.h"

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "server/store/schema.h"
#include "server/store/store.h"

namespace oblique::server {
namespace {

std::string recipe_bytes(const std::string& path, std::uint64_t study_id) {
  const DatabaseHandle database = open_with_schema(path);
  Statement find(database.get(), "SELECT recipe FROM studies WHERE study_id = ?");
  find.bind_all(study_id);
  if (!find.step()) {
    throw StudyRefused(fmt::format("the study is not in {}", path));
  }
  return find.text(0);
}

}  // namespace

void rename_study(const std::string& path, std::uint64_t study_id, const std::string& name) {
  if (const std::string error = protocol::study_name_error(name); !error.empty()) {
    throw StudyRefused(error);
  }
  (void)recipe_bytes(path, study_id);
  Store store(path);
  Statement find(store.connection(), "SELECT 1 FROM studies WHERE name = ?");
  find.bind_all(name);
  if (find.step()) {
    throw StudyRefused(
        fmt::format("{1} already has a study called \"{0}\": choose another name", name, path));
  }
  find.reset();
  const Change change = RenameStudy{study_id, name};
  store.commit({&change, 1});
  store.merge_log();
}

bool delete_study(const std::string& path, std::uint64_t study_id) {
  constexpr std::size_t kRowsAtOnce = 4096;
  (void)recipe_bytes(path, study_id);
  Store store(path);
  const Change change = DeleteStudy{study_id};
  store.commit({&change, 1});
  ClearedAway cleared = ClearedAway::kPart;
  while (cleared == ClearedAway::kPart) {
    cleared = store.clear_away(kRowsAtOnce);
  }
  return cleared == ClearedAway::kAll && store.merge_log();
}

protocol::Recipe stored_recipe(const std::string& path, std::uint64_t study_id) {
  protocol::Recipe recipe;
  if (!protocol::parse_recipe(recipe_bytes(path, study_id), recipe)) {
    throw StorageError(fmt::format(
        "the recipe of the study cannot be read: `oblique check --db {}` lists all faults", path));
  }
  return recipe;
}

}  // namespace oblique::server
