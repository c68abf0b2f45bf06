#pragma once

#include <string>

namespace oblique::protocol {

/// The commit and the build settings of a program.
struct Origin {
  std::string version;        ///< "0.2.0"
  std::string commit;         ///< the first 12 digits of the commit; empty if unknown
  std::string committed_on;   ///< "2026-11-20"; empty: unknown
  bool with_changes = false;  ///< true if the tree had uncommitted changes
  std::string compiler;       ///< "GCC 12.2.0"
  std::string build_type;  ///< "Release", or with sanitizers "RelWithDebInfo, sanitizers: thread"
};

Origin origin();

/// Returns the text that `--version` prints after the program's name: "0.2.0 (commit 0123456789ab,
/// 2026-11-20)", "0.2.0 (commit 0123456789ab with changes, 2026-11-20)" or "0.2.0 (commit
/// unknown)".
std::string version_and_commit();

}  // namespace oblique::protocol
