#pragma once

#include <string>

#include "tests/support/temporary_folder.h"

namespace oblique::test {

/// What a program in Python prints that runs with `folder` as its current one; errors too.
std::string said_by_python(const TemporaryFolder& folder, const std::string& program);

}  // namespace oblique::test
