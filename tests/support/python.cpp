#include "tests/support/python.h"

#include <array>
#include <cstdio>
#include <fstream>

namespace oblique::test {

std::string said_by_python(const TemporaryFolder& folder, const std::string& program) {
  std::ofstream(folder.path() / "script.py") << program;
  const std::string command =
      "cd '" + folder.path().string() + "' && '" + OBLIQUE_PYTHON + "' script.py 2>&1";
  FILE* const pipe = popen(command.c_str(), "r");
  std::string said;
  std::array<char, 4096> part{};
  for (std::size_t got = 0; (got = fread(part.data(), 1, part.size(), pipe)) > 0;) {
    said.append(part.data(), got);
  }
  pclose(pipe);
  return said;
}

bool has_numpy(const TemporaryFolder& folder) {
  return said_by_python(folder, "import numpy; print('there')") == "there\n";
}

}  // namespace oblique::test
