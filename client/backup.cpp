#include <iostream>
#include <memory>
#include <string>

#include "client/source.h"
#include "client/verbs.h"
#include "server/database_care.h"

namespace oblique::client {
namespace {

constexpr const char* kExamples = R"(Examples:
  oblique backup monday.db
  oblique backup /mnt/safe/friction.db --db friction.db

A server may be at work on the database: the copy is the database as it was at one instant. It is
checked, and has its name only when it is whole.)";

struct BackupFlags {
  std::string copy;
  DatabaseSettings database;
};

int backup(const BackupFlags& flags) {
  server::back_up(flags.database.file, flags.copy);
  std::cerr << flags.copy << " is a copy of " << flags.database.file << ".\n";
  return kDone;
}

}  // namespace

void add_backup(CLI::App& app, Command& command) {
  auto flags = std::make_shared<BackupFlags>();
  auto* verb = app.add_subcommand("backup", "Copy a database, also while a server writes to it");
  verb->footer(kExamples);
  verb->add_option("FILE", flags->copy, "the copy; must not exist")->required()->type_name("");
  verb->add_option("--db", flags->database.file, "the database")
      ->type_name("FILE")
      ->capture_default_str();
  verb->callback([flags, &command] { command = [flags] { return backup(*flags); }; });
}

}  // namespace oblique::client
