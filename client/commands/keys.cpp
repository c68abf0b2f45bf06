#include <array>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/io/row_output.h"
#include "proto/keys/key_file.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kKeysExamples = R"(Examples:
  oblique keys list --dir keys
  oblique keys add alice --role client --dir keys          writes keys/alice.key
  oblique keys add lab7 --role worker --public KEY         lists a key made elsewhere
  oblique keys revoke alice --dir keys

A running server applies a change within a second and closes the connections of a revoked key.)";

/// Roles of the keys in a server's list: all roles except the server's own.
constexpr std::array<std::string_view, 3> kRoles{"client", "worker", "reader"};

constexpr const char* kKeygenExamples = R"(Examples:
  oblique keygen keys
  oblique keygen /etc/oblique/keys
  oblique-server --listen '*' --keys keys/server.key        with worker.key on another machine:
  oblique-worker --server tcp://host:7601 --keys worker.key
  oblique status --server tcp://host:7600 --keys keys/client.key

Only the owner can read the files (mode 0600); existing files are never overwritten. Keep the
server's key and the list on its machine. Copy the worker's key to machines that solve, the client's
key to people who submit studies, and the reader's key to people who only read results.)";

struct KeysFlags {
  std::string folder;  // empty if not given
  std::string name;
  std::string role;
  std::string public_key;  // empty: creates a new key pair
  std::string format{"table"};
};

protocol::Role role_of(const std::string& name) {
  const auto role = protocol::role_named(name);
  if (!role || *role == protocol::Role::kServer) {
    throw solver::InputError(fmt::format(
        "--role {} is not allowed: it must be client, worker or reader", protocol::visible(name)));
  }
  return *role;
}

std::optional<protocol::CurveKey> public_key_of(const std::string& text) {
  if (text.empty()) {
    return std::nullopt;
  }
  const auto key = protocol::parse_z85(text);
  if (!key) {
    throw solver::InputError(
        fmt::format("--public {} is not a key: a key has {} characters, as `public` in a key file",
                    protocol::visible(text), protocol::kKeyCharacters));
  }
  return key;
}

bool is_there(const std::string& path) {
  return std::filesystem::exists(std::filesystem::symlink_status(path));
}

std::optional<protocol::KeyFile> key_in(const std::string& path) {
  try {
    return protocol::read_key_file(path);
  } catch (const solver::InputError&) {
    return std::nullopt;
  }
}

/// Throws std::runtime_error, with the remedy, if the file contains a key for this server that is
/// not in the list because it was revoked.
void check_not_revoked(const std::string& folder, const std::string& name) {
  const std::string path = protocol::key_file_in(folder, name);
  const std::string list = protocol::authorized_keys_in(folder);
  if (!protocol::is_key_name(name) || !is_there(path) || !is_there(list)) {
    return;
  }
  const auto listed = protocol::read_authorized_keys(list);
  const auto server = key_in(protocol::key_file_in(folder, "server"));
  const auto key = key_in(path);
  if (server && key && key->server == server->pair.public_key &&
      listed.find(key->pair.public_key) == nullptr && listed.find(name) == nullptr) {
    throw std::runtime_error(fmt::format(
        "{} exists and contains the revoked key of {}: remove the file to create a new key, or "
        "admit this key again with oblique keys add {} --role {} --dir {} --public='{}'",
        path, key->name, name, name_of(key->role), shell_word(folder),
        protocol::z85(key->pair.public_key)));
  }
}

int keygen(const KeysFlags& flags, Console& console) {
  const auto file_of = [&flags](const char* name) {
    return protocol::key_file_in(flags.folder, name);
  };
  const std::string list = protocol::authorized_keys_in(flags.folder);
  if (is_there(list)) {
    throw std::runtime_error(
        fmt::format("{} exists and is never overwritten; to add a key for its server: oblique keys "
                    "add NAME --role ROLE --dir {}",
                    list, shell_word(flags.folder)));
  }
  const auto server = protocol::make_key_folder(flags.folder);
  console.out() << fmt::format(
      "{}  for oblique-server --keys: keep it on its machine\n{}  for workers\n{}  for clients: "
      "submit, change and read\n{}  for clients that only read\n{}  the list of admitted keys; "
      "`oblique keys` changes it\n",
      file_of("server"), file_of("worker"), file_of("client"), file_of("reader"), list);
  console.notes() << fmt::format("The server's public key is {}.\n", protocol::z85(server));
  return kDone;
}

