// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/kalibr_files.h"

#include <gtest/gtest.h>

#include <opencv2/core/persistence.hpp>

#include "tests/tools.h"

namespace takt {
namespace {

using testing_tools::complaint;

/// As Kalibr writes a result, line breaks behind column 80 included.
const std::string camchain =
    R"(cam0:
  T_cam_imu:
  - [0.01779318, 0.99967549, -0.01823385, 0.07008565]
  - [-0.9998017, 0.01795239, 0.00860714, -0.01771023]
  - [0.00893160, 0.01807260, 0.99979678, 0.00399246]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.27695497883018577, 0.06712456066341092, 0.0008753967935169985,
    0.00011737289290434355]
  distortion_model: radtan
  intrinsics: [461.62927369, 460.15267253, 362.68010282, 246.20734481]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: -8.121e-05
cam1:
  T_cam_imu:
  - [0.0, -1.0, 0.0, 1.0e-05]
  - [1.0, 0.0, 0.0, -0.1]
  - [0.0, 0.0, 1.0, 2.0]
  - [0.0, 0.0, 0.0, 1.0]
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.19, 0.59, 158.3, 158.2, 254.9, 256.9]
  line_delay: 2.5e-05
  resolution: [512, 512]
  rostopic: /cam1/image_raw
  timeshift_cam_imu: 0.0073
)";

std::string without_trailing_zeros(std::string text) {  // Kalibr's digits are the shortest
  for (const auto& [from, to] :
       {std::pair<std::string, std::string>{"0.00893160", "0.0089316"}, {"0.01807260", "0.0180726"}})
    text.replace(text.find(from), from.size(), to);
  return text;
}

TEST(KalibrFiles, ACamchainIsReadAndWrittenToTheSameBytes) {
  const std::string text = without_trailing_zeros(camchain);
  const KalibrCamchain chain = read_kalibr_camchain(text, "camchain.yaml");
  ASSERT_EQ(chain.size(), 2u);
  EXPECT_EQ(chain[0].model.distortion, Distortion::radtan);
  EXPECT_EQ(chain[0].model.coeffs[3], 0.00011737289290434355);
  EXPECT_EQ(chain[0].model.width, 752);
  EXPECT_EQ(*chain[0].timeshift_cam_imu_s, -8.121e-05);
  EXPECT_EQ((*chain[0].T_cam_imu)(0, 3), 0.07008565);
  EXPECT_EQ(chain[1].model.projection, Projection::double_sphere);
  EXPECT_EQ(chain[1].model.shape[1], 0.59);
  EXPECT_EQ((*chain[1].T_cn_cnm1)(0, 3), -0.11);
  EXPECT_EQ(*chain[1].line_delay_s, 2.5e-05);
  EXPECT_EQ(write_kalibr_camchain(chain), text);
}

TEST(KalibrFiles, EveryModelSurvivesTheRoundTrip) {
  for (const auto& [projection, distortion] : {std::pair{Projection::pinhole, Distortion::none},
                                               {Projection::pinhole, Distortion::equidistant},
                                               {Projection::pinhole, Distortion::fov},
                                               {Projection::omni, Distortion::radtan},
                                               {Projection::omni, Distortion::none},
                                               {Projection::eucm, Distortion::none}}) {
    KalibrCamera camera;
    camera.model.width = 640, camera.model.height = 480;
    camera.model.projection = projection, camera.model.distortion = distortion;
    camera.model.shape = {0.6, projection == Projection::omni ? 0.0 : 1.1};
    camera.model.fx = 400.5, camera.model.fy = 401, camera.model.cx = 320.25, camera.model.cy = 240;
    for (int i = 0; i < coeff_count(distortion); ++i) camera.model.coeffs[static_cast<std::size_t>(i)] = 0.1 / (i + 1);
    const std::string text = write_kalibr_camchain({camera});
    const CameraModel again = read_kalibr_camchain(text, "x").front().model;
    EXPECT_EQ(again.projection, projection) << text;
    EXPECT_EQ(again.distortion, distortion) << text;
    EXPECT_EQ(intrinsics_of(again), intrinsics_of(camera.model)) << text;
    EXPECT_EQ(write_kalibr_camchain({{.model = again}}), text);
  }
}

TEST(KalibrFiles, ATopicWithStrangeBytesIsKept) {
  for (const std::string topic : {"/cam 0", "it's", "/cam\n0", "/cam\x10", "\x7f", "a\\\x01\"b"}) {
    for (const KalibrStyle style : {KalibrStyle::kalibr, KalibrStyle::opencv}) {
      KalibrCamera camera;
      camera.model.width = 640, camera.model.height = 480, camera.model.fx = camera.model.fy = 400;
      camera.rostopic = topic;
      const std::string text = write_kalibr_camchain({camera}, style);
      EXPECT_EQ(read_kalibr_camchain(text, "x").front().rostopic, topic) << text;
    }
  }
}

