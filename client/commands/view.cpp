#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <ostream>
#include <stdexcept>
#include <string>

#include <spdlog/fmt/fmt.h>

#include "client/commands/commands.h"
#include "client/commands/shared.h"
#include "client/service/connection.h"
#include "client/service/run_service.h"
#include "proto/program/process.h"
#include "proto/program/usage.h"
#include "proto/text.h"
#include "worker/solver/model/errors.h"

namespace oblique::client {
namespace {

constexpr const char* kViewExamples = R"(Examples:
  oblique view
  oblique view friction.db
  oblique view big.db --port 8000

Prints an address to open in a browser on this machine, until Ctrl-C. Over ssh, forward the port:
ssh -L 8000:127.0.0.1:8000 HOST. Unfinished studies continue meanwhile. Start other studies on the
page: commands that change the file, such as `oblique run`, are refused until `oblique view` ends.
Links to the page stay valid only with the same --port.)";

struct ViewFlags {
  RunSettings settings;
  int port = 0;
  std::string server;  // value of --server; the command refuses it and names the remedy
};

/// Waits for a signal. Throws ProcessError if the server or the workers end.
void wait_for_the_end(Console& console, EmbeddedService& service, protocol::StopSignals& stop) {
  constexpr std::chrono::milliseconds kLook{500};
  while (!stop.wait(kLook)) {
    service.check();
    if (const auto news = service.news(); !news.empty()) {
      console.notes() << protocol::visible_lines(news) << '\n';
    }
  }
}

/// Returns whether another program uses the port.
bool is_taken(int port) {
  zmq::context_t context;
  zmq::socket_t probe(context, zmq::socket_type::rep);
  return zmq_bind(probe.handle(), fmt::format("tcp://127.0.0.1:{}", port).c_str()) != 0 &&
         errno == EADDRINUSE;
}

int view(const ViewFlags& flags, Console& console) {
  if (!flags.server.empty()) {
    throw solver::InputError(
        "--server is not allowed: view shows a database file. A server has its own page: it prints "
        "the address when it starts; `oblique-server --http ADDRESS:PORT` sets it");
  }
  ServiceSettings how = flags.settings.service;
  const std::string file = protocol::visible(how.database.string());
  if (!std::filesystem::exists(how.database)) {
    throw std::runtime_error(
        fmt::format("there is no file {}: `oblique run` creates a database", file));
  }
  if (::access(how.database.c_str(), W_OK) != 0) {
    throw std::runtime_error(
        fmt::format("{0} is read-only, but the server of the page must write to it: show a copy, "
                    "made with `oblique backup copy.db --db {0}`",
                    file));
  }
  refuse_used_database(how.database);
  how.tell = [&console](const std::string& sentence) { console.note(sentence); };
  how.http = fmt::format("127.0.0.1:{}", flags.port);
  // created before any thread starts; see StopSignals
  protocol::StopSignals stop;
  try {
    EmbeddedService service(how, stop);
    // Anyone with this address can change studies. The address is data on standard output,
    // not a note, because notes may be logged.
    console.out() << service.page_url() << std::endl;
    console.note("Open this address in a browser; Ctrl-C ends it.");
    wait_for_the_end(console, service, stop);
    service.stop();
  } catch (const Interrupted&) {
    return stop.exit_code();
  } catch (const ProcessError&) {
    if (flags.port != 0 && is_taken(flags.port)) {
      throw std::runtime_error(fmt::format(
          "port {} is in use: name another with --port, or omit it to let the system choose",
          flags.port));
    }
    throw;
  }
  return kDone;
}

}  // namespace

void add_view(CLI::App& app, Action& parsed) {
  auto [command, flags] =
      new_command(app, parsed, "view",
                  "Show a database as a page in the browser, with a temporary server and worker",
                  kViewExamples, view);
  add_database_argument(command, flags.settings.service.database);
  constexpr double kLargestPort = 65535;
  command.add_option("--port", flags.port, "port of the page; 0: chosen by the system")
      ->check(protocol::number_between(0, kLargestPort))
      ->type_name("N")
      ->capture_default_str();
  command.add_option("--server", flags.server)->group("");  // hidden
  add_network_disk_flag(command, flags.settings.service.allow_network_disk);
  add_worker_flags(command, flags.settings);
}

}  // namespace oblique::client
