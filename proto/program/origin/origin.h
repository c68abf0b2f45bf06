#pragma once

#include <string>

namespace oblique::protocol {

/// What a program was built from, and how.
struct Origin {
  std::string version;        ///< "0.2.0"
  std::string commit;         ///< its first 12 digits; empty: not known
  std::string committed_on;   ///< "2026-11-20"; empty: not known
  bool with_changes = false;  ///< the tree had changes that were not committed
  std::string compiler;       ///< "GCC 12.2.0"
  std::string build_type;  ///< "Release", or with sanitizers "RelWithDebInfo, sanitizers: thread"
};

Origin origin();

/// As `--version` says it after the program's name: "0.2.0 (commit 0123456789ab, 2026-11-20)",
/// "0.2.0 (commit 0123456789ab with changes, 2026-11-20)" or "0.2.0 (commit unknown)".
std::string version_and_commit();

}  // namespace oblique::protocol
