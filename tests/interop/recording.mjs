// SPDX-License-Identifier: Apache-2.0
// A camera and an IMU of an ASL folder as plain objects, for the writers of other formats.
import fs from "node:fs";
import path from "node:path";

function rows(file) {
  return fs
    .readFileSync(file, "utf8")
    .split("\n")
    .map((line) => line.trim())
    .filter((line) => line && !line.startsWith("#"))
    .map((line) => line.split(","));
}

export function stampOf(ns) {
  return { sec: Number(ns / 1000000000n), nsec: Number(ns % 1000000000n) };
}

function numbersIn(text, key) {
  const found = new RegExp(`^${key}: *\\[([^\\]]*)\\]`, "m").exec(text);
  return found[1].split(",").map(Number);
}

/// {topic, type, ns, message} in order of time; messages have ROS 1's fields.
export function readAsl(folder) {
  const root = path.join(folder, "mav0");
  const out = [];
  for (const [ns, wx, wy, wz, ax, ay, az] of rows(path.join(root, "imu0", "data.csv"))) {
    const none = new Array(9).fill(0);
    out.push({
      topic: "/imu0",
      type: "sensor_msgs/Imu",
      ns: BigInt(ns),
      message: {
        orientation: { x: 0, y: 0, z: 0, w: 1 },
        orientation_covariance: [-1, 0, 0, 0, 0, 0, 0, 0, 0],
        angular_velocity: { x: Number(wx), y: Number(wy), z: Number(wz) },
        angular_velocity_covariance: none,
        linear_acceleration: { x: Number(ax), y: Number(ay), z: Number(az) },
        linear_acceleration_covariance: none,
      },
    });
  }
  const sensor = fs.readFileSync(path.join(root, "cam0", "sensor.yaml"), "utf8");
  const [fx, fy, cx, cy] = numbersIn(sensor, "intrinsics");
  const [width, height] = numbersIn(sensor, "resolution");
  const d = numbersIn(sensor, "distortion_coefficients");
  const region = { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false };
  for (const [ns, name] of rows(path.join(root, "cam0", "data.csv"))) {
    const data = new Uint8Array(fs.readFileSync(path.join(root, "cam0", "data", name)));
    out.push({
      topic: "/cam0/image_raw/compressed",
      type: "sensor_msgs/CompressedImage",
      ns: BigInt(ns),
      message: { format: "mono8; jpeg compressed", data },
    });
    const K = [fx, 0, cx, 0, fy, cy, 0, 0, 1];
    const R = [1, 0, 0, 0, 1, 0, 0, 0, 1];
    const P = [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0];
    const D = [...d, 0];
    out.push({
      topic: "/cam0/camera_info",
      type: "sensor_msgs/CameraInfo",
      ns: BigInt(ns),
      message: {
        height, width, distortion_model: "plumb_bob", D, K, R, P, d: D, k: K, r: R, p: P,
        binning_x: 0, binning_y: 0, roi: region,
      },
    });
  }
  return out.sort((a, b) => (a.ns < b.ns ? -1 : a.ns > b.ns ? 1 : 0));
}

/// What the recorder's clock says: later than the stamp, by a different amount each time.
export function recordedAt(ns, index) {
  return ns + 5000000n + BigInt((index * 7919) % 1000) * 1000n;
}
