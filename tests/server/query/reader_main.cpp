// A reader process of its own, so that these tests need no server.
#include "server/query/query_pool.h"

int main(int, char** arguments) {
  return oblique::server::run_reader_program(arguments[2]);
}
