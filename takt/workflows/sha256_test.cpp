// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/sha256.h"

#include <gtest/gtest.h>

namespace takt {
namespace {

std::string sha256(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.digest();
}

// The examples that NIST publishes with FIPS 180-4.
TEST(Sha256, GivesTheStandardsVectors) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1'000'000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PiecesGiveTheSameAsTheWhole) {
  std::string bytes;
  for (std::size_t length = 0; length < 260; ++length) {
    for (const std::size_t piece : {1u, 7u, 63u, 64u, 65u}) {
      Sha256 hash;
      for (std::size_t at = 0; at < length; at += piece) hash.update(std::string_view(bytes).substr(at, piece));
      EXPECT_EQ(hash.digest(), sha256(bytes)) << length << " bytes in pieces of " << piece;
    }
    bytes += static_cast<char>(length * 37);
  }
}

}  // namespace
}  // namespace takt
