#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""write_bag.py ASL_FOLDER OUT_FOLDER: the recording as ROS 1 bags, written by ROS' own library."""
import csv
import re
import sys

import genpy
import rosbag
from sensor_msgs.msg import CameraInfo, CompressedImage, Imu


def rows(path):
    with open(path, newline="") as file:
        return [row for row in csv.reader(file) if row and not row[0].startswith("#")]


def time_of(ns):
    return genpy.Time(ns // 10**9, ns % 10**9)


def numbers(text, key):
    found = re.search(rf"^{key}: *\[([^\]]*)\]", text, re.M)
    return [float(x) for x in found.group(1).split(",")]


def messages(folder):
    root = folder + "/mav0/"
    for row in rows(root + "imu0/data.csv"):
        m = Imu()
        m.header.stamp = time_of(int(row[0]))
        m.header.frame_id = "body"
        v, a = m.angular_velocity, m.linear_acceleration
        v.x, v.y, v.z, a.x, a.y, a.z = (float(x) for x in row[1:7])
        m.orientation_covariance[0] = -1
        yield int(row[0]), "/imu0", m
    sensor = open(root + "cam0/sensor.yaml").read()
    fx, fy, cx, cy = numbers(sensor, "intrinsics")
    width, height = numbers(sensor, "resolution")
    for ns, name in rows(root + "cam0/data.csv"):
        image = CompressedImage()
        image.header.stamp = time_of(int(ns))
        image.format = "mono8; jpeg compressed"
        image.data = open(root + "cam0/data/" + name, "rb").read()
        yield int(ns), "/cam0/image_raw/compressed", image
        info = CameraInfo()
        info.header.stamp = time_of(int(ns))
        info.width, info.height = int(width), int(height)
        info.distortion_model = "plumb_bob"
        info.D = numbers(sensor, "distortion_coefficients") + [0.0]
        info.K = [fx, 0, cx, 0, fy, cy, 0, 0, 1]
        yield int(ns), "/cam0/camera_info", info


def main():
    everything = sorted(messages(sys.argv[1]), key=lambda m: m[0])
    for compression in ("none", "bz2", "lz4"):
        with rosbag.Bag(f"{sys.argv[2]}/{compression}.bag", "w", compression=compression) as bag:
            for i, (ns, topic, message) in enumerate(everything):
                bag.write(topic, message, time_of(ns + 5_000_000 + i * 7919 % 1000 * 1000))


main()
