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

Studies and results of the databases come into the one of --db, which is made when it is not there. A
study is the one of the same name and recipe: their points are united, and where both have a result
that of --db stays. One that grew in one of them is united with what it was. A database with a study
of a name that is taken by another recipe is refused as a whole, with what differs. What is merged is
only read, also while a server works on it; merged again it brings what is new since. No server may be
at work on the database of --db.)";

constexpr const char* kBackupExamples = R"(Examples:
  oblique backup monday.db
  oblique backup /mnt/safe/friction.db --db friction.db
  oblique backup saved.db --db damaged.db --salvage

A server may be at work on the database: the copy is the database as it was at one instant. It is
checked, and has its name only when it is whole.)";

constexpr const char* kCheckExamples = R"(Examples:
  oblique check
  oblique check friction.db

Reads the whole database: every page and index, every reference, every row against its checksum and
the recipe of its study. It also says which studies are not finished, which is no damage: a copy made
without the file that ends in -wal lacks rows in this way. Exit code 1 when something is wrong. What
can still be read of a damaged file is saved by:  oblique backup saved.db --db damaged.db --salvage)";

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

/// The databases to be merged, each once.
std::vector<std::string> checked_sources(const MergeFlags& flags, Console& console) {
  std::vector<std::string> sources;
  for (const std::string& source : flags.sources) {
    if (!std::filesystem::exists(source)) {  // before a new target is made
      throw std::runtime_error(fmt::format("there is no file {}", source));
    }
    if (are_one_file(source, flags.target.file)) {
      throw solver::InputError(fmt::format(
          "{} is the database that the others are merged into: name it by --db alone", source));
    }
    bool is_known = false;
    for (const std::string& earlier : sources) {
      is_known = is_known || are_one_file(source, earlier);
    }
    if (is_known) {
      console.notes() << fmt::format("{} is named twice, and merged once.\n", source);
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
  out << fmt::format("{}: {} new in {} and {} united with those there; {} added", source,
                     counted(merged.studies_added, "study", "studies"), target,
                     format_count(merged.studies_united),
                     counted(merged.results_added, "result", "results"));
  const auto add = [&out](std::uint64_t count, const char* text) {
    out << (count > 0 ? fmt::format(fmt::runtime(text), format_count(count)) : "");
  };
  add(merged.studies_grown, "; studies that grew: {}");
  add(merged.failures_replaced, ", {} of them for points that had failed");
  add(merged.results_known, "; {} were there already");
  add(merged.results_differing, ", {} of these with other numbers: those of --db stay");
  out << ".\n";
  for (const std::string& remark : merged.remarks) {
    out << "  " << protocol::visible(remark) << '\n';
  }
}

void merge_one(Console& console, server::Merger& merger, const std::string& source,
               const MergeFlags& flags) {
  if (server::is_in_use(source)) {
    console.notes() << fmt::format(
        "A server is at work on {}: what it stores from now on comes when it is merged again.\n",
        source);
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
        "Another program reads {0}: until it ends a copy needs {0}-wal too; `oblique backup` makes "
        "one that is whole.\n",
        flags.target.file);
  }
  return kDone;
}

struct BackupFlags {
  std::string copy;
  bool salvage = false;
  DatabaseSettings database;
};

int salvage(const BackupFlags& flags, Console& console) {
  const auto saved = server::salvage(flags.database.file, flags.copy);
  console.notes() << fmt::format(
      "{} has {} studies and {} results of {}; rows were passed over at {} places. A server that "
      "goes on with it solves again what is missing.\n",
      flags.copy, format_count(saved.studies), format_count(saved.results), flags.database.file,
      format_count(saved.unreadable_places));
  return kDone;
}

void check_copy(const std::string& copy) {
  std::error_code ignored;
  if (std::filesystem::exists(copy, ignored)) {
    throw solver::InputError(copy + " exists already: name a file that does not");
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
  server::back_up(flags.database.file, flags.copy);
  std::error_code ignored;
  console.notes() << fmt::format("{} is a copy of {}, {}.\n", flags.copy, flags.database.file,
                                 format_bytes(std::filesystem::file_size(flags.copy, ignored)));
  return kDone;
}

struct DatabaseCheckFlags {
  std::filesystem::path database{DatabaseSettings().file};
};

int check(const DatabaseCheckFlags& flags, Console& console) {
  const std::string database = flags.database.string();
  const auto found = server::diagnose(database);
  for (const auto* sentences : {&found.faults, &found.remarks}) {
    for (const auto& sentence : *sentences) {
      console.out() << protocol::visible(sentence) << '\n';
    }
  }
  if (found.faults.empty()) {
    console.notes() << fmt::format("{} is sound.\n", database);
    return kDone;
  }
  console.errors() << fmt::format(
      "{0} is damaged. What can be read is saved by:\n  oblique backup saved.db --db {0} "
      "--salvage\n",
      database);
  return kFailed;
}

}  // namespace

void add_database_files(CLI::App& app, Action& parsed) {
  {
    auto [command, flags] =
        new_command(app, parsed, "merge", "Bring studies and results of databases into one",
                    kMergeExamples, merge);
    command.add_option("FILES", flags.sources, "the databases to be merged")
        ->required()
        ->type_name("");
    command.add_option("--db", flags.target.file, "the database that they are merged into")
        ->type_name("FILE")
        ->capture_default_str();
    command
        .add_option("--rename-prefix", flags.rename_prefix,
                    "goes before the names of studies whose names other recipes have")
        ->type_name("PREFIX");
    add_network_disk_flag(command, flags.allow_network_disk);
  }
  {
    auto [command, flags] =
        new_command(app, parsed, "backup", "Copy a database, also while a server writes to it",
                    kBackupExamples, backup);
    command.add_option("FILE", flags.copy, "the copy; must not exist")->required()->type_name("");
    command.add_option("--db", flags.database.file, "the database")
        ->type_name("FILE")
        ->capture_default_str();
    command.add_flag("--salvage", flags.salvage,
                     "the database is damaged: save every row that can still be read");
  }
  auto [command, flags] =
      new_command(app, parsed, "check", "Look for damage in a database", kCheckExamples, check);
  add_database_argument(command, flags.database);
}

}  // namespace oblique::client
