#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"
#include "proto/keys/key_file.h"

namespace oblique::client {
namespace {

constexpr const char* kKeygenExamples = R"(Examples:
  oblique keygen keys
  oblique keygen /etc/oblique/keys
  oblique-server --listen '*' --keys keys/server.key        with worker.key on another machine:
  oblique-worker --server tcp://host:7601 --keys worker.key
  oblique status --server tcp://host:7600 --keys keys/client.key

Each file is for its owner alone (mode 0600) and nothing is overwritten. The server's key and the
list stay on its machine; a worker's goes to the machines that solve, a client's to people who
submit studies, a reader's to those who only look.)";

int keygen(const std::string& folder) {
  using protocol::key_file_in;
  const std::string list = protocol::authorized_keys_in(folder);
  if (std::filesystem::exists(std::filesystem::symlink_status(list))) {
    throw std::runtime_error(
        fmt::format("{} is there already, and is never overwritten; one more key for its server: "
                    "oblique keys add NAME --role ROLE --dir {}",
                    list, shell_word(folder)));
  }
  const auto server = protocol::make_key_folder(folder);
  std::cout << fmt::format(
      "{}  oblique-server --keys: stays on its machine\n"
      "{}  workers\n"
      "{}  clients: submit, change and read\n"
      "{}  clients that only read\n"
      "{}  the keys that the server admits; `oblique keys` changes it\n",
      key_file_in(folder, "server"), key_file_in(folder, "worker"), key_file_in(folder, "client"),
      key_file_in(folder, "reader"), protocol::authorized_keys_in(folder));
  std::cerr << fmt::format("The server's public key is {}.\n", protocol::z85(server));
  return kDone;
}

}  // namespace

void add_keygen(CLI::App& app, Command& command) {
  auto folder = std::make_shared<std::string>();
  auto* verb = app.add_subcommand("keygen", "Make keys for a server and for who may speak with it");
  verb->footer(kKeygenExamples);
  verb->add_option("DIR", *folder, "folder to write them to; made if it is not there")
      ->required()
      ->type_name("");
  verb->callback([folder, &command] { command = [folder] { return keygen(*folder); }; });
}

}  // namespace oblique::client
