#include <cstdint>
#include <filesystem>
#include <ostream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/io/console.h"
#include "client/service/connection.h"
#include "client/service/source.h"
#include "proto/text.h"
#include "server/database/database_file.h"
#include "server/database/sqlite.h"
#include "server/maintenance/backup.h"
#include "server/maintenance/check.h"
#include "server/maintenance/merge.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kMergeExamples = R"(Examples:
  oblique merge lab.db cluster.db --db all.db
  oblique merge cluster.db --db lab.db --rename-prefix cluster-

Copies studies and results into the database of --db, which is created if it does not exist. Studies
of the same name and recipe, also if one of them has grown, become one study; if both have a result
for a point, that of --db stays. A database is refused as a whole if one of its studies has the name
of a study with another recipe; the error shows the difference. The merged databases are only read,
also while a server uses them. Merging again adds what is new. No server may use the database of
--db.)";

constexpr const char* kBackupExamples = R"(Examples:
  oblique backup monday.db
  oblique backup /mnt/safe/friction.db --db friction.db
  oblique backup saved.db --db damaged.db --salvage

The copy is the state of the database at one instant; a server may use the database meanwhile. The
copy is checked as by `oblique check`, and appears under its name when it is complete. If results or
studies of the database are damaged, so is the copy: the faults are printed, with exit code 1.
--salvage leaves out damaged results, which are solved again, and names everything else that is not
as it was stored, with exit code 1.)";

constexpr const char* kCheckExamples = R"(Examples:
  oblique check
  oblique check friction.db

Reads the whole database: every page, index and reference, and every row, which is compared with its
checksum and the recipe of its study. Unfinished studies are listed; they are no damage. A copy made
without the file that ends in -wal lacks rows in this way. Exit code 1 if the database is damaged.
To save what can be read of a damaged file:  oblique backup saved.db --db damaged.db --salvage)";

struct MergeFlags {
  std::vector<std::string> sources;
  DatabaseSettings target;
  std::string rename_prefix;
  bool allow_network_disk = false;
};

bool are_one_file(const std::string& one, const std::string& other) {
  std::error_code missing;
  return std::filesystem::equivalent(one, other, missing) && !missing;
}

/// Returns the databases to merge, each once.
std::vector<std::string> checked_sources(const MergeFlags& flags, Console& console) {
  std::vector<std::string> sources;
  for (const std::string& source : flags.sources) {
    if (!std::filesystem::exists(source)) {  // fails before the target is created
      throw std::runtime_error(fmt::format("there is no file {}", source));
    }
    if (are_one_file(source, flags.target.file)) {
      throw solver::InputError(
          fmt::format("{} is the database to merge into: name it only with --db", source));
    }
    bool is_known = false;
    for (const std::string& earlier : sources) {
      is_known = is_known || are_one_file(source, earlier);
    }
    if (is_known) {
      console.notes() << fmt::format("{} is named twice and merged once.\n", source);
    } else {
      sources.push_back(source);
    }
  }
  server::path_on_own_disk(flags.target.file, flags.allow_network_disk);
  return sources;
}

void note_merged(Console& console, const std::string& source, const std::string& target,
                 const server::Merged& merged) {
  auto& out = console.notes();
  out << fmt::format("{}: added {} to {}, united {} with studies of the same recipe; added {}",
                     source, counted(merged.studies_added, "study", "studies"), target,
                     format_count(merged.studies_united),
                     counted(merged.results_added, "result", "results"));
  const auto add = [&out](std::uint64_t count, const char* text) {
    out << (count > 0 ? fmt::format(fmt::runtime(text), format_count(count)) : "");
  };
  add(merged.failures_replaced, ", {} of them for points that had failed");
  add(merged.results_known, "; {} existed already");
  add(merged.results_differing, ", {} of these with other values: those of --db are kept");
  add(merged.studies_grown, "; {} of the united studies grew");
  out << ".\n";
  for (const std::string& remark : merged.remarks) {
    out << "  " << protocol::visible(remark) << '\n';
  }
}

void merge_one(Console& console, server::Merger& merger, const std::string& source,
               const MergeFlags& flags) {
  if (server::is_in_use(source)) {
    console.notes() << fmt::format(
        "A server uses {}: merge again later to add what it stores from now on.\n", source);
  }
  note_merged(console, source, flags.target.file, merger.merge(source, flags.rename_prefix));
}

