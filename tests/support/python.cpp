#include "tests/support/python.h"

#include <fstream>

#include "tests/support/process.h"

namespace oblique::test {

std::string said_by_python(const TemporaryFolder& folder, const std::string& program) {
  std::ofstream(folder.file("script.py")) << program;
  const Outcome outcome = Process(folder, OBLIQUE_PYTHON, {"script.py"}).outcome();
  return outcome.out + outcome.err;
}

}  // namespace oblique::test
