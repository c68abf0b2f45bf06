#pragma once

#include <string>

namespace oblique::protocol {

/// Why nothing can be connected to at `url`, or an empty text: a tcp address is tcp://HOST:PORT
/// with a port from 1 to 65535, an address of IPv6 in brackets. Addresses of other kinds pass.
std::string address_error(const std::string& url);

/// The host of such an address, as 127.0.0.1, fe80::1%eth0 (without brackets) or a name; empty
/// where it is none.
std::string host_of(const std::string& url);

/// Families of a host's addresses.
struct Families {
  bool has_v4 = false;
  bool has_v6 = false;
};

/// Of a host that is written as a number, or of the present addresses of a name: none for an
/// unknown name. The lookup may take seconds if name servers do not answer.
Families families_of(const std::string& host);

}  // namespace oblique::protocol
