#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""logs_and_folders.py TAKT DATA_FOLDER WORK_FOLDER: real recordings written down in other tools' logs and folders.

Whatever the format, the answer of `takt align` is the same; `takt apply` of 0 gives the same bytes back; of +x it moves
the answer by -x. Ends with 77 where the real recordings are not here.
"""
import csv
import datetime
import filecmp
import json
import pathlib
import shutil
import subprocess
import sys

takt, data, work = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]).resolve()
x_ns = 12_345_000  # in whole microseconds, the coarsest of these formats' stamps
failures = []


def check(good, words):
    if not good:
        failures.append(words)
        print("FAILED: " + words)


def rows(path):
    with open(path, newline="") as file:
        return [row for row in csv.reader(file) if row and not row[0].startswith("#")]


def align(*arguments):
    done = subprocess.run([takt, "align", *map(str, arguments), "--json", "-q"], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise RuntimeError(f"{arguments}: {done.stderr}")
    found = json.loads(done.stdout)
    return found["offset_ns"], found["sigma_s"]


def apply(by_ns, stream, path, out):
    result = work / "result.json"
    result.write_text(json.dumps({"schema": "takt/1", "verdict": "trusted", "sensor": stream, "reference": "?",
                                  "offset_ns": by_ns, "offset_s": by_ns * 1e-9, "epoch_ns": 0}))
    subprocess.run([takt, "apply", result, path, "-o", out, "-q"], check=True, capture_output=True)


def same(a, b):
    if a.is_file():
        return filecmp.cmp(a, b, shallow=False)
    names = [sorted(f.relative_to(root) for f in root.rglob("*")) for root in (a, b)]
    return names[0] == names[1] and all(filecmp.cmp(a / n, b / n, shallow=False) for n in names[0] if (a / n).is_file())


def there_and_back(name, path, stream, more, of_others):
    """`more` follows the recording on align's command line; `of_others` is what align says of the same in another form."""
    found = align(path, *more)
    if of_others is not None:
        check(abs(found[0] - of_others[0]) <= 1000, f"{name}: align says {found[0]} ns, of another format {of_others[0]} ns")
    unmoved, moved = work / "same" / path.name, work / "moved" / path.name
    for out in (unmoved, moved):
        out.parent.mkdir(exist_ok=True)
    apply(0, stream, path, unmoved)
    check(same(path, unmoved), f"{name}: apply of 0 gives other bytes")
    apply(x_ns, stream, path, moved)
    then = align(moved, *more)
    check(abs(then[0] + x_ns - found[0]) <= 1000, f"{name}: after apply of {x_ns} ns align moved by {then[0] - found[0]} ns")
    print(f"{name:22} align {found[0]} ns ± {found[1]:.3g} s; after apply of {x_ns}: {then[0]} ns")
    return found


def logs():
    """The microcontroller's gyro, in the columns and units of others, against the phone's."""
    phone = data / "phone_mcu_gyro/smartphone_gyro_data.csv"
    # To the microsecond, so that every format says the same stamps.
    samples = [(round(float(r[0]) * 1e6), *(float(v) for v in r[1:])) for r in rows(data / "phone_mcu_gyro/mcu_gyro_data.csv")[1:]]
    degrees = 57.29577951308232
    texts = {
        "mcu_s.csv": "time,wx,wy,wz\n" + "".join(f"{t // 10**6}.{t % 10**6:06},{x!r},{y!r},{z!r}\n" for t, x, y, z in samples),
        "mcu_ns.csv": "t_ns,wx,wy,wz\n" + "".join(f"{t * 1000},{x!r},{y!r},{z!r}\n" for t, x, y, z in samples),
        "phone_gyro.csv": "x,y,z,t_ns\r\n" + "".join(f"{x!r},{y!r},{z!r},{t * 1000}\r\n" for t, x, y, z in samples),
        "betaflight.csv": "loopIteration,time (us),gyroADC[0] (deg/s),gyroADC[1] (deg/s),gyroADC[2] (deg/s)\n" + "".join(
            f"{i}, {t}, {x * degrees!r}, {y * degrees!r}, {z * degrees!r}\n" for i, (t, x, y, z) in enumerate(samples)),
        "gyroflow.gcsv": "GYROFLOW IMU LOG\nversion,1.3\norientation,XYZ\ntscale,0.000001\ngscale,1\nt,gx,gy,gz\n" + "".join(
            f"{t},{x!r},{y!r},{z!r}\n" for t, x, y, z in samples),
    }
    first = None
    for name, text in texts.items():
        (work / name).write_bytes(text.encode())
        found = there_and_back(name, work / name, (work / name).stem, [phone], first)
        first = first or found


def folders():
    """A camera and an IMU as they lie in the folders of others."""
    asl = data / "euroc_micro"
    imu, camera = rows(asl / "mav0/imu0/data.csv"), rows(asl / "mav0/cam0/data.csv")
    lens = ["--intrinsics", asl / "mav0/cam0/sensor.yaml"]
    pictures = [(int(ns), asl / "mav0/cam0/data" / name) for ns, name in camera]

    kalibr = work / "kalibr"
    (kalibr / "cam0").mkdir(parents=True)
    for ns, picture in pictures:
        shutil.copy(picture, kalibr / "cam0" / f"{ns}{picture.suffix}")
    (kalibr / "imu0.csv").write_text("timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z\n" + "".join(",".join(r[:7]) + "\n" for r in imu))

    def date(ns):
        return datetime.datetime.fromtimestamp(ns // 10**9, datetime.timezone.utc).strftime("%Y-%m-%d %H:%M:%S") + f".{ns % 10**9:09}\n"

    kitti = work / "kitti"
    (kitti / "image_00/data").mkdir(parents=True)
    (kitti / "oxts/data").mkdir(parents=True)
    for i, (ns, picture) in enumerate(pictures):
        shutil.copy(picture, kitti / "image_00/data" / f"{i:010}{picture.suffix}")
    (kitti / "image_00/timestamps.txt").write_text("".join(date(ns) for ns, _ in pictures))
    for i, r in enumerate(imu):
        numbers = ["0"] * 11 + r[4:7] + ["0"] * 3 + r[1:4] + ["0"] * 10
        (kitti / "oxts/data" / f"{i:010}.txt").write_text(" ".join(numbers) + "\n")
    (kitti / "oxts/timestamps.txt").write_text("".join(date(int(r[0])) for r in imu))

    copied = work / "asl"
    shutil.copytree(asl, copied)
    of_asl = there_and_back("ASL folder", copied, "cam0", ["--sensor", "cam0", "--reference", "imu0", *lens], None)
    there_and_back("Kalibr folder", kalibr, "cam0", lens, of_asl)
    there_and_back("KITTI raw drive", kitti, "image_00", lens, of_asl)


def main():
    if not (data / "euroc_micro").is_dir() or not (data / "phone_mcu_gyro").is_dir():
        print(f"skipped: the real recordings {data}/euroc_micro and phone_mcu_gyro are not here")
        sys.exit(77)
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    logs()
    folders()
    print(f"{len(failures)} failures")
    sys.exit(1 if failures else 0)


main()
