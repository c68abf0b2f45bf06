#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/frames.h"
#include "server/service/service.h"

namespace oblique::server {
namespace {

/// Ports of the service that record writes and discard everything else.
class Sink final : public Ports {
 public:
  Delivery to_worker(const std::string&, const std::string&) override { return Delivery::kSent; }
  bool is_busy(const std::string&) const override { return false; }
  bool to_client(const std::string&, const std::string&) override { return true; }
  void write(WriteJob job) override { jobs.push_back(std::move(job)); }
  bool query(QueryJob) override { return true; }
  void more_rows(std::uint64_t, std::uint64_t) override {}
  void cancel_query(std::uint64_t) override {}
  void run_check(Check) override {}
  void log(Severity, const std::string&) override {}

  std::vector<WriteJob> jobs;
};

/// Splits the input into messages to a service. The first byte of each message selects its sender
/// and length.
void converse(std::string_view input) {
  Sink ports;
  ServiceSettings settings;
  settings.solver_version = "1";
  settings.database_id = "db";
  Instant now{1000, 1'700'000'000'000};
  Service service(settings, ports, {}, now);
  while (!input.empty()) {
    const auto head = static_cast<unsigned char>(input.front());
    const std::size_t length = std::min<std::size_t>((head >> 2U) * 4U, input.size() - 1);
    const std::string_view frame = input.substr(1, length);
    input.remove_prefix(1 + length);
    const std::string identity = (head & 1U) != 0 ? "a" : "b";
    if ((head & 2U) != 0) {
      service.worker_frame(identity, frame, now);
    } else {
      service.client_frame(identity, frame, now);
    }
    for (const WriteJob& job : std::exchange(ports.jobs, {})) {
      service.written({WriteReport::Kind::kStored, job.ticket, {}}, now);
    }
    now.steady_ms += 100;
    service.tick(now);
    service.scheduler().check_invariants();
  }
}

}  // namespace
}  // namespace oblique::server

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  oblique::protocol::silence_protobuf();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  oblique::server::converse({reinterpret_cast<const char*>(data), size});
  return 0;
}