int merge(const MergeFlags& flags, Console& console) {
  const auto sources = checked_sources(flags, console);
  server::Merger merger(flags.target.file);
  for (const std::string& source : sources) {
    merge_one(console, merger, source, flags);
  }
  if (!merger.finish()) {
    console.notes() << fmt::format(
        "Another program reads {0}. Until it ends, a copy of the file needs {0}-wal, too; `oblique "
        "backup` makes a complete copy.\n",
        flags.target.file);
  }
  return kDone;
}

struct BackupFlags {
  std::string copy;
  bool salvage = false;
  DatabaseSettings database;
};

/// Prints damage, each a sentence. Returns the exit code.
template <class Sentences>
int report(const Sentences& faults, std::ostream& out) {
  for (const std::string& fault : faults) {
    out << protocol::visible(fault) << '\n';
  }
  return faults.empty() ? kDone : kFailed;
}

int report_damage(Console& console, const std::string& database, std::string_view what) {
  console.errors() << fmt::format(
      "{0} is damaged{1}. To save what can be read:\n  oblique backup saved.db --db {0} "
      "--salvage\n",
      database, what);
  return kFailed;
}

int salvage(const BackupFlags& flags, Console& console) {
  const auto saved = server::salvage(flags.database.file, flags.copy);
  console.notes() << fmt::format(
      "{} contains {} studies and {} results of {}; rows at {} places could not be read. A server "
      "that continues with the copy solves the missing points.\n",
      flags.copy, format_count(saved.studies), format_count(saved.results), flags.database.file,
      format_count(saved.unreadable_places));
  return report(saved.losses, console.errors());
}

void check_copy(const std::string& copy) {
  std::error_code ignored;
  if (std::filesystem::exists(copy, ignored)) {
    throw solver::InputError(copy + " exists already: name a new file");
  }
  const auto folder = std::filesystem::absolute(copy).parent_path();
  if (!std::filesystem::is_directory(folder, ignored)) {
    throw solver::InputError(
        fmt::format("{} cannot be written: there is no folder {}", copy, folder.string()));
  }
}

int backup(const BackupFlags& flags, Console& console) {
  check_copy(flags.copy);
  if (flags.salvage) {
    return salvage(flags, console);
  }
  const auto faults = server::back_up(flags.database.file, flags.copy);
  std::error_code ignored;
  console.notes() << fmt::format("{} is a copy of {}, {}.\n", flags.copy, flags.database.file,
                                 format_bytes(std::filesystem::file_size(flags.copy, ignored)));
  return report(faults, console.errors()) == kDone
             ? kDone
             : report_damage(console, flags.database.file, ", and so is its copy");
}

struct DatabaseCheckFlags {
  std::filesystem::path database{DatabaseSettings().file};
};

int check(const DatabaseCheckFlags& flags, Console& console) {
  const std::string database = flags.database.string();
  const auto found = server::diagnose(database);
  const int exit_code = report(found.faults, console.out());
  report(found.remarks, console.out());
  if (exit_code != kDone) {
    return report_damage(console, database, "");
  }
  console.notes() << fmt::format("{} is sound.\n", database);
  return kDone;
}

}  // namespace

void add_database_files(CLI::App& app, Action& parsed) {
  {
    auto [command, flags] =
        new_command(app, parsed, "merge", "Merge studies and results of several databases",
                    kMergeExamples, merge);
    command.add_option("FILES", flags.sources, "databases to merge")->required()->type_name("");
    command.add_option("--db", flags.target.file, "database to merge into")
        ->type_name("FILE")
        ->capture_default_str();
    command
        .add_option("--rename-prefix", flags.rename_prefix,
                    "prefix for studies whose name is used for another recipe")
        ->type_name("PREFIX");
    add_network_disk_flag(command, flags.allow_network_disk);
  }
  {
    auto [command, flags] =
        new_command(app, parsed, "backup", "Copy a database, also while a server writes to it",
                    kBackupExamples, backup);
    command.add_option("FILE", flags.copy, "file for the copy; must not exist")
        ->required()
        ->type_name("");
    command.add_option("--db", flags.database.file, "the database")
        ->type_name("FILE")
        ->capture_default_str();
    command.add_flag("--salvage", flags.salvage, "save every readable row of a damaged database");
  }
  auto [command, flags] =
      new_command(app, parsed, "check", "Search a database for damage", kCheckExamples, check);
  add_database_argument(command, flags.database);
}

}  // namespace oblique::client
