// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/convert.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "takt/error.h"
#include "takt/recording/open_recording.h"
#include "takt/recording/output_file.h"
#include "takt/simulation/folder_writer.h"
#include "takt/simulation/yaml_text.h"
#include "takt/streams/stream_name.h"

namespace takt {

namespace {

template <class Stream>
void keep_named(std::vector<Stream>& streams, const std::string& name) {
  std::erase_if(streams, [&](const Stream& s) { return !name_matches(name, s.name); });
}

Recording chosen(const ConvertJob& job) {
  Recording r = open_recording(job.in, job.open);
  if (!job.stream.empty()) {
    keep_named(r.imus, job.stream);
    keep_named(r.cameras, job.stream);
  }
  if (r.imus.empty() && r.cameras.empty())
    throw Error("has no IMU and no camera" + (job.stream.empty() ? "" : " named " + job.stream), job.in,
                "takt inspect lists what it has");
  return r;
}

/// ASL's folders are cam0, cam1, ... and imu0, imu1, ...; where a name is another all of a kind are numbered.
template <class Stream>
void give_asl_names(std::vector<Stream>& streams, const std::string& kind, Written& out) {
  const auto is_asl = [&](const std::string& name) {
    return name.starts_with(kind) && name.size() > kind.size() &&
           name.find_first_not_of("0123456789", kind.size()) == std::string::npos;
  };
  const bool keep = std::all_of(streams.begin(), streams.end(), [&](const Stream& s) { return is_asl(s.name); });
  for (std::size_t i = 0; i < streams.size(); ++i) {
    const std::string before = streams[i].name;
    if (!keep) streams[i].name = kind + std::to_string(i);
    out.streams.push_back({before, streams[i].name, streams[i].size()});
  }
}

Written to_asl(Recording recording, const ConvertJob& job) {
  Written out;
  std::erase_if(recording.cameras, [&](const CameraStream& c) {
    if (!c.open) out.notes.push_back(c.name + " has no pictures and is left out");
    return !c.open;
  });
  give_asl_names(recording.imus, "imu", out);
  give_asl_names(recording.cameras, "cam", out);
  NewFolder folder(job.out);
  write_asl(recording, folder, job.threads, job.progress);
  folder.finish();
  out.notes.emplace_back(
      "pictures are written as takt sees them, in grey; the recorder's times have no place in such a folder");
  return out;
}

Written to_csv(const Recording& recording, const ConvertJob& job) {
  if (recording.imus.size() != 1)
    throw Error(fmt::format("has {} IMUs, and a CSV log holds one", recording.imus.size()), job.in,
                "name it with --sensor");
  const ImuStream& imu = recording.imus[0];
  std::string text = imu.accel_m_s2.empty() ? "t_ns,wx,wy,wz\n" : "t_ns,wx,wy,wz,ax,ay,az\n";
  append_imu_rows(imu, text);
  OutputFile file(job.out);
  file.write(text);
  file.finish();
  Written out{{{imu.name, imu.name, imu.size()}}, {}};
  if (!recording.cameras.empty()) out.notes.emplace_back("cameras have no place in a CSV log");
  return out;
}

}  // namespace

ConvertTo convert_to(const std::string& name) {
  const std::string ending = std::filesystem::path(name).extension().string();
  if (ending == ".mcap") return ConvertTo::mcap;
  if (ending == ".bag") return ConvertTo::ros1_bag;
  if (ending == ".db3") return ConvertTo::db3;
  if (ending == ".csv") return ConvertTo::csv;
  if (ending.empty()) return ConvertTo::asl;
  throw Error("takt does not write " + ending, name,
              "it writes .mcap, .bag, .db3, .csv (one IMU), and without an ending an ASL folder");
}

Written convert(const ConvertJob& job) {
  Recording recording = chosen(job);
  switch (job.to) {
    case ConvertTo::mcap:
      return write_mcap(recording, job.out);
    case ConvertTo::ros1_bag:
      return write_ros1_bag(recording, job.out);
    case ConvertTo::db3:
      return write_db3(recording, job.out);
    case ConvertTo::csv:
      return to_csv(recording, job);
    case ConvertTo::asl:
      break;
  }
  return to_asl(std::move(recording), job);
}

}  // namespace takt
