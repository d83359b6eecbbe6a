// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/media_index.h"

#include <fmt/format.h>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
}

#include <algorithm>
#include <cmath>

#include "takt/error.h"
#include "takt/recording/libav.h"

namespace takt {

namespace {

double rotation_of(const AVStream& stream) {
  const auto* matrix =
      reinterpret_cast<const std::int32_t*>(av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr));
  if (matrix == nullptr) return 0;
  const double degrees = av_display_rotation_get(matrix);
  return std::isfinite(degrees) ? degrees : 0;
}

/// The presentation time, or the decoding time where both must be the same because no picture is reordered.
std::int64_t presentation_ticks(const AVPacket& packet, const AVStream& stream, const std::string& path) {
  if (packet.pts != AV_NOPTS_VALUE) return packet.pts;
  if (packet.dts != AV_NOPTS_VALUE && stream.codecpar->video_delay == 0) return packet.dts;
  throw Error(
      fmt::format("{} in this container has no presentation times", avcodec_get_name(stream.codecpar->codec_id)), path,
      "record into MP4, MOV or MKV, or remux it with its true frame times");
}

void sort_by_presentation(MediaIndex& index, const AVStream& stream) {
  std::sort(index.ticks.begin(), index.ticks.end());
  index.stamps.reserve(index.ticks.size());
  for (const std::int64_t t : index.ticks) index.stamps.push_back(from_ns(av::to_ns(t, stream)));
}

/// Tells pictures that an edit list hides on purpose from those that a cut or damaged file has lost.
void note_missing(MediaIndex& index, const AVStream& stream, std::int64_t hidden) {
  if (stream.nb_frames <= 0) return;  // a container that does not say how many there should be
  const std::int64_t listed = avformat_index_get_entries_count(&stream);
  const auto found = static_cast<std::int64_t>(index.stamps.size());
  if (found + hidden < listed)
    index.notes.push_back(
        fmt::format("the file is cut short or damaged: {} of {} pictures are there", found, listed - hidden));
  if (const std::int64_t edited = stream.nb_frames - listed + hidden; edited > 0)
    index.notes.push_back(fmt::format("the file's edit list hides {} of {} pictures", edited, stream.nb_frames));
}

}  // namespace

MediaIndex index_media(const std::string& path) {
  const av::File file = av::open_file(path);
  const int video = av::video_stream(*file), telemetry = av::gpmf_stream(*file);
  if (video < 0) throw Error("has no video stream", path, "pass the video file of the recording");
  av::read_only(*file, video, telemetry);

  const AVStream& pictures = *file->streams[video];
  MediaIndex index;
  index.width = pictures.codecpar->width;
  index.height = pictures.codecpar->height;
  index.codec = avcodec_get_name(pictures.codecpar->codec_id);
  index.rotation_deg = rotation_of(pictures);

  std::int64_t hidden = 0;
  const av::Packet packet = av::new_packet();
  while (av_read_frame(file.get(), packet.get()) >= 0) {
    const bool broken = (packet->flags & AV_PKT_FLAG_CORRUPT) != 0;
    if (packet->stream_index == video) {
      if ((packet->flags & AV_PKT_FLAG_DISCARD) != 0) {
        ++hidden;
      } else if (!broken) {
        index.ticks.push_back(presentation_ticks(*packet, pictures, path));
      }
    } else if (packet->stream_index == telemetry && !broken && packet->pts != AV_NOPTS_VALUE) {
      const AVStream& track = *file->streams[telemetry];
      index.telemetry.push_back({from_ns(av::to_ns(packet->pts, track)), Duration(av::to_ns(packet->duration, track)),
                                 std::string(reinterpret_cast<const char*>(packet->data),
                                             static_cast<std::size_t>(std::max(packet->size, 0)))});
    }
    av_packet_unref(packet.get());
  }
  if (index.ticks.empty())
    throw Error("no picture can be read", path, "the file is cut short or damaged; copy it again");
  sort_by_presentation(index, pictures);
  note_missing(index, pictures, hidden);
  if (index.rotation_deg != 0)
    index.notes.push_back(fmt::format(
        "players turn the picture by {:.0f} degrees; pixels stay as the sensor wrote them", index.rotation_deg));
  return index;
}

}  // namespace takt
