#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

// Packed lists as the views give them. Every function returns false, and may leave anything in
// `to`, for what is not packed as the server does it.
namespace oblique::server {

/// How many decimals a unit of a packed list has.
inline constexpr int kTimeDecimals = 12;
inline constexpr int kForceDecimals = 5;

/// The whole numbers of a JSON array without spaces, each of at most 15 digits.
bool read_packed(std::string_view packed, std::vector<std::int64_t>& numbers);

/// Appends number / 10^decimals as SQLite writes it. The number has at most 15 digits.
void append_decimal(std::int64_t number, int decimals, std::string& to);

/// [[t_s,fn_N,ft_N,major],...] of t, fn, ft in turn.
bool unpack_peaks(const std::vector<std::int64_t>& numbers, std::string& to);

/// Of groups of `stride` numbers the first and the one `second` behind it make an element.
struct Pairs {
  std::size_t stride;
  std::size_t second;
  int first_decimals;
  int second_decimals;
};
bool unpack_pairs(const std::vector<std::int64_t>& numbers, const Pairs& pairs, std::string& to);

/// [["compression",t0_s,t1_s],...] of the ends of all phases.
bool unpack_phases(const std::vector<std::int64_t>& ends, std::string& to);

/// Of a list as the views give it, [[a,b,...],...], the list of one member of its elements: those
/// in which `where`, if not negative, is 1.
bool member_of_elements(std::string_view list, int member, int where, std::string& to);

}  // namespace oblique::server
