#include <ios>

#include "client/commands/commands.h"
#include "client/io/console.h"
#include "proto/frames.h"
#include "proto/program/process.h"

int main(int argc, char** argv) {
  oblique::protocol::prepare_process();
  std::ios::sync_with_stdio(false);
  oblique::protocol::silence_protobuf();
  auto console = oblique::client::Console::of_process();
  return oblique::client::run_command_line(console, argc, argv);
}
