#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "proto/program/log.h"

namespace oblique::protocol {

/// The settings of a program from a TOML file, environment variables and flags, the later being
/// stronger (README.md). Options that are not `configurable` are flags only.
class Configuration {
 public:
  /// Adds --config, --no-config and --print-config to `app`, which must outlive this. Variables
  /// begin with `prefix`, as "OBLIQUE_SERVER_". Without another one, the file `name` in the
  /// configuration folder of this installation is read when it exists.
  Configuration(CLI::App& app, std::string prefix, const std::string& name);

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

  std::string file_to_read() const;
  // Set options that are not set yet. `place` gets the place of the present value, for errors.
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
