// Program of a reader process, for tests that run no server.
#include "server/query/query_pool.h"

int main(int, char** arguments) {
  return oblique::server::run_reader_program(arguments[2]);
}
