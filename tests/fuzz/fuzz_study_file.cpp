#include <cstddef>
#include <cstdint>
#include <string_view>

#include "client/study/study_file.h"
#include "worker/solver/model/errors.h"

/// Checks that a study file gives a study or an InputError. Does not check whether the tip reaches
/// H, because computing falls takes long.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    oblique::client::parse_study(text, "fuzz.toml", [](const auto&) {});
  } catch (const oblique::solver::InputError&) {
  }
  return 0;
}
