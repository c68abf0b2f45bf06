#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <system_error>

#include <spdlog/fmt/fmt.h>

#include "client/output/human_units.h"
#include "client/service/source.h"
#include "client/verbs/verbs.h"
#include "server/maintenance/backup.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kBackupExamples = R"(Examples:
  oblique backup monday.db
  oblique backup /mnt/safe/friction.db --db friction.db
  oblique backup saved.db --db damaged.db --salvage

A server may be at work on the database: the copy is the database as it was at one instant. It is
checked, and has its name only when it is whole.)";

struct BackupFlags {
  std::string copy;
  bool salvage = false;
  DatabaseSettings database;
};

int save_what_can_be_read(const BackupFlags& flags) {
  const auto saved = server::salvage(flags.database.file, flags.copy);
  std::cerr << fmt::format(
      "{} has {} studies and {} results of {}; rows were passed over at {} places. A server that "
      "goes on with it solves again what is missing.\n",
      flags.copy, shown_count(saved.studies), shown_count(saved.results), flags.database.file,
      shown_count(saved.unreadable_places));
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

int backup(const BackupFlags& flags) {
  check_copy(flags.copy);
  if (flags.salvage) {
    return save_what_can_be_read(flags);
  }
  server::back_up(flags.database.file, flags.copy);
  std::error_code ignored;
  std::cerr << fmt::format("{} is a copy of {}, {}.\n", flags.copy, flags.database.file,
                           shown_bytes(std::filesystem::file_size(flags.copy, ignored)));
  return kDone;
}

}  // namespace

void add_backup(CLI::App& app, Command& command) {
  auto flags = std::make_shared<BackupFlags>();
  auto* verb = app.add_subcommand("backup", "Copy a database, also while a server writes to it");
  verb->footer(kBackupExamples);
  verb->add_option("FILE", flags->copy, "the copy; must not exist")->required()->type_name("");
  verb->add_option("--db", flags->database.file, "the database")
      ->type_name("FILE")
      ->capture_default_str();
  verb->add_flag("--salvage", flags->salvage,
                 "the database is damaged: save every row that can still be read");
  verb->callback([flags, &command] { command = [flags] { return backup(*flags); }; });
}

}  // namespace oblique::client
