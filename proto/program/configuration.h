#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "proto/program/log.h"

namespace oblique::protocol {

/// Settings of a program. They come from a TOML file, environment variables and flags; flags take
/// precedence over variables, and variables over the file (README.md). Options that are not
/// `configurable` can only be set by flags.
class Configuration {
 public:
  /// Adds --config, --no-config and --print-config to `app`, which must outlive this object. Names
  /// of variables begin with `prefix`, such as "OBLIQUE_SERVER_". The default file is `name` in the
  /// configuration folder of this installation, if that file exists.
  Configuration(CLI::App& app, std::string prefix, const std::string& name);

  /// Adds --log-level, --log-format and --quiet. `settings` must outlive this object.
  void add_log_options(LogSettings& settings);

  /// Sets all options. Must be called after all options were added. Returns the exit code if the
  /// program must end: 0 after --help and --version, kWrongUsage after printing an error.
  std::optional<int> parse(int argc, const char* const* argv);

  /// Returns whether --print-config was given.
  bool is_to_be_printed() const { return print_; }
  /// Returns the effective settings as a configuration file.
  std::string printed() const;

 private:
  struct Setting {
    CLI::Option* option;
    std::string key;              ///< "limits_connections"
    std::string shared_variable;  ///< variable that several programs read; empty if there is none
  };

  std::string file_to_read() const;
  // Both functions set the options that have no value yet. Before they set an option, `place`
  // becomes the place of its value, for error messages.
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
