// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/asl.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "takt/recording/files.h"
#include "takt/recording/open_recording.h"
#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;
using testing_tools::real_data;
using testing_tools::TemporaryFolder;

const std::string frames = "#timestamp [ns],filename\n1000,a.png\n2000,b.png\n3000,c.png\n";
const std::string sensor =
    "%YAML:1.0\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1,0,0,0.1, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n"
    "resolution: [640, 480]\nintrinsics: [400, 401, 320, 240]\n";

CameraStream camera(const std::string& data, const std::string& yaml, const std::string& exposure = "") {
  std::vector<std::string> notes;
  return read_asl_camera({data, yaml, exposure}, "cam0", "run/cam0", notes);
}

TEST(Asl, ExtraKeysSetTheTiming) {
  const CameraStream c =
      camera(frames, sensor + "exposure_s: 0.004\nstamp: start\nreadout_s: 0.03\nshutter: rolling\n");
  EXPECT_EQ(c.timing.instant, ExposureInstant::start);
  EXPECT_EQ(c.timing.shutter, Shutter::rolling);
  EXPECT_DOUBLE_EQ(c.timing.exposure_s, 0.004);
  EXPECT_DOUBLE_EQ(c.timing.line_delay_s(), 0.03 / 480);
  EXPECT_DOUBLE_EQ((*c.T_body_cam)(0, 3), 0.1);
}

TEST(Asl, DistortionNamesOfEurocAndKalibr) {
  const std::string coefficients = "distortion_coefficients: [0.1, 0.2, 0.3, 0.4]\n";
  for (const char* name : {"radial-tangential", "radtan", "plumb_bob"})
    EXPECT_EQ(camera(frames, sensor + coefficients + "distortion_model: " + name).model->distortion,
              Distortion::radtan);
  const CameraStream fisheye =
      camera(frames, sensor + "distortion_coeffs: [0.1, 0.2, 0.3, 0.4]\ndistortion_model: equidistant\n");
  EXPECT_EQ(fisheye.model->distortion, Distortion::equidistant);
  EXPECT_EQ(fisheye.model->coeffs[3], 0.4);
  EXPECT_EQ(camera(frames, sensor).model->distortion, Distortion::none);

  std::vector<std::string> notes;
  const CameraStream unknown =
      read_asl_camera({frames, sensor + "distortion_model: rational\n", ""}, "cam0", "run/cam0", notes);
  EXPECT_FALSE(unknown.model);
  EXPECT_NE(notes[0].find("'rational' is unknown"), std::string::npos) << notes[0];
}

TEST(Asl, ExposureFileGivesEachFrameItsOwn) {
  const CameraStream c = camera(frames, sensor, "#timestamp [ns],exposure time[ns]\n1000,2000000\n3000,4000000\n");
  EXPECT_EQ(c.exposures_s, (std::vector<double>{0.002, 0, 0.004}));
}

TEST(Asl, BadSensorFilesNameKeyAndLine) {
  const struct {
    std::string yaml;
    const char* expected;
  } cases[] = {
      {sensor + "stamp: sometimes\n", "sensor.yaml:8: stamp is 'sometimes', not start, middle or end"},
      {sensor + "exposure_s: long\n", "sensor.yaml:8: exposure_s is not a number"},
      {sensor + "readout_s: -1\n", "readout_s is not a duration"},
      {sensor + "shutter: none\n", "shutter is 'none'"},
      {"intrinsics: [1, 2]\n", "intrinsics needs 4 numbers"},
      {"intrinsics: [0, 0, 1, 1]\n", "positive focal lengths"},
      {"T_BS: [1, 2, 3]\n", "T_BS is not a 4 by 4 matrix"},
      {"T_BS: [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n", "T_BS has no rotation"},
      {"a: [1, 2\nb: }", "is not YAML"},
      {"just words", "is not a YAML map"},
      {std::string(100, '['), "too deep"},
  };
  for (const auto& c : cases) {
    const std::string said = complaint([&] { (void)camera(frames, c.yaml); });
    EXPECT_NE(said.find(c.expected), std::string::npos) << c.yaml << " -> " << said;
  }
  EXPECT_NE(complaint([&] { (void)camera("1000\n", sensor); }).find("data.csv"), std::string::npos);
  EXPECT_NE(complaint([&] { (void)camera(frames + "1.5.1,x.png\n", sensor); }).find("data.csv:5"), std::string::npos);
  EXPECT_NE(complaint([&] { (void)camera(frames, sensor, "1000,-5\n"); }).find("exposure.csv:1"), std::string::npos);
}

