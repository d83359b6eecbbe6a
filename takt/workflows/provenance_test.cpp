// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/provenance.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "takt/error.h"
#include "takt/workflows/sha256.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

class ProvenanceTest : public testing::Test {
 protected:
  ProvenanceTest() { fs::create_directories(folder_ / "data"); }
  ~ProvenanceTest() override { fs::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return (folder_ / name).string();
  }

  fs::path folder_ = fs::path(testing::TempDir()) / "takt_provenance";
};

TEST_F(ProvenanceTest, NamesEachInputOnce) {
  const std::string a = write("a.csv", "abc"), b = write("b.csv", "");
  const Provenance p = make_provenance("takt align a.csv b.csv", {b, a, a}, 7);
  ASSERT_EQ(p.inputs.size(), 2u);
  EXPECT_EQ(p.inputs[0].path, a);
  EXPECT_EQ(p.inputs[0].sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(p.inputs[1].sha256, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(p.seed, 7u);
  for (const auto& library : p.libraries) EXPECT_FALSE(library.version.empty()) << library.name;
}

TEST_F(ProvenanceTest, ManyPicturesBecomeOneInputThatSha256sumCanCheck) {
  std::vector<std::string> files;
  Sha256 printed;
  for (char c = 'a'; c <= 'z'; ++c) {
    files.push_back(write(std::string("data/") + c + ".png", std::string(1, c)));
    printed.update(sha256_of_file(files.back()) + "  " + c + ".png\n");
  }
  const Provenance p = make_provenance("", files, {});
  ASSERT_EQ(p.inputs.size(), 1u);
  EXPECT_EQ(p.inputs[0].path, (folder_ / "data").string() + "/* (26 files)");
  EXPECT_EQ(p.inputs[0].sha256, printed.digest());
}

TEST_F(ProvenanceTest, AFolderStandsForItsFiles) {
  const std::string a = write("data/a.png", "a"), b = write("data/b.png", "b");
  Sha256 printed;
  printed.update(sha256_of_file(a) + "  a.png\n");
  printed.update(sha256_of_file(b) + "  b.png\n");
  const Provenance p = make_provenance("", {(folder_ / "data").string()}, {});
  ASSERT_EQ(p.inputs.size(), 1u);
  EXPECT_EQ(p.inputs[0].path, (folder_ / "data").string() + "/* (2 files)");
  EXPECT_EQ(p.inputs[0].sha256, printed.digest());
}

TEST_F(ProvenanceTest, AMissingFileIsSaid) {
  EXPECT_THROW(static_cast<void>(make_provenance("", {(folder_ / "none").string()}, {})), Error);
  EXPECT_THROW(static_cast<void>(sha256_of_file(folder_.string())), Error);  // a folder is not a file
}

}  // namespace
}  // namespace takt
