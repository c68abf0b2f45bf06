#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "proto/program/log.h"

namespace oblique::protocol {

/// What is fixed for a program.
struct ConfigurationPlaces {
  std::string environment_prefix;   ///< of variables, as "OBLIQUE_SERVER_"
  std::string default_file;         ///< read when it exists; empty: none
  std::vector<std::string> tables;  ///< of the file: first words of flags that form a table
};

/// The file NAME in the configuration folder of this installation: /etc/oblique of programs in
/// /usr/bin, PREFIX/etc/oblique of those in PREFIX/bin. Empty where the system does not give the
/// path of the program.
std::string default_configuration_file(const std::string& name);

/// The settings of a program from a TOML file, environment variables and flags, the later being
/// stronger. The flag --worker-port is the variable OBLIQUE_SERVER_WORKER_PORT and the key
/// worker_port; --limits-connections is the variable OBLIQUE_SERVER_LIMITS_CONNECTIONS and the key
/// connections of the table [limits]. Options that are not `configurable` are flags only.
class Configuration {
 public:
  /// Adds --config, --no-config and --print-config to `app`, which must outlive this.
  Configuration(CLI::App& app, ConfigurationPlaces places);

  /// Adds --log-level, --log-format and --quiet. `settings` must outlive this.
  void add_log_options(LogSettings& settings);

  /// Sets all options, which must have been added. Returns the exit code when the program is to
  /// end: 0 after --help and --version, kWrongUsage after an error, which it has printed.
  std::optional<int> parse(int argc, const char* const* argv);

  /// Whether the program should print the settings and end.
  bool is_to_be_printed() const { return print_; }
  /// The effective settings, as a file that gives the same ones.
  std::string printed() const;

 private:
  struct Setting {
    CLI::Option* option;
    std::string key;                       ///< "limits.connections"
    std::string shared_variable;           ///< of several programs; empty: none
    std::vector<std::string> values = {};  ///< of file or environment
    std::string place = {};                ///< of these values, as "server.toml:3:1: "
  };

  void find_settings();
  std::string key_of(const std::string& flag) const;
  std::string file_to_read() const;
  void read_file();
  void read_environment();
  std::string located(const std::string& error) const;

  CLI::App& app_;
  ConfigurationPlaces places_;
  std::string file_;
  bool without_places_ = false;
  bool print_ = false;
  CLI::Option* quiet_ = nullptr;
  std::vector<Setting> settings_;  ///< in the order of --help
};

}  // namespace oblique::protocol
