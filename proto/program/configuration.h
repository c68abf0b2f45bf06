#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "proto/program/log.h"

namespace oblique::protocol {

/// Settings of a program from a TOML file, environment variables and flags; later ones take
/// precedence (README.md). Options that are not `configurable` are flags only.
class Configuration {
 public:
  /// Adds --config, --no-config and --print-config to `app`, which must outlive this. Names of
  /// variables begin with `prefix`, as "OBLIQUE_SERVER_". The default file is `name` in the
  /// configuration folder of this installation, if it exists.
  Configuration(CLI::App& app, std::string prefix, const std::string& name);

  /// Adds --log-level, --log-format and --quiet. `settings` must outlive this.
  void add_log_options(LogSettings& settings);

  /// Sets all options; call it after they were added. Returns the exit code if the program must
  /// end: 0 after --help and --version, kWrongUsage after printing an error.
  std::optional<int> parse(int argc, const char* const* argv);

  /// Whether --print-config was given.
  bool is_to_be_printed() const { return print_; }
  /// The effective settings as a configuration file.
  std::string printed() const;

 private:
  struct Setting {
    CLI::Option* option;
    std::string key;              ///< "limits_connections"
    std::string shared_variable;  ///< variable that several programs read; empty: none
  };

  std::string file_to_read() const;
  // Set options that have no value yet. `place` is set to the place of the current value, for
  // errors.
  void set_from_environment(std::string& place) const;
  void set_from_file(std::string& place) const;

  CLI::App& app_;
  std::string prefix_;
  std::string default_file_;
  std::string file_;
  bool without_places_ = false;
  bool print_ = false;
  CLI::Option* quiet_ = nullptr;
  std::vector<Setting> settings_;  ///< in the order of --help
};

}  // namespace oblique::protocol
