// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/video_reader.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "takt/error.h"
#include "takt/recording/files.h"
#include "takt/recording/open_recording.h"
#include "takt/test_paths.h"

namespace takt {
namespace {

namespace fs = std::filesystem;

const std::string karma = TAKT_DATA_DIR "/gopro/karma.mp4";
const std::string max_360 = TAKT_DATA_DIR "/gopro/max-heromode.mp4";

std::string output_of(const std::string& command) {
  std::string out;
  FILE* pipe = popen((command + " 2>/dev/null").c_str(), "r");
  char buffer[4096];
  while (pipe != nullptr)
    if (const std::size_t n = std::fread(buffer, 1, sizeof buffer, pipe); n > 0)
      out.append(buffer, n);
    else
      break;
  if (pipe != nullptr) pclose(pipe);
  return out;
}

class Video : public testing::Test {
 protected:
  void SetUp() override {
    if (output_of("ffmpeg -version").empty())
      GTEST_SKIP() << "the program ffmpeg, the oracle of these tests, is missing";
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  /// A moving test picture made by ffmpeg.
  std::string make(const std::string& name, const std::string& size, int frames, const std::string& coding) const {
    std::ostringstream command;
    command << "ffmpeg -y -f lavfi -i testsrc2=size=" << size << ":rate=30000/1001 -frames:v " << frames << " "
            << coding << " '" << file(name) << "'";
    output_of(command.str());
    return file(name);
  }

 private:
  fs::path folder_ = fs::path(testing::TempDir()) / ("takt_video_" + std::to_string(::getpid()));
};

/// Presentation times as ffprobe says after decoding, in ns, from its ticks.
std::vector<std::int64_t> ffprobe_times(const std::string& path, std::int64_t base_num, std::int64_t base_den) {
  std::istringstream in(
      output_of("ffprobe -v error -select_streams v:0 -show_entries frame=pts -of csv=p=0 '" + path + "'"));
  std::vector<std::int64_t> times;
  for (std::string line; std::getline(in, line);)
    if (!line.empty()) times.push_back((std::stoll(line) * base_num * 1'000'000'000 * 2 + base_den) / (2 * base_den));
  return times;
}

std::vector<std::int64_t> in_ns(const std::vector<Stamp>& stamps) {
  std::vector<std::int64_t> out;
  for (const Stamp t : stamps) out.push_back(to_ns(t));
  return out;
}

/// Bytes of the picture without the padding of its rows.
std::string pixels(const GrayImage& image) {
  std::string out;
  for (int y = 0; y < image.height; ++y) out.append(reinterpret_cast<const char*>(image.row(y)), image.width);
  return out;
}

struct Pass {
  std::vector<std::size_t> places;
  std::vector<std::string> pictures;
  std::size_t broken = 0;
};
Pass decode(const CameraStream& camera, std::size_t from = 0) {
  Pass pass;
  const auto reader = camera.open();
  reader->skip_to(from);
  while (auto frame = reader->next()) {
    EXPECT_EQ(frame->stamp, camera.stamps[frame->index]);
    pass.places.push_back(frame->index);
    pass.pictures.push_back(pixels(frame->image));
  }
  pass.broken = reader->broken();
  return pass;
}

TEST_F(Video, RealFilesHaveFfprobesFramesAndTimes) {
  if (!fs::exists(karma)) GTEST_SKIP() << "no recordings at " TAKT_DATA_DIR "/gopro";
  for (const std::string& path : {karma, max_360}) {
    const Recording r = read_video(path, {});
    EXPECT_EQ(in_ns(r.cameras.at(0).stamps), ffprobe_times(path, 1, 90'000));
    const auto reader = r.cameras[0].open();
    std::size_t frames = 0;
    while (auto frame = reader->next()) EXPECT_EQ(frame->index, frames++);
    EXPECT_EQ(frames, r.cameras[0].size());
    EXPECT_EQ(reader->broken(), 0u);
  }
}

TEST_F(Video, PicturesAreTheDecodersOwnLuma) {
  const std::string path = make("b.mp4", "322x182", 40, "-c:v libx264 -bf 3 -pix_fmt yuv420p");
  const Recording r = read_video(path, {});
  const std::string expected = output_of("ffmpeg -i '" + path + "' -vf extractplanes=y -f rawvideo -");
  const Pass pass = decode(r.cameras.at(0));
  ASSERT_EQ(pass.pictures.size(), 40u);
  std::string all;
  for (const std::string& p : pass.pictures) all += p;
  EXPECT_TRUE(all == expected) << all.size() << " bytes against " << expected.size();
}

TEST_F(Video, ImagesOutliveTheReader) {
  const std::string path = make("live.mp4", "320x180", 12, "-c:v libx264 -pix_fmt yuv420p");
  const CameraStream camera = read_video(path, {}).cameras.at(0);
  auto reader = camera.open();
  std::vector<GrayImage> kept;
  while (auto frame = reader->next()) kept.push_back(frame->image);
  reader.reset();
  const Pass again = decode(camera);
  ASSERT_EQ(kept.size(), 12u);
  for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_EQ(pixels(kept[i]), again.pictures[i]) << i;
}

TEST_F(Video, UnevenFrameTimesAndReorderedPicturesKeepTheirTimes) {
  // Every seventh frame is dropped, with B-frames, in three containers.
  for (const char* name : {"vfr.mp4", "vfr.mkv", "vfr.mov"}) {
    SCOPED_TRACE(name);
    const std::string path =
        make(name, "160x90", 60, "-vf \"select='mod(n,7)'\" -fps_mode passthrough -c:v libx264 -bf 3 -pix_fmt yuv420p");
    const bool matroska = std::string(name) == "vfr.mkv";
    const Recording r = read_video(path, {});
    EXPECT_EQ(in_ns(r.cameras.at(0).stamps), ffprobe_times(path, 1, matroska ? 1000 : 30'000));
    EXPECT_EQ(decode(r.cameras[0]).places.size(), r.cameras[0].size());
  }
}

TEST_F(Video, AnEditListHidesWhatPlayersHide) {
  const std::string whole = make("whole.mp4", "160x90", 90, "-c:v libx264 -g 30 -bf 2 -pix_fmt yuv420p");
  const std::string cut = file("cut.mp4");
  output_of("ffmpeg -y -ss 1.2 -i '" + whole + "' -c copy '" + cut + "'");
  const Recording r = read_video(cut, {});
  EXPECT_EQ(in_ns(r.cameras.at(0).stamps), ffprobe_times(cut, 1, 30'000));
  EXPECT_LT(r.cameras[0].size(), 60u);
  EXPECT_EQ(decode(r.cameras[0]).places.size(), r.cameras[0].size());
  EXPECT_TRUE(std::any_of(r.notes.begin(), r.notes.end(),
                          [](const std::string& n) { return n.find("edit list hides") != std::string::npos; }));
}

TEST_F(Video, SkippingGivesTheSamePictures) {
  const std::string path =
      make("skip.mp4", "160x90", 120, "-c:v libx264 -g 25 -bf 3 -pix_fmt yuv420p -x264-params open-gop=1");
  const CameraStream camera = read_video(path, {}).cameras.at(0);
  const Pass whole = decode(camera);
  ASSERT_EQ(whole.places.size(), 120u);
  for (const std::size_t from : {1u, 24u, 25u, 26u, 77u, 99u, 119u}) {
    const Pass rest = decode(camera, from);
    ASSERT_EQ(rest.places.size(), 120 - from) << from;
    EXPECT_EQ(rest.broken, 0u) << from;
    for (std::size_t i = 0; i < rest.places.size(); ++i) {
      EXPECT_EQ(rest.places[i], from + i);
      EXPECT_EQ(rest.pictures[i], whole.pictures[from + i]) << from << " " << i;
    }
  }
}

TEST_F(Video, PicturesOfTenBitsAreConverted) {
  const std::string path = make("ten.mkv", "160x90", 5, "-c:v ffv1 -pix_fmt yuv420p10le");
  const std::string eight = make("eight.mkv", "160x90", 5, "-c:v ffv1 -pix_fmt yuv420p");
  const Pass ten = decode(read_video(path, {}).cameras.at(0)), same = decode(read_video(eight, {}).cameras.at(0));
  ASSERT_EQ(ten.pictures.size(), 5u);
  // Not the same levels (full range), but the same picture.
  double xy = 0, xx = 0, yy = 0, mx = 0, my = 0;
  const std::string &a = ten.pictures[2], &b = same.pictures[2];
  const auto n = static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    mx += static_cast<unsigned char>(a[i]) / n;
    my += static_cast<unsigned char>(b[i]) / n;
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double x = static_cast<unsigned char>(a[i]) - mx, y = static_cast<unsigned char>(b[i]) - my;
    xy += x * y;
    xx += x * x;
    yy += y * y;
  }
  EXPECT_GT(xy / std::sqrt(xx * yy), 0.999);
}

TEST_F(Video, ATurnedPictureIsNoted) {
  const std::string path = make("flat.mp4", "160x90", 5, "-c:v libx264 -pix_fmt yuv420p");
  output_of("ffmpeg -y -i '" + path + "' -c copy -metadata:s:v rotate=90 '" + file("turned.mp4") + "'");
  const Recording r = read_video(file("turned.mp4"), {});
  EXPECT_TRUE(std::any_of(r.notes.begin(), r.notes.end(), [](const std::string& n) {
    return n.find("players turn the picture") != std::string::npos;
  }));
  EXPECT_EQ(decode(r.cameras.at(0)).pictures.at(0).size(), 160u * 90u);
}

/// Opens and decodes; one line of error or the pictures that are there.
void survive(const std::string& path) {
  try {
    const Recording r = open_recording(path);
    std::size_t decoded = 0;
    for (const CameraStream& camera : r.cameras) {
      const auto reader = camera.open();
      while (reader->next()) ++decoded;
      EXPECT_EQ(decoded + reader->broken(), camera.size());
    }
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    EXPECT_NE(std::string(e.what()).find(path), std::string::npos);
    EXPECT_FALSE(e.try_this.empty());
  }
}

TEST_F(Video, CutAndCorruptedFilesGiveOneLineOrWhatIsThere) {
  std::vector<std::string> sources{
      make("end.mp4", "160x90", 60, "-c:v libx264 -g 20 -pix_fmt yuv420p"),
      make("front.mp4", "160x90", 60, "-c:v libx264 -g 20 -pix_fmt yuv420p -movflags +faststart"),
      make("cut.mkv", "160x90", 60, "-c:v libx264 -g 20 -pix_fmt yuv420p"),
      make("cut.avi", "160x90", 60, "-c:v mpeg4 -bf 0")};
  if (fs::exists(max_360)) sources.push_back(max_360);
  std::uint64_t random = 88172645463325252ULL;  // xorshift64 [Marsaglia2003]
  for (const std::string& source : sources) {
    const std::string bytes = read_file(source);
    const std::string damaged = file("damaged" + fs::path(source).extension().string());
    const int places = source == max_360 ? 4 : 12;  // a large one takes its time
    for (int k = 0; k < places; ++k) {
      std::string some = bytes.substr(0, bytes.size() * static_cast<std::size_t>(k) / static_cast<std::size_t>(places));
      std::ofstream(damaged, std::ios::binary) << some;
      survive(damaged);
    }
    for (int k = 0; k < places / 2; ++k) {
      std::string some = bytes;
      for (int i = 0; i < 40; ++i) {
        random ^= random << 13, random ^= random >> 7, random ^= random << 17;
        some[random % some.size()] = static_cast<char>(random >> 56);
      }
      std::ofstream(damaged, std::ios::binary) << some;
      survive(damaged);
    }
  }
}

TEST_F(Video, AFileCutShortSaysHowManyPicturesAreThere) {
  const std::string path =
      make("front.mp4", "320x180", 60, "-c:v libx264 -g 10 -bf 0 -pix_fmt yuv420p -movflags +faststart");
  const std::string bytes = read_file(path);
  const std::string half = file("half.mp4");
  std::ofstream(half, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  const Recording r = read_video(half, {});
  EXPECT_GT(r.cameras.at(0).size(), 10u);
  EXPECT_LT(r.cameras[0].size(), 50u);
  EXPECT_TRUE(std::any_of(r.notes.begin(), r.notes.end(), [](const std::string& n) {
    return n.find("of 60 pictures are there") != std::string::npos;
  }));
}

TEST_F(Video, WhatIsNoVideoIsAnError) {
  std::ofstream(file("no.mp4")) << "this is text, not a video, whatever its name";
  EXPECT_FALSE(is_video(file("no.mp4")));
  EXPECT_THROW((void)read_video(file("no.mp4"), {}), Error);
  EXPECT_THROW((void)read_video("/nowhere.mp4", {}), Error);
  output_of("ffmpeg -y -f lavfi -i sine=duration=1 '" + file("sound.mp4") + "'");
  EXPECT_THROW((void)read_video(file("sound.mp4"), {}), Error);
}

TEST_F(Video, AVideoWithALogBesideItIsOneRecording) {
  const std::string path = make("ride.mp4", "160x90", 30, "-c:v libx264 -pix_fmt yuv420p");
  EXPECT_EQ(open_recording(path).format, "video");
  std::ofstream log(file("ride.csv"));
  log << "t_s,wx_rad_s,wy_rad_s,wz_rad_s\n";
  for (int i = 0; i < 200; ++i) log << i * 0.005 << ",0.1,0.2,0.3\n";
  log.close();
  const Recording r = open_recording(path);
  EXPECT_EQ(r.format, "video with log");
  EXPECT_EQ(r.cameras.size(), 1u);
  ASSERT_EQ(r.imus.size(), 1u);
  EXPECT_EQ(r.imus[0].size(), 200u);
  EXPECT_NE(r.imus[0].clock, r.cameras[0].clock);
  EXPECT_EQ(r.files.size(), 2u);
  EXPECT_EQ(open_recording(fs::path(path).parent_path().string()).imus.size(), 1u);
}

TEST_F(Video, DecodingIsManyTimesFasterThanRealTime) {
  const std::string path = make("speed.mp4", "1280x720", 90, "-c:v libx264 -preset fast -b:v 6M -pix_fmt yuv420p");
  OpenOptions options;
  options.decode_threads = 1;
  const auto begin = std::chrono::steady_clock::now();
  const CameraStream camera = read_video(path, options).cameras.at(0);
  const double indexed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const std::clock_t cpu = std::clock();
  const auto reader = camera.open();
  std::size_t frames = 0;
  while (reader->next()) ++frames;
  const double cpu_s = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  ASSERT_EQ(frames, 90u);
  const double real_time = 90 * 1001.0 / 30'000 / cpu_s;
  std::printf("720p: %.0f x real time on one core, index of %zu frames in %.3f s\n", real_time, frames, indexed_s);
  EXPECT_GT(real_time, 4) << "processor time, so a busy machine does not count";
}

}  // namespace
}  // namespace takt
