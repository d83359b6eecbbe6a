#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""check.py TAKT ASL_FOLDER WORK_FOLDER: recordings written by others are read by takt and the other way round.

Every container holds the same camera and IMU. Each must give the same answer of `takt align`; counts and payloads
must be those that the independent readers see; `takt apply` of 0 gives the same bytes back; of +x it moves the
chosen topics' stamps alone, and the answer by -x. Says "skipped: ..." and ends with 77 where something needed is not here.
"""
import filecmp
import json
import os
import pathlib
import shutil
import subprocess
import sys

here = pathlib.Path(__file__).resolve().parent
takt, asl, work = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
camera, imu = "/cam0/image_raw/compressed", "/imu0"
x_ns = 12_345_678
failures = []


def skip(why):
    print("skipped: " + why)
    sys.exit(77)


def run(*command, **options):
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True, **options).stdout


def check(good, words):
    if not good:
        failures.append(words)
        print("FAILED: " + words)


def prepare():
    for program in ("node", "npm", "lz4", "zstd"):
        if not shutil.which(program):
            skip(f"there is no {program} here (scripts/setup installs it)")
    if subprocess.run(["/usr/bin/python3", "-c", "import rosbag, sensor_msgs.msg"], capture_output=True).returncode:
        skip("there are no python3-rosbag and python3-sensor-msgs here (scripts/setup installs them)")
    if not os.path.isdir(asl):
        skip(f"the real recording {asl} is not here")
    work.mkdir(parents=True, exist_ok=True)
    for file in here.iterdir():
        if file.is_file():
            shutil.copy(file, work)
    if not (work / "node_modules" / ".package-lock.json").exists():
        done = subprocess.run(["npm", "ci", "--no-audit", "--no-fund", "--ignore-scripts"], cwd=work, capture_output=True, text=True)
        if done.returncode:
            skip("npm cannot install the writers: " + done.stderr.strip().splitlines()[-1])


def answer(path, *more):
    done = subprocess.run([takt, "align", str(path), "--json", "-q", *more], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise RuntimeError(f"{path}: {done.stderr}")
    return json.loads(done.stdout)


def convert(files, of_asl, out):
    """takt convert: what it writes is read by others with the same counts and stamps, and aligns to the same bit."""
    source = out / "cdr_zstd.mcap"
    written = [out / "converted.mcap", out / "converted.bag", out / "converted.db3"]
    for f in written:
        run(takt, "convert", source, "-o", f, "-q")
    run(takt, "convert", source, "-o", out / "converted_asl", "-q")
    seen = json.loads(run("node", "payloads.mjs", source, *written, cwd=work))
    for f in written:
        for topic, theirs in ((camera, camera), (imu, imu), ("/cam0/camera_info", "/cam0/camera_info")):
            for key in ("count", "first_ns", "last_ns"):
                check(seen[str(f)][theirs][key] == seen[str(source)][topic][key], f"{f.name}: {theirs}: another {key}")
    bag = run("/usr/bin/python3", "-c", "import rosbag, sys\n"
              "for topic, m, t in rosbag.Bag(sys.argv[1]).read_messages():\n"
              "    if topic == '/imu0': print(m.header.stamp, m.angular_velocity.z, m.linear_acceleration.x)", written[1])
    rows = [r.split(",") for r in (pathlib.Path(asl) / "mav0/imu0/data.csv").read_text().splitlines() if r[0] != "#"]
    theirs = [line.split() for line in bag.splitlines()]
    check([(r[0], float(r[3]), float(r[4])) for r in rows] == [(t, float(w), float(a)) for t, w, a in theirs],
          "converted.bag: rosbag reads other rates or accelerations")
    for f in (*written, out / "converted_asl"):
        found = answer(f)
        check((found["offset_ns"], found["sigma_s"]) == (of_asl["offset_ns"], of_asl["sigma_s"]),
              f"{f.name}: align says {found['offset_ns']} ns, before converting {of_asl['offset_ns']} ns")


def main():
    prepare()
    out = work / "recordings"
    shutil.rmtree(out, ignore_errors=True)
    run("node", "write_recordings.mjs", asl, out, cwd=work)
    run("/usr/bin/python3", "write_bag.py", asl, out, cwd=work)
    files = sorted(f for f in out.iterdir())
    (work / "result.json").write_text(json.dumps(
        {"schema": "takt/1", "verdict": "trusted", "sensor": camera, "reference": imu, "offset_ns": x_ns,
         "offset_s": x_ns * 1e-9, "epoch_ns": 0}))
    (work / "nothing.json").write_text(json.dumps(
        {"schema": "takt/1", "verdict": "trusted", "sensor": camera, "reference": imu, "offset_s": 0.0, "epoch_ns": 0}))

    moved = {}
    for f in files:
        same, moved[f] = out / ("same_" + f.name), out / ("moved_" + f.name)
        run(takt, "apply", work / "nothing.json", f, "-o", same)
        check(filecmp.cmp(f, same, shallow=False), f"{f.name}: apply of 0 gives other bytes")
        os.remove(same)
        run(takt, "apply", work / "result.json", f, "-o", moved[f])
    seen = json.loads(run("node", "payloads.mjs", *files, *moved.values(), cwd=work))

    of_asl = answer(asl, "--sensor", "cam0", "--reference", "imu0")
    for f in files:
        before, after = seen[str(f)], seen[str(moved[f])]
        streams = {s["name"]: s for s in json.loads(run(takt, "inspect", f, "--json"))["streams"]}
        for topic in (camera, imu):
            check(streams[topic]["count"] == before[topic]["count"], f"{f.name}: {topic}: another count")
            check(str(streams[topic]["first_ns"]) == before[topic]["first_ns"], f"{f.name}: {topic}: another first stamp")
            check(str(streams[topic]["last_ns"]) == before[topic]["last_ns"], f"{f.name}: {topic}: another last stamp")
        check(set(before) == set(after), f"{f.name}: apply lost a topic")
        for topic in before:
            by = x_ns if topic.startswith("/cam0") else 0
            check(before[topic]["sha256"] == after[topic]["sha256"], f"{f.name}: {topic}: apply changed more than stamps")
            check(int(after[topic]["first_ns"]) - int(before[topic]["first_ns"]) == by, f"{f.name}: {topic}: first stamp")
            check(int(after[topic]["last_ns"]) - int(before[topic]["last_ns"]) == by, f"{f.name}: {topic}: last stamp")
        found = answer(f)
        check((found["offset_ns"], found["sigma_s"]) == (of_asl["offset_ns"], of_asl["sigma_s"]),
              f"{f.name}: align says {found['offset_ns']} ns, of the ASL folder {of_asl['offset_ns']} ns")
        then = answer(moved[f])
        check(abs(then["offset_ns"] + x_ns - found["offset_ns"]) <= 1000,
              f"{f.name}: after apply of {x_ns} ns align moved by {then['offset_ns'] - found['offset_ns']} ns")
        print(f"{f.name:18} align {found['offset_ns']} ns ± {found['sigma_s']:.3g} s; after apply of {x_ns}: {then['offset_ns']} ns")
    convert(files, of_asl, out)
    print(f"{len(files)} files, {len(failures)} failures")
    sys.exit(1 if failures else 0)


main()
