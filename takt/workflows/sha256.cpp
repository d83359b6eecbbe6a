// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/sha256.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <stdexcept>

namespace takt {

namespace {

void check(int success) {
  if (success != 1) throw std::runtime_error("libcrypto has no SHA-256 to offer");
}

}  // namespace

void Sha256::Free::operator()(evp_md_ctx_st* context) const {
  EVP_MD_CTX_free(context);
}

Sha256::Sha256() : context_(EVP_MD_CTX_new()) {
  check(EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr));
}

void Sha256::update(std::string_view bytes) {
  check(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()));
}

std::string Sha256::digest() {
  std::array<unsigned char, 32> sum{};
  check(EVP_DigestFinal_ex(context_.get(), sum.data(), nullptr));
  std::string digits;
  for (const unsigned char byte : sum) digits += fmt::format("{:02x}", byte);
  return digits;
}

}  // namespace takt
