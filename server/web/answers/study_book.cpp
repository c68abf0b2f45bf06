#include "server/web/answers/study_book.h"

#include <algorithm>
#include <utility>

#include "proto/oblique.pb.h"
#include "proto/recipe/checks.h"
#include "server/database/sqlite.h"
#include "server/web/answers/answer_pool.h"

namespace oblique::server {
namespace {

constexpr std::size_t kMostKept = 8;

}  // namespace

LookedAtStudy StudyBook::study(sqlite3* database, std::uint64_t id) {
  Statement row(database, "SELECT name, state, points, recipe FROM studies WHERE study_id = ?1");
  row.bind(1, id);
  if (!row.step()) {
    throw NothingThere("there is no such study");
  }
  LookedAtStudy study{id, row.text(0), row.text(1), static_cast<std::uint64_t>(row.integer(2)), {}};
  {
    const std::lock_guard lock(mutex_);
    const auto known = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) {
      return kept.id == id && kept.points == study.points;
    });
    if (known != kept_.end()) {
      kept_.splice(kept_.begin(), kept_, known);
      study.table = kept_.front().table;
    }
  }
  if (!study.table) {
    protocol::Recipe recipe;
    if (!protocol::parse_recipe(row.bytes(3), recipe)) {
      throw StorageError("the recipe of the study cannot be read");
    }
    study.table = std::make_shared<const protocol::PointTable>(std::move(recipe));
    const std::lock_guard lock(mutex_);
    kept_.push_front({id, study.points, study.table});
    kept_.resize(std::min(kept_.size(), kMostKept));
  }
  study.points = study.table->size();
  return study;
}

}  // namespace oblique::server
