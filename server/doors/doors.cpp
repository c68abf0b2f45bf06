#include "server/doors/doors.h"

#include <spdlog/fmt/fmt.h>

namespace oblique::server {

Doors::Doors(const DoorSettings& settings)
    : address_(address_to_bind(settings)), access_(access_of(settings)) {}

std::optional<std::string> Doors::warning(std::int64_t now_ms) {
  constexpr std::int64_t kEvery_ms = 600'000;
  if (access_ != Access::kInsecure || now_ms < next_warning_ms_) {
    return std::nullopt;
  }
  next_warning_ms_ = now_ms + kEvery_ms;
  return fmt::format(
      "INSECURE: whoever reaches {} can submit, cancel and read studies and store false results, "
      "and all is sent as plain text, for the server was started with --insecure. `oblique keygen` "
      "makes keys",
      address_);
}

}  // namespace oblique::server
