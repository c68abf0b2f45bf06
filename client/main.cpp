#include "client/verbs.h"

int main(int argc, char** argv) {
  return oblique::client::run_command_line(argc, argv);
}
