#include "client/verbs/command_line.h"
#include "proto/frames.h"

int main(int argc, char** argv) {
  oblique::protocol::silence_protobuf();
  return oblique::client::run_command_line(argc, argv);
}
