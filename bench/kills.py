#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""kills.py TAKT [KILLS] [MEGABYTES] [FOLDER]: `takt apply` on a large bag and MCAP file, ended at random moments.

Under the final name there has to be what was there before, or all of the new file; beside it nothing, unless it was
SIGKILL, which leaves no time to tidy up.
"""
import hashlib
import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

import genpy
import rosbag
from sensor_msgs.msg import Image

takt = sys.argv[1]
kills, megabytes = int(sys.argv[2]) if len(sys.argv) > 2 else 100, int(sys.argv[3]) if len(sys.argv) > 3 else 300


def write_bag(path):
    random.seed(1)
    noise = random.randbytes(4_000_000)
    image = Image(height=480, width=752, encoding="mono8", step=752)
    with rosbag.Bag(str(path), "w", compression="lz4") as bag:
        for i in range(megabytes * 10**6 // (480 * 752)):
            at = i * 7919 % 3_000_000
            image.header.stamp = genpy.Time(100 + i // 20, i % 20 * 50_000_000)
            image.data = noise[at:at + 480 * 752]
            bag.write("/cam/image_raw", image, image.header.stamp)


def digest(path):
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def end_at_random_moments(source, result):
    out = source.with_name("out" + source.suffix)
    command = [takt, "apply", str(result), str(source), "-o", str(out), "-q"]
    began = time.monotonic()
    subprocess.run(command, check=True, capture_output=True)
    took = time.monotonic() - began
    whole = digest(out)
    os.remove(out)
    counts = {"nothing": 0, "what was there before": 0, "all of the new file": 0, "a wrong file": 0, "rests beside it": 0}
    for i in range(kills):
        if i % 2:
            out.write_text("before")
        number = signal.SIGKILL if i % 3 else signal.SIGTERM
        child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(random.uniform(0, 1.1) * took)
        child.send_signal(number)
        child.wait()
        if not out.exists():
            counts["nothing" if i % 2 == 0 else "a wrong file"] += 1
        elif i % 2 and out.stat().st_size == 6:
            counts["what was there before"] += 1
        else:
            counts["all of the new file" if digest(out) == whole else "a wrong file"] += 1
        out.unlink(missing_ok=True)
        for rest in out.parent.glob(".*part*"):
            counts["rests beside it"] += number == signal.SIGTERM
            rest.unlink()
    print(f"{source.suffix[1:]:5} {source.stat().st_size / 1e6:4.0f} MB, {kills} times: " + ", ".join(f"{k} {n}" for k, n in counts.items()))
    return counts["a wrong file"] + counts["rests beside it"]


with tempfile.TemporaryDirectory(dir=sys.argv[4] if len(sys.argv) > 4 else None) as folder:
    folder = pathlib.Path(folder)
    write_bag(folder / "in.bag")
    subprocess.run([takt, "convert", str(folder / "in.bag"), "-o", str(folder / "in.mcap"), "-q"], check=True)
    (folder / "result.json").write_text(json.dumps({"schema": "takt/1", "verdict": "trusted", "sensor": "/cam/image_raw",
                                                    "reference": "/imu", "offset_s": 0.012345678, "offset_ns": 12345678, "epoch_ns": 0}))
    wrong = sum(end_at_random_moments(folder / name, folder / "result.json") for name in ("in.bag", "in.mcap"))
sys.exit(1 if wrong else 0)
