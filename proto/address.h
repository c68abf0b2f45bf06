#pragma once

#include <string>

namespace oblique::protocol {

/// Returns why `url` is not a valid address, or an empty text. A tcp address is tcp://HOST:PORT
/// with a port from 1 to 65535 and an IPv6 address in brackets. Addresses of other transports are
/// not checked.
std::string address_error(const std::string& url);

/// Returns the host of a tcp address without brackets, such as 127.0.0.1, fe80::1%eth0 or a name;
/// empty for other addresses.
std::string host_of(const std::string& url);

/// The IP versions for which a host has addresses.
struct Families {
  bool has_v4 = false;
  bool has_v6 = false;
};

/// Returns the IP versions of a numeric host, or of the addresses that a name has now; none for an
/// unknown name. The lookup may take seconds if name servers do not answer.
Families families_of(const std::string& host);

}  // namespace oblique::protocol