TEST(Asl, FoldersWithoutLayoutAreNotTaken) {
  const TemporaryFolder folder;
  EXPECT_FALSE(looks_like_asl(folder.path()));
  EXPECT_NE(complaint([&] { (void)open_recording(folder.path()); }).find("no known format of recording in this folder"),
            std::string::npos);
  EXPECT_NE(complaint([&] { (void)open_recording(folder.path() + "/none"); }).find("no such file"), std::string::npos);
}

TEST(Asl, MissingPicturesAreCountedAndPassedOver) {
  TAKT_NEEDS_REAL_DATA("euroc_micro");
  const TemporaryFolder folder;
  const std::string picture = read_file(real_data("euroc_micro/mav0/cam0/data/1403715273312143104.jpg"));
  (void)folder.file("cam0/data.csv", "1000,a.jpg\n2000,b.jpg\n3000,c.jpg\n4000,d.jpg\n");
  (void)folder.file("cam0/data/a.jpg", picture);
  (void)folder.file("cam0/data/c.jpg", picture.substr(0, picture.size() / 2));  // OpenCV would fill it up
  (void)folder.file("cam0/data/d.jpg", picture);
  const Recording r = open_recording(folder.path());
  EXPECT_EQ(r.cameras.at(0).size(), 4u);
  EXPECT_NE(r.notes.back().find("1 of 4 pictures are missing"), std::string::npos) << r.notes.back();
  const auto reader = r.cameras[0].open();
  EXPECT_EQ(reader->next()->index, 0u);
  const auto second = reader->next();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->index, 3u);
  EXPECT_FALSE(reader->next());
  EXPECT_EQ(reader->broken(), 2u);
}

TEST(Asl, RealEuroc) {
  TAKT_NEEDS_REAL_DATA("euroc_micro");
  for (const char* path : {"euroc_micro", "euroc_micro/mav0"}) {
    const Recording r = open_recording(real_data(path));
    EXPECT_EQ(r.format, "ASL folder");
    ASSERT_EQ(r.cameras.size(), 2u);
    ASSERT_EQ(r.imus.size(), 1u);
    EXPECT_EQ(r.cameras[0].size(), 95u);
    EXPECT_EQ(r.cameras[1].size(), 95u);
    EXPECT_EQ(r.cameras[1].name, "cam1");
    EXPECT_EQ(to_ns(r.cameras[0].stamps[0]), 1403715273262142976);
    EXPECT_EQ(r.cameras[0].model->coeffs[0], -0.28340811);
    EXPECT_EQ(r.cameras[0].timing.rows, 480);
    EXPECT_EQ(r.imus[0].noise->gyro_density, 1.6968e-04);
    EXPECT_EQ(to_ns(r.imus[0].stamps[1]), 1403715273267142912);
    EXPECT_EQ(r.imus[0].accel_m_s2[0].z(), -3.6938381666666662);
  }
}

TEST(Asl, RealEurocFramesDecodeOneByOneAndCut) {
  TAKT_NEEDS_REAL_DATA("euroc_micro");
  const Recording r = open_recording(real_data("euroc_micro"), {.from_s = 1.0, .to_s = 1.5});
  const CameraStream& cam = r.cameras.at(0);
  ASSERT_EQ(cam.size(), 11u);
  const auto reader = cam.open();
  std::size_t count = 0;
  while (const auto frame = reader->next()) {
    EXPECT_EQ(frame->index, count);
    EXPECT_EQ(frame->stamp, cam.stamps[count]);
    EXPECT_EQ(frame->image.width, 752);
    EXPECT_EQ(frame->image.height, 480);
    ++count;
  }
  EXPECT_EQ(count, 11u);
  EXPECT_NEAR(seconds_since(r.imus[0].stamps.front(), r.imus[0].stamps.back()), 0.5, 1e-6);
  EXPECT_NE(complaint([&] { (void)open_recording(real_data("euroc_micro"), {.from_s = 99.0}); }).find("nothing was"),
            std::string::npos);
}

}  // namespace
}  // namespace takt
