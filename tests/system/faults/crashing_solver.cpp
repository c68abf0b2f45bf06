// A library that a test loads into the worker with LD_PRELOAD, so that the worker needs no hook.
// The process crashes where the solver would report that it cannot solve a point.
#include <dlfcn.h>

#include <csignal>
#include <cstring>
#include <typeinfo>

// NOLINTNEXTLINE(bugprone-reserved-identifier): the C++ runtime calls the function by this name
extern "C" [[noreturn]] void __cxa_throw(void* exception, std::type_info* type,
                                         void (*destructor)(void*)) {
  if (std::strcmp(type->name(), "N7oblique6solver10SolveErrorE") == 0 ||
      std::strcmp(type->name(), "N7oblique6solver10InputErrorE") == 0) {
    std::signal(SIGSEGV, SIG_DFL);  // a sanitizer's handler would exit instead
    raise(SIGSEGV);
  }
  using Throw = void (*)(void*, std::type_info*, void (*)(void*));
  reinterpret_cast<Throw>(dlsym(RTLD_NEXT, "__cxa_throw"))(exception, type, destructor);
  __builtin_unreachable();
}
