#pragma once

#include <string_view>

namespace oblique::bench {

/// Floating-point operations a second, in doubles and a multiply-add as two, that one core shows
/// with the vectors of the instruction set: twelve independent chains of multiply-adds in
/// registers, for some ten milliseconds. For "baseline", multiplications and additions apart.
double multiply_add_peak_per_s(std::string_view instruction_set);

}  // namespace oblique::bench
