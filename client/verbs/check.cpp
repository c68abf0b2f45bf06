#include <iostream>
#include <memory>

#include <spdlog/fmt/fmt.h>

#include "client/output/speech.h"
#include "client/service/source.h"
#include "client/verbs/verbs.h"
#include "proto/text.h"
#include "server/care/diagnosis.h"

namespace oblique::client {
namespace {

constexpr const char* kCheckExamples = R"(Examples:
  oblique check
  oblique check --db friction.db

Reads the whole database: every page and index, every reference, every row against its checksum and
the recipe of its study. It also says which studies are not finished, which is no damage: a copy made
without the file that ends in -wal lacks rows in this way. Exit code 1 when something is wrong. What
can still be read of a damaged file is saved by:  oblique backup saved.db --db damaged.db --salvage)";

int check(const DatabaseSettings& database) {
  const auto found = server::diagnose(database.file);
  for (const auto* sentences : {&found.faults, &found.remarks}) {
    for (const auto& sentence : *sentences) {
      std::cout << protocol::visible(sentence) << '\n';
    }
  }
  if (found.faults.empty()) {
    std::cerr << fmt::format("{} is sound.\n", database.file);
    return kDone;
  }
  const ErrorOn error(std::cerr);
  std::cerr << fmt::format(
      "{0} is damaged. What can be read is saved by:\n  oblique backup saved.db --db {0} "
      "--salvage\n",
      database.file);
  return kFailed;
}

}  // namespace

void add_check(CLI::App& app, Command& command) {
  auto database = std::make_shared<DatabaseSettings>();
  auto* verb = app.add_subcommand("check", "Look for damage in a database");
  verb->footer(kCheckExamples);
  verb->add_option("--db", database->file, "the database")
      ->type_name("FILE")
      ->capture_default_str();
  verb->callback([database, &command] { command = [database] { return check(*database); }; });
}

}  // namespace oblique::client
