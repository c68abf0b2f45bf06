#pragma once

#include <string>

#include "tests/support/temporary_folder.h"

namespace oblique::test {

/// Output and errors of a Python program that runs in `folder`.
std::string said_by_python(const TemporaryFolder& folder, const std::string& program);

}  // namespace oblique::test
