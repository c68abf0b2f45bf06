#pragma once

#include <cstddef>
#include <functional>

namespace oblique::client {

/// Calls work(0), ..., work(count - 1), each once, started in that order, on as many threads as
/// this machine has cores. An exception of one call is thrown again here once all that had been
/// started are done; calls not yet started are left out then.
void for_each_in_parallel(std::size_t count, const std::function<void(std::size_t)>& work);

}  // namespace oblique::client
