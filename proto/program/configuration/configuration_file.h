#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace oblique::protocol {

/// What is wrong with a value of the configuration, and where it stands; for people.
class ConfigurationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class ValueKind { kText, kNumber, kTruth };

/// One key of a configuration file with what it is set to.
struct WrittenValue {
  std::string key;                    ///< with its table, as "limits.connections"
  std::string place;                  ///< "server.toml:3"
  std::vector<std::string> values;    ///< several where the file has a list
  ValueKind kind = ValueKind::kText;  ///< of all values
  bool is_list = false;
};

/// The keys of a TOML file in its order. Tables have one level; an empty one is a key without
/// values. Throws ConfigurationError, with
/// file and line, for a file that cannot be read or is no TOML, and for values that no setting has:
/// dates, tables in tables, lists in lists or of different kinds.
std::vector<WrittenValue> read_configuration_file(const std::string& file);

/// The text in quotes, as TOML has it.
std::string toml_text(const std::string& text);

}  // namespace oblique::protocol
