#include <cstddef>
#include <cstdint>
#include <string_view>

#include "client/study/study_file.h"
#include "worker/solver/model/errors.h"

/// A study file gives a study or an InputError. Whether the tip reaches H is not checked, because
/// that computes falls, which takes long.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    oblique::client::parse_study(text, "fuzz.toml", [](const auto&) {});
  } catch (const oblique::solver::InputError&) {
  }
  return 0;
}
