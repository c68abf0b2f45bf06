#include "client/verbs/doctor/programs.h"

#include <google/protobuf/stubs/common.h>
#include <sodium.h>
#include <sqlite3.h>
#include <unistd.h>
#include <zmq.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <thread>

#include <spdlog/fmt/fmt.h>

#include "client/service/child_process.h"
#include "proto/program/origin/origin.h"

namespace oblique::client::doctor {
namespace {

/// What `program --version` prints, without the line's end; none where it does not in time.
std::optional<std::string> version_line(const std::filesystem::path& program,
                                        std::chrono::steady_clock::time_point end) {
  constexpr std::chrono::milliseconds kPause{2};
  constexpr std::size_t kMostBytes = 1000;
  try {
    ChildSettings settings{program, {"--version"}};
    settings.keep_output = true;
    ChildProcess child(settings);
    while (child.is_running()) {
      if (std::chrono::steady_clock::now() > end) {
        return std::nullopt;
      }
      std::this_thread::sleep_for(kPause);
    }
    std::string line = child.output(kMostBytes);
    line.resize(std::min(line.find('\n'), line.size()));
    return child.succeeded() && !line.empty() ? std::optional(line) : std::nullopt;
  } catch (const ProcessError&) {
    return std::nullopt;
  }
}

void add_sibling(Findings& found, const std::filesystem::path& folder, const std::string& name,
                 std::chrono::steady_clock::time_point end) {
  const auto program = folder / name;
  if (::access(program.c_str(), X_OK) != 0) {
    found.add(name, name, "not in the same folder", nullptr);
    found.odd.push_back(fmt::format(
        "{0} is not beside this program: `oblique run` and `oblique view` need it there. Of "
        "Debian's packages {0} has it.",
        name));
    return;
  }
  const auto line = version_line(program, end);
  const std::string own = fmt::format("{} {}", name, protocol::version_and_commit());
  if (!line) {
    found.add(name, name, "does not tell its version", nullptr);
    found.broken.push_back(fmt::format(
        "{} does not tell its version: run `{} --version` to see why.", name, program.string()));
    return;
  }
  found.add(name, name, *line == own ? "of the same build" : *line, *line);
  if (*line != own) {
    found.odd.push_back(
        fmt::format("{} is another build than this program ({}): install all of one.", *line,
                    protocol::version_and_commit()));
  }
}

std::string version_of_zmq() {
  int major = 0;
  int minor = 0;
  int patch = 0;
  zmq_version(&major, &minor, &patch);
  return fmt::format("{}.{}.{}", major, minor, patch);
}

}  // namespace

Findings examine_programs(std::chrono::steady_clock::time_point end) {
  Findings found{"programs", "programs"};
  const auto origin = protocol::origin();
  found.add("oblique", protocol::version_and_commit());
  found.note("version", origin.version);
  found.note("commit", origin.commit.empty() ? nlohmann::ordered_json()
                                             : nlohmann::ordered_json(origin.commit));
  found.note("with_changes", origin.with_changes);
  found.add("built", "built", fmt::format("{}, {}", origin.compiler, origin.build_type),
            {{"compiler", origin.compiler}, {"type", origin.build_type}});
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  found.add("folder", program.parent_path().string());
  for (const char* name : {"oblique-server", "oblique-worker"}) {
    add_sibling(found, program.parent_path(), name, end);
  }
  const std::string protobuf = google::protobuf::internal::VersionString(GOOGLE_PROTOBUF_VERSION);
  found.add("libraries", "libraries",
            fmt::format("ZeroMQ {}, SQLite {}, Protobuf {}, libsodium {}", version_of_zmq(),
                        sqlite3_libversion(), protobuf, sodium_version_string()),
            {{"zeromq", version_of_zmq()},
             {"sqlite", sqlite3_libversion()},
             {"protobuf", protobuf},
             {"libsodium", sodium_version_string()}});
  if (origin.build_type != "Release") {
    found.odd.push_back(
        fmt::format("This program was built as \"{}\": it is slower than one built as Release.",
                    origin.build_type));
  }
  return found;
}

}  // namespace oblique::client::doctor