int add(const KeysFlags& flags, Console& console) {
  const auto role = role_of(flags.role);
  const auto public_key = public_key_of(flags.public_key);
  const std::string folder = protocol::find_key_folder(flags.folder);
  if (!public_key) {
    check_not_revoked(folder, flags.name);
  }
  const auto key = protocol::add_key(folder, flags.name, role, public_key);
  console.notes() << fmt::format(
      "{} ({}) is listed{}.\n", key.name, flags.role,
      flags.public_key.empty() ? "; its key is in " + protocol::key_file_in(folder, key.name) : "");
  return kDone;
}

int list(const KeysFlags& flags, Console&) {
  const auto format = format_named(flags.format);
  protocol::Table table{.columns = {"name", "role", "public", "added_at"}};
  const auto keys = protocol::read_authorized_keys(
      protocol::authorized_keys_in(protocol::find_key_folder(flags.folder)));
  for (const auto& key : keys.all()) {
    table.rows.push_back(
        {key.name, std::string(name_of(key.role)), protocol::z85(key.public_key), key.added_at});
  }
  print_out(table, format);
  return kDone;
}

int revoke(const KeysFlags& flags, Console& console) {
  const std::string folder = protocol::find_key_folder(flags.folder);
  const std::string path = protocol::authorized_keys_in(folder);
  protocol::change_authorized_keys(
      path, [&](protocol::AuthorizedKeys& keys) { keys.remove(flags.name); });
  console.notes() << fmt::format("{} is revoked: the server no longer admits this key.\n",
                                 flags.name);
  if (const auto file = protocol::key_file_in(folder, flags.name); is_there(file)) {
    console.notes() << fmt::format("The file {} still exists; it is useless.\n", file);
  }
  return kDone;
}

NewCommand<KeysFlags> add_action(CLI::App& keys, Action& parsed, const char* name,
                                 const char* summary, int (*run)(const KeysFlags&, Console&)) {
  auto added = new_command(keys, parsed, name, summary, "", run);
  added.command
      .add_option(
          "--dir", added.flags.folder,
          "folder of the server's key and the admitted keys; default: this folder, else keys")
      ->type_name("DIR");
  return added;
}

}  // namespace

void add_keys(CLI::App& app, Action& parsed) {
  {
    auto [command, flags] =
        new_command(app, parsed, "keygen", "Create keys for a server and its workers and clients",
                    kKeygenExamples, keygen);
    command.add_option("DIR", flags.folder, "folder for the files; created if it does not exist")
        ->required()
        ->type_name("");
  }
  auto* keys = app.add_subcommand("keys", "Manage the keys that a server admits");
  keys->footer(kKeysExamples);
  keys->require_subcommand(1);
  {
    auto [command, flags] = add_action(*keys, parsed, "add", "Add a key", add);
    command.add_option("NAME", flags.name, "name of the key and of its file, NAME.key")
        ->required()
        ->type_name("");
    auto* role = command.add_option("--role", flags.role, "client, worker or reader")
                     ->required()
                     ->type_name("ROLE");
    protocol::note_choices(role, kRoles);
    command
        .add_option("--public", flags.public_key,
                    "public key that was made elsewhere; default: create a new pair and write it "
                    "to NAME.key")
        ->type_name("KEY");
  }
  {
    auto [command, flags] = add_action(*keys, parsed, "list", "List the admitted keys", list);
    add_format_flag(command, flags.format);
  }
  auto [command, flags] = add_action(*keys, parsed, "revoke", "Revoke a key", revoke);
  command.add_option("NAME", flags.name, "name of the key")->required()->type_name("");
}

}  // namespace oblique::client