TEST(KalibrFiles, ImusAsGivenAndAsFound) {
  const std::string given = R"(accelerometer_noise_density: 0.00186
accelerometer_random_walk: 0.000433
gyroscope_noise_density: 0.000187
gyroscope_random_walk: 2.66e-05
rostopic: /imu0
update_rate: 200.0
)";
  const auto imus = read_kalibr_imus(given, "imu.yaml");
  ASSERT_EQ(imus.size(), 1u);
  EXPECT_EQ(imus[0].noise.gyro_random_walk, 2.66e-05);
  EXPECT_EQ(write_kalibr_imus(imus), given);

  const std::string found = R"(imu0:
  T_i_b:
  - [1.0, 0.0, 0.0, 0.0]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  accelerometer_noise_density: 0.00186
  accelerometer_random_walk: 0.000433
  accelerometers:
    M:
    - [1.001, 0.0, 0.0]
    - [0.002, 0.999, 0.0]
    - [-0.003, 0.0005, 1.0]
    rx_i: [0.0, 0.0, 0.0]
    ry_i: [0.001, 0.0, 0.0]
    rz_i: [0.0, 0.002, 0.0]
  gyroscope_noise_density: 0.000187
  gyroscope_random_walk: 2.66e-05
  gyroscopes:
    A:
    - [0.0, 1.0e-05, 0.0]
    - [0.0, 0.0, 0.0]
    - [0.0, 0.0, 0.0]
    C_gyro_i:
    - [1.0, 0.0, 0.0]
    - [0.0, 1.0, 0.0]
    - [0.0, 0.0, 1.0]
    M:
    - [1.0, 0.0, 0.0]
    - [0.0, 1.0, 0.0]
    - [0.0, 0.0, 1.0]
  model: scale-misalignment-size-effect
  rostopic: /imu0
  time_offset: 0.0
  update_rate: 200.0
)";
  EXPECT_EQ(write_kalibr_imus(read_kalibr_imus(found, "imus.yaml")), found);
}

TEST(KalibrFiles, TargetsAsTheWikiShowsThem) {
  const Target grid = read_kalibr_target(
      "target_type: 'aprilgrid' #gridtype\ntagCols: 6               #number of apriltags\ntagRows: 5\n"
      "tagSize: 0.088           #size of apriltag, edge to edge [m]\ntagSpacing: 0.3          #ratio\n",
      "april.yaml");
  const auto& april = std::get<AprilGrid>(grid);
  EXPECT_EQ(april.columns, 6);
  EXPECT_EQ(april.rows, 5);
  EXPECT_EQ(april.tag_m, 0.088);
  EXPECT_EQ(april.border_cells, 2);
  const Target circles = read_kalibr_target(
      "target_type: 'circlegrid'\ntargetCols: 4\ntargetRows: 11\nspacingMeters: 0.02\nasymmetricGrid: False\n", "c");
  EXPECT_FALSE(std::get<CircleGrid>(circles).asymmetric);
  for (const Target& t : {grid, circles, Target(Checkerboard{7, 6, 0.06, 0.05}), Target(Charuco{}),
                          Target(AprilGrid{2, 3, 0.1, 0.25, 40, 1})}) {
    const std::string text = write_kalibr_target(t);
    EXPECT_EQ(write_kalibr_target(read_kalibr_target(text, "t")), text);
    EXPECT_EQ(board_points(read_kalibr_target(text, "t")), board_points(t));
  }
}

TEST(KalibrFiles, TheOpenCvVariantIsReadByOpenCvAndByUs) {
  const KalibrCamchain chain = read_kalibr_camchain(camchain, "camchain.yaml");
  const std::string text = write_kalibr_camchain(chain, KalibrStyle::opencv);
  const cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
  const cv::FileNode cam1 = file["cam1"];
  EXPECT_EQ(static_cast<double>(cam1["T_cn_cnm1"][0][3]), -0.11);
  EXPECT_EQ(static_cast<std::string>(cam1["rostopic"]), "/cam1/image_raw");
  EXPECT_EQ(static_cast<double>(cam1["timeshift_cam_imu"]), 0.0073);
  EXPECT_EQ(static_cast<double>(file["cam0"]["intrinsics"][2]), 362.68010282);
  EXPECT_EQ(write_kalibr_camchain(read_kalibr_camchain(text, "opencv.yaml")), without_trailing_zeros(camchain));
  const auto imus = read_kalibr_imus(write_kalibr_imus({{.rostopic = "/imu0"}}, KalibrStyle::opencv), "imu.yaml");
  EXPECT_EQ(imus.front().rostopic, "/imu0");
}

TEST(KalibrFiles, ComplaintsNameFileAndKey) {
  const auto target = [](const std::string& text) {
    return complaint([&] { (void)read_kalibr_target(text, "april.yaml"); });
  };
  EXPECT_NE(target("tagCols: 6\n").find("april.yaml: target_type is missing"), std::string::npos);
  EXPECT_NE(target("target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: 0.088\n").find("tagSpacing is missing"),
            std::string::npos);
  EXPECT_NE(target("target_type: aprilgrid\ntagCols: 6.5\ntagRows: 6\n").find("april.yaml:2: tagCols"),
            std::string::npos);
  EXPECT_NE(target("target_type: dots\n").find("target_type is 'dots'"), std::string::npos);
  EXPECT_NE(target("target_type: aprilgrid\ntagCols: 60\ntagRows: 60\ntagSize: 0.088\ntagSpacing: 0.3\n").find("587"),
            std::string::npos);
  EXPECT_NE(target("target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: -1\ntagSpacing: 0.3\n").find("tag size"),
            std::string::npos);
  const auto chain = [](const std::string& text) {
    return complaint([&] { (void)read_kalibr_camchain(text, "chain.yaml"); });
  };
  EXPECT_NE(chain("imu0:\n  a: 1\n").find("chain.yaml: cam0 is missing"), std::string::npos);
  EXPECT_NE(chain("cam0:\n  camera_model: pinhole\n  intrinsics: [1, 1, 1]\n").find("chain.yaml:3: intrinsics"),
            std::string::npos);
  EXPECT_NE(chain("cam0:\n  camera_model: plenoptic\n  intrinsics: [1, 1, 1]\n").find("camera_model"),
            std::string::npos);
  EXPECT_NE(complaint([] {
              (void)read_kalibr_imus("rostopic: /imu0\n", "imu.yaml");
            }).find("accelerometer_noise_density is missing"),
            std::string::npos);
}

}  // namespace
}  // namespace takt
