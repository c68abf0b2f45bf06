#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "proto/program/log.h"

namespace oblique::protocol {

/// What is fixed for a program.
struct ConfigurationPlaces {
  std::string environment_prefix;  ///< of variables, as "OBLIQUE_SERVER_"
  std::string default_file;        ///< read when it exists; empty: none
};

/// The file NAME in the configuration folder of this installation: /etc/oblique of programs in
/// /usr/bin, PREFIX/etc/oblique of those in PREFIX/bin. Empty where the system does not give the
/// path of the program.
std::string default_configuration_file(const std::string& name);

/// The settings of a program from a TOML file, environment variables and flags, the later being
/// stronger. The flag --worker-port is the variable OBLIQUE_SERVER_WORKER_PORT and the key
/// worker_port, or the key port of a table [worker]. Options that are not `configurable` are flags
/// only.
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
    std::string key;              ///< "limits_connections"
    std::string shared_variable;  ///< of several programs; empty: none
  };
  /// Values of file or environment, and their place, as "server.toml:3:1: ".
  struct PlacedValues {
    std::vector<std::string> values;
    std::string place;
  };
  using Given = std::map<std::string, PlacedValues>;  ///< by key

  void find_settings();
  std::string file_to_read() const;
  Given values_of_places() const;
  void read_file(const std::string& path, Given& given) const;

  CLI::App& app_;
  ConfigurationPlaces places_;
  std::string file_;
  bool without_places_ = false;
  bool print_ = false;
  CLI::Option* quiet_ = nullptr;
  std::vector<Setting> settings_;  ///< in the order of --help
};

}  // namespace oblique::protocol
