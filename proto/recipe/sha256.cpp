#include "proto/recipe/sha256.h"

#include <sodium/utils.h>

namespace oblique::protocol {

Sha256::Sha256() {
  crypto_hash_sha256_init(&state_);
}

void Sha256::add(std::string_view bytes) {
  crypto_hash_sha256_update(&state_, reinterpret_cast<const unsigned char*>(bytes.data()),
                            bytes.size());
}

Sha256::Digest Sha256::digest() {
  Digest digest{};
  crypto_hash_sha256_final(&state_, digest.data());
  return digest;
}

std::string hexadecimal(const Sha256::Digest& digest) {
  std::string text(2 * digest.size() + 1, '\0');  // with the zero that libsodium ends it with
  sodium_bin2hex(text.data(), text.size(), digest.data(), digest.size());
  text.pop_back();
  return text;
}

}  // namespace oblique::protocol
