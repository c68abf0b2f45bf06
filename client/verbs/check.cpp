#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/output/speech.h"
#include "client/service/source_flags.h"
#include "client/verbs/verbs.h"
#include "proto/text.h"
#include "server/maintenance/check.h"

namespace oblique::client {
namespace {

constexpr const char* kCheckExamples = R"(Examples:
  oblique check
  oblique check friction.db

Reads the whole database: every page and index, every reference, every row against its checksum and
the recipe of its study. It also says which studies are not finished, which is no damage: a copy made
without the file that ends in -wal lacks rows in this way. Exit code 1 when something is wrong. What
can still be read of a damaged file is saved by:  oblique backup saved.db --db damaged.db --salvage)";

int check(const std::string& database) {
  const auto found = server::diagnose(database);
  for (const auto* sentences : {&found.faults, &found.remarks}) {
    for (const auto& sentence : *sentences) {
      std::cout << protocol::visible(sentence) << '\n';
    }
  }
  if (found.faults.empty()) {
    std::cerr << fmt::format("{} is sound.\n", database);
    return kDone;
  }
  const ErrorOn error(std::cerr);
  std::cerr << fmt::format(
      "{0} is damaged. What can be read is saved by:\n  oblique backup saved.db --db {0} "
      "--salvage\n",
      database);
  return kFailed;
}

}  // namespace

void add_check(CLI::App& app, Command& command) {
  auto database = std::make_shared<std::filesystem::path>(DatabaseSettings().file);
  auto* verb = app.add_subcommand("check", "Look for damage in a database");
  verb->footer(kCheckExamples);
  add_database_argument(*verb, *database);
  verb->callback(
      [database, &command] { command = [database] { return check(database->string()); }; });
}

}  // namespace oblique::client
