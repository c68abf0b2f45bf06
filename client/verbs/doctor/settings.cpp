#include "client/verbs/doctor/settings.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <string_view>

#include <spdlog/fmt/fmt.h>

#include "proto/keys/key_file.h"
#include "proto/text.h"

// Of the C library.
extern char** environ;  // NOLINT(readability-redundant-declaration)

namespace oblique::client::doctor {
namespace {

/// Whether its value may be shown: what is read, and no secret. Those of server and worker are
/// settings (--print-config has them all); tokens and keys are in files, which they name.
bool may_show(std::string_view name) {
  constexpr std::array<std::string_view, 5> kRead{"OBLIQUE_SERVER", "OBLIQUE_KEYS", "OBLIQUE_PAGER",
                                                  "PAGER", "NO_COLOR"};
  return std::find(kRead.begin(), kRead.end(), name) != kRead.end() ||
         name.starts_with("OBLIQUE_SERVER_") || name.starts_with("OBLIQUE_WORKER_");
}

void add_variables(Findings& found) {
  std::vector<std::string> lines;
  for (char** each = environ; each != nullptr && *each != nullptr; ++each) {
    const std::string_view line(*each);
    const auto name = line.substr(0, line.find('='));
    if (name.starts_with("OBLIQUE_") || may_show(name)) {
      lines.emplace_back(line);
    }
  }
  std::sort(lines.begin(), lines.end());
  auto values = nlohmann::ordered_json::object();
  for (const std::string& line : lines) {
    const std::string name = line.substr(0, line.find('='));
    const std::string value = line.size() > name.size() ? line.substr(name.size() + 1) : "";
    const std::string text = !may_show(name) ? std::string("is set; its value is not shown")
                             : value.empty() ? std::string("is empty, which counts as not set")
                                             : value;
    values[name] = text;
    found.add("", "variable", name + " = " + text, nullptr);
    if (!may_show(name)) {
      found.odd.push_back(
          fmt::format("{} is set, and no program of oblique reads it: check its name.", name));
    }
  }
  if (lines.empty()) {
    found.add("", "variables", "none that is read", nullptr);
  }
  found.note("variables", values);
}

/// Mode, owner and role of a key file; nothing of what it holds.
void add_key(Findings& found, const std::string& file) {
  struct stat about {};
  if (::stat(file.c_str(), &about) != 0) {
    found.add("key_file", "key file", fmt::format("{} is not there", file), nullptr);
    found.broken.push_back(fmt::format(
        "There is no key file {}: ask who runs the server for one, and name it with --keys or "
        "OBLIQUE_KEYS.",
        file));
    return;
  }
  constexpr unsigned kPermissions = 07777;
  const std::string mode = fmt::format("{:04o}", about.st_mode & kPermissions);
  std::string state = "can be used";
  try {
    (void)protocol::read_key_file(file);
  } catch (const std::exception& error) {
    state = "cannot be used";
    found.broken.push_back(as_sentence(error.what()));
  }
  found.add("key_file", "key file",
            fmt::format("{}: mode {}, {}, {}", file, mode,
                        about.st_uid == ::geteuid() ? "ours" : "of another user", state),
            {{"file", file}, {"mode", mode}, {"usable", state == "can be used"}});
}

void add_drawing_program(Findings& found) {
  constexpr const char* kProgram = "gnuplot";
  const std::string path = variable("PATH");
  for (const std::string_view folder : protocol::split(path, ':')) {
    const auto program = std::filesystem::path(folder) / kProgram;
    if (!folder.empty() && ::access(program.c_str(), X_OK) == 0) {
      found.add(kProgram, program.string());
      return;
    }
  }
  found.add(kProgram, kProgram, "is not there; pictures need it (gnuplot-nox)", nullptr);
}

}  // namespace

Findings examine_settings(const std::string& key_file) {
  Findings found{"settings", "settings"};
  add_variables(found);
  const std::string key = key_file.empty() ? variable("OBLIQUE_KEYS") : key_file;
  if (!key.empty()) {
    add_key(found, key);
  }
  add_drawing_program(found);
  return found;
}

}  // namespace oblique::client::doctor
