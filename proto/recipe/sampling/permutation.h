#pragma once

#include <cstdint>

namespace oblique::sampling {

/// Where a permutation of 0 ... n-1, chosen by `key`, takes `i`. `i` must be below `n`. Needs no
/// list: a few hashes on average, at most some dozens.
std::uint64_t permuted(std::uint64_t i, std::uint64_t n, std::uint64_t key);

}  // namespace oblique::sampling
