#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <string_view>

namespace oblique::protocol {

/// Returns why `url` is not a valid address, or an empty text. A tcp address is tcp://HOST:PORT
/// with a port from 1 to 65535 and an IPv6 address in brackets. Addresses of other transports are
/// not checked.
std::string address_error(const std::string& url);

/// Returns the host of a tcp address without brackets, such as 127.0.0.1, fe80::1%eth0 or a name;
/// empty for other addresses.
std::string host_of(const std::string& url);

/// Returns whether a host is a name, not a number.
bool is_name(std::string_view host);

/// Looks up the host of a tcp address once, on a thread of its own, because a lookup takes many
/// seconds if name servers do not answer. Nothing waits for that thread.
class AddressLookup {
 public:
  explicit AddressLookup(const std::string& url);
  /// Returns the error message if the lookup has ended and found no address, or an empty text.
  std::string error() const;

 private:
  std::string host_;
  std::shared_ptr<std::atomic<bool>> found_none_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace oblique::protocol
