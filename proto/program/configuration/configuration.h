#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "proto/program/configuration/configuration_file.h"

namespace oblique::protocol {

/// What is fixed for a program.
struct ConfigurationPlaces {
  std::string environment_prefix;   ///< of variables, as "OBLIQUE_SERVER_"
  std::string default_file;         ///< read when it is there; empty: none
  std::vector<std::string> tables;  ///< of the file: first words of flags that stand in a table
};

/// The file NAME where the installation of this program has its configuration: /etc/oblique of
/// programs in /usr/bin, PREFIX/etc/oblique of those in PREFIX/bin. Empty where the system does not
/// tell where the program lies.
std::string default_configuration_file(const std::string& name);

/// The settings of a program from a TOML file, environment variables and flags, the later being
/// stronger. An option has one name, written in three ways: the flag --worker-port is the variable
/// OBLIQUE_SERVER_WORKER_PORT and the key worker_port; --limits-connections is the variable
/// OBLIQUE_SERVER_LIMITS_CONNECTIONS and the key connections of the table [limits]. A value that is
/// out of range is wrong usage wherever it stands, also where a stronger place overrides it.
class Configuration {
 public:
  /// Adds --config, --no-config and --print-config to `app`, which this must not outlive.
  Configuration(CLI::App& app, ConfigurationPlaces places);

  /// The option is of one run of the program: it is taken from the command line alone.
  void keep_to_command_line(const CLI::Option* option);
  /// The flag `brief` stands for `option` with that value; together they are wrong usage.
  void add_short_form(CLI::Option* brief, CLI::Option* option, const std::string& value);

  /// Reads the three places and sets the options, which all must have been added. The exit code
  /// when there is nothing more to do: 0 after --help and --version, kWrongUsage after wrong usage,
  /// which is told with its place.
  std::optional<int> parse(int argc, const char* const* argv);

  /// Whether what holds is to be printed, and nothing done.
  bool is_to_be_printed() const { return print_; }
  /// Where the value of an option is from, as "environment variable OBLIQUE_KEYS"; "default" where
  /// nobody gave one. After `parse`.
  std::string origin_of(const std::string& flag) const;
  /// What holds, as a file that gives the same, with the place of each value in a comment.
  std::string printed() const;

 private:
  struct Setting {
    CLI::Option* option;
    std::string key;              // "limits.connections"
    std::string variable;         // "OBLIQUE_SERVER_LIMITS_CONNECTIONS"
    std::string shared_variable;  // of several programs, weaker; empty: none
    std::string flag;             // that was given, or stands for it
    std::string origin = "default";
  };
  struct ShortForm {
    CLI::Option* brief;
    CLI::Option* option;
    std::string value;
  };

  void collect_settings();
  void tell_of_places();
  void expand_short_forms();
  std::string key_of(const std::string& flag) const;
  void read_places();
  std::string file_to_read() const;
  void check_keys(const std::vector<WrittenValue>& written) const;
  void apply(Setting& setting, const std::map<std::string, WrittenValue>& written);
  void check_exclusions() const;

  CLI::App& app_;
  ConfigurationPlaces places_;
  std::string file_;
  bool without_places_ = false;
  bool print_ = false;
  std::string read_file_;  // empty: none
  std::set<const CLI::Option*> command_line_only_;
  std::vector<ShortForm> short_forms_;
  std::vector<Setting> settings_;  // in the order of the options
};

}  // namespace oblique::protocol
