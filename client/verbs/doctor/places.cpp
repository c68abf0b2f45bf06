#include "client/verbs/doctor/places.h"

#include <sys/statvfs.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <optional>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "server/database/database_file.h"
#include "server/database/sqlite.h"

namespace oblique::client::doctor {
namespace {

using Clock = std::chrono::steady_clock;

std::uint64_t size_of(const std::string& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  return error ? 0 : size;
}

/// Ends statements that take longer than a look may.
class Glance {
 public:
  explicit Glance(sqlite3* database) {
    constexpr int kInstructions = 10'000;
    sqlite3_progress_handler(database, kInstructions, &Glance::is_over, this);
  }

 private:
  static int is_over(void* glance) {
    return Clock::now() > static_cast<Glance*>(glance)->end_ ? 1 : 0;
  }
  Clock::time_point end_ = Clock::now() + std::chrono::milliseconds(400);
};

/// None where the statement fails or takes too long.
std::optional<std::uint64_t> number(sqlite3* database, const std::string& sql) {
  try {
    server::Statement statement(database, sql);
    return statement.step() ? std::optional(static_cast<std::uint64_t>(statement.integer(0)))
                            : std::nullopt;
  } catch (const server::StorageError&) {
    return std::nullopt;
  }
}

void add_contents(Findings& found, const std::string& file) {
  const auto opened = server::open_for_reading(file);
  sqlite3* database = opened.get();
  const Glance glance(database);
  if (server::identify(database, file) == server::DatabaseKind::kEmpty) {
    found.add("contents", "nothing was ever stored in it");
    return;
  }
  found.add("schema", "schema", std::to_string(server::kSchemaVersion), server::kSchemaVersion);
  const auto studies = number(database, "SELECT count(*) FROM studies");
  const auto points = number(database, "SELECT sum(points) FROM completed_ranges");
  found.add("studies", "studies",
            fmt::format("{}{}", studies ? shown_count(*studies) : std::string("not told in time"),
                        points ? fmt::format(", {} points solved or failed", shown_count(*points))
                               : std::string()),
            studies ? nlohmann::ordered_json(*studies) : nullptr);
  found.note("completed_points", points ? nlohmann::ordered_json(*points) : nullptr);
}

}  // namespace

Findings examine_disk(const std::string& file) {
  Findings found{"disk", "disk"};
  std::error_code error;
  const auto path = std::filesystem::weakly_canonical(std::filesystem::absolute(file), error);
  const auto folder = path.parent_path();
  found.add("folder", folder.string());
  struct statvfs disk {};
  if (::statvfs(folder.c_str(), &disk) != 0) {
    found.broken.push_back(
        fmt::format("There is no folder {}: a database cannot be in it.", folder.string()));
    return found;
  }
  const std::string type = server::file_system_of(folder.string());
  found.add("file_system", "file system", type, type);
  const std::uint64_t free = std::uint64_t{disk.f_bavail} * disk.f_frsize;
  const std::uint64_t total = std::uint64_t{disk.f_blocks} * disk.f_frsize;
  found.add("free_bytes", "free", fmt::format("{} of {}", shown_bytes(free), shown_bytes(total)),
            free);
  const bool is_writable = ::access(folder.c_str(), W_OK) == 0;
  found.note("writable", is_writable);
  constexpr std::uint64_t kLittle = 500'000'000;
  if (!is_writable) {
    found.odd.push_back(fmt::format(
        "Nothing can be written to {} by this user: name a --db elsewhere to solve a study here.",
        folder.string()));
  } else if (free < kLittle) {
    found.odd.push_back(fmt::format(
        "Little of the disk is free ({}): a million results take some 650 MB. Studies wait where "
        "a disk is full, and go on when there is room.",
        shown_bytes(free)));
  }
  if (const auto objection = server::objection_to_shared_disk(path.string()); !objection.empty()) {
    found.odd.push_back(objection + '.');
  }
  if (type == "tmpfs" || type == "ramfs") {
    found.odd.push_back(
        fmt::format("{} is in memory ({}): a database there is gone when the machine stops.",
                    folder.string(), type));
  }
  return found;
}

Findings examine_database(const std::string& file, bool is_named) {
  Findings found{"database", "database"};
  found.add("file", file);
  if (std::error_code error; !std::filesystem::exists(file, error)) {
    found.add("there", "there", "no", false);
    if (is_named) {
      found.broken.push_back(
          fmt::format("There is no database {}: check the name. `oblique run` makes one.", file));
    }
    return found;
  }
  found.note("there", true);
  const std::uint64_t log = size_of(file + "-wal");
  const bool is_in_use = server::is_in_use(file);
  found.add("bytes", "size",
            fmt::format("{}{}", shown_bytes(size_of(file)),
                        log > 0 ? fmt::format(", and {} in its log (-wal)", shown_bytes(log))
                                : std::string()),
            size_of(file));
  found.note("log_bytes", log);
  found.add("in_use", "in use", is_in_use ? "a server works on it" : "by no server", is_in_use);
  if (log > 0 && !is_in_use) {
    found.odd.push_back(fmt::format(
        "{0}-wal is left of a server that did not end in order. It holds rows: copy both files "
        "or none. The next server merges it.",
        file));
  }
  try {
    add_contents(found, file);
  } catch (const server::StorageError& error) {
    found.broken.push_back(as_sentence(error.what()));
  }
  found.add("damage", "damage", "not looked for: `oblique check` does", nullptr);
  return found;
}

}  // namespace oblique::client::doctor
