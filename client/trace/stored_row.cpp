#include "client/trace/stored_row.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>

#include <stdlib.h>

#include <spdlog/fmt/fmt.h>

#include "proto/recipe/model_message.h"
#include "proto/recipe/point_table.h"
#include "proto/result_message.h"
#include "server/database/sqlite.h"
#include "server/query/reader.h"
#include "server/query/sql_text.h"
#include "server/store/store.h"
#include "worker/solver/model/result_fields.h"

namespace oblique::client {
namespace {

using protocol::Value;

constexpr const char* kStudyOfOne = "one";

/// A folder that is gone with this.
class ShortLivedFolder {
 public:
  ShortLivedFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "oblique-trace-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw server::StorageError("no folder can be made in " +
                                 std::filesystem::temp_directory_path().string());
    }
    path_ = name;
  }
  ~ShortLivedFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ShortLivedFolder(const ShortLivedFolder&) = delete;
  ShortLivedFolder& operator=(const ShortLivedFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

protocol::Recipe recipe_of(const PointAtHand& point) {
  protocol::Recipe recipe;
  *recipe.mutable_model() = protocol::to_message(point.model);
  recipe.set_errors(point.errors);
  auto& block = *recipe.add_blocks();
  for (const auto& [key, value] :
       {std::pair{"H", point.H_m}, {"mu", point.mu}, {"e", point.e_star}}) {
    auto& axis = *block.add_axes();
    axis.set_key(key);
    axis.add_values(value);
  }
  return recipe;
}

/// The row that this database has of a result when it is stored.
StoredRow row_once_stored(const PointAtHand& point, const solver::CaseResult& result) {
  constexpr std::uint64_t kStudy = 1;
  constexpr const char* kAnyTime = "2000-01-01T00:00:00.000Z";
  const ShortLivedFolder folder;
  const std::string file = (folder.path() / "one.db").string();
  server::Store store(file);
  const auto table = std::make_shared<const protocol::PointTable>(recipe_of(point));
  const std::vector<server::Change> changes{server::AddStudy{kStudy, kStudyOfOne, table, kAnyTime},
                                            server::AddResults{kStudy,
                                                               table,
                                                               0,
                                                               result.solver.version,
                                                               "",
                                                               1,
                                                               kAnyTime,
                                                               {protocol::to_message(0, result)}}};
  store.commit(changes);
  return StoredRow(server::Reader(file).query("SELECT * FROM runs", server::kNoLimits));
}

bool is_same(const Value& a, const Value& b) {
  return a.SerializeAsString() == b.SerializeAsString();
}

}  // namespace

std::optional<Value> StoredRow::value(const std::string& column) const {
  const auto& columns = rows_.columns();
  const auto found = std::find(columns.begin(), columns.end(), column);
  return found == columns.end() || rows_.rows().empty()
             ? std::nullopt
             : std::optional(rows_.rows(0).values(static_cast<int>(found - columns.begin())));
}

std::string StoredRow::text(const std::string& column) const {
  const auto found = value(column);
  return found ? found->text() : std::string();
}

std::optional<StoredRow> stored_row(Source& source, const std::string& study, std::uint64_t point) {
  auto rows = source.query(fmt::format("SELECT * FROM runs WHERE study = {} AND point = {}",
                                       server::sql_text(study), point));
  return rows.rows().empty() ? std::nullopt : std::optional(StoredRow(std::move(rows)));
}

std::vector<std::string> differences(const StoredRow& stored, const PointAtHand& point,
                                     const solver::CaseResult& result) {
  const StoredRow again = row_once_stored(point, result);
  std::vector<std::string> columns;
  const auto compare = [&](std::string_view name) {
    const std::string column(name);
    const auto before = stored.value(column);
    const auto now = again.value(column);
    if (before && now && !is_same(*before, *now)) {
      columns.push_back(column);
    }
  };
  for (const auto& field : solver::result_fields()) {
    if (field.sent_with == solver::SentWith::kResult && field.name != "wall_s") {
      compare(field.column);
    }
  }
  for (const auto* list : solver::result_lists()) {
    if (solver::find_result_column(list->column) == nullptr) {
      compare(list->column);
    }
  }
  return columns;
}

std::string differences_in_words(const StoredRow& stored, const PointAtHand& point,
                                 const solver::CaseResult& result) {
  std::string names;
  for (const auto& column : differences(stored, point, result)) {
    names += (names.empty() ? "" : ", ") + column;
  }
  const std::string stored_version = stored.text("solver_version");
  const std::string& version = result.solver.version;
  return names.empty() ? names
         : stored_version == version
             ? fmt::format("{}: both by solver {}", names, version)
             : fmt::format("{}: stored by solver {}, now by {}", names, stored_version, version);
}

}  // namespace oblique::client
