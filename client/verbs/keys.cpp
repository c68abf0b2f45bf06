#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "client/output/printer.h"
#include "client/verbs/printed_rows.h"
#include "client/verbs/verbs.h"
#include "proto/keys/key_file.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kKeysExamples = R"(Examples:
  oblique keys list --dir keys
  oblique keys add alice --role client --dir keys          writes keys/alice.key
  oblique keys add lab7 --role worker --public KEY         lists a key that was made elsewhere
  oblique keys revoke alice --dir keys

A running server heeds a change within a second; the connections of a revoked key are ended.)";

/// That may be listed: all but the server's.
constexpr std::array<std::string_view, 3> kRoles{"client", "worker", "reader"};

struct KeysFlags {
  std::string folder;  // empty: not given
  std::string name;
  std::string role;
  std::string public_key;  // empty: a new pair
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
  const auto key = protocol::key_of_z85(text);
  if (!key) {
    throw solver::InputError(
        fmt::format("--public {} is no key: one has {} characters, as `public` in a key file",
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

/// A file with a key for this server that its list lacks is that of a revoked one: throws
/// std::runtime_error with what to do about it.
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
        "{} is there already, and is the key of {}, which was revoked: remove the file for a new "
        "key, or list this one again with oblique keys add {} --role {} --dir {} --public='{}'",
        path, key->name, name, name_of(key->role), shell_word(folder),
        protocol::z85(key->pair.public_key)));
  }
}

int add(const KeysFlags& flags) {
  const auto role = role_of(flags.role);
  const auto public_key = public_key_of(flags.public_key);
  const std::string folder = protocol::key_folder_meant(flags.folder);
  if (!public_key) {
    check_not_revoked(folder, flags.name);
  }
  const auto key = protocol::add_key(folder, flags.name, role, public_key);
  std::cerr << fmt::format(
      "{} ({}) is listed{}.\n", key.name, flags.role,
      flags.public_key.empty() ? "; its key is in " + protocol::key_file_in(folder, key.name) : "");
  return kDone;
}

int list(const KeysFlags& flags) {
  const auto format = format_named(flags.format);
  protocol::Table table{.columns = {"name", "role", "public", "added_at"}};
  const auto keys = protocol::read_authorized_keys(
      protocol::authorized_keys_in(protocol::key_folder_meant(flags.folder)));
  for (const auto& key : keys.all()) {
    auto& row = table.rows.emplace_back();
    add_value(row, key.name);
    add_value(row, std::string(name_of(key.role)));
    add_value(row, protocol::z85(key.public_key));
    add_value(row, key.added_at);
  }
  print_out(table, format);
  return kDone;
}

int revoke(const KeysFlags& flags) {
  const std::string folder = protocol::key_folder_meant(flags.folder);
  const std::string path = protocol::authorized_keys_in(folder);
  protocol::change_authorized_keys(
      path, [&](protocol::AuthorizedKeys& keys) { keys.remove(flags.name); });
  std::cerr << fmt::format("{} is revoked: its key is worth nothing from now on.\n", flags.name);
  if (const auto file = protocol::key_file_in(folder, flags.name); is_there(file)) {
    std::cerr << fmt::format("The file {} stays, and is worth nothing.\n", file);
  }
  return kDone;
}

}  // namespace

void add_keys(CLI::App& app, Command& command) {
  auto flags = std::make_shared<KeysFlags>();
  auto* verb = app.add_subcommand("keys", "Say whom a server with keys admits");
  verb->footer(kKeysExamples);
  verb->require_subcommand(1);
  const auto add_action = [&](const char* name, const char* help, int (*action)(const KeysFlags&)) {
    auto* added = verb->add_subcommand(name, help);
    added
        ->add_option("--dir", flags->folder,
                     "folder of the server's key and the list; default: this one, else keys")
        ->type_name("DIR");
    added->callback(
        [flags, action, &command] { command = [flags, action] { return action(*flags); }; });
    return added;
  };
  auto* added = add_action("add", "List one more key", add);
  added->add_option("NAME", flags->name, "of the key, for people; also of its file, NAME.key")
      ->required()
      ->type_name("");
  auto* role = added->add_option("--role", flags->role, "client, worker or reader")
                   ->required()
                   ->type_name("ROLE");
  protocol::note_choices(role, kRoles);
  added
      ->add_option("--public", flags->public_key,
                   "public key that was made elsewhere; default: a new pair, written to NAME.key")
      ->type_name("KEY");
  add_format_flag(*add_action("list", "Show the keys that are listed", list), flags->format);
  add_action("revoke", "List a key no more", revoke)
      ->add_option("NAME", flags->name, "of the key")
      ->required()
      ->type_name("");
}

}  // namespace oblique::client
