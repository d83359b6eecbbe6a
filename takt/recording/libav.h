// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <memory>
#include <string>

struct AVFormatContext;
struct AVCodecContext;
struct AVPacket;
struct AVFrame;
struct AVStream;
struct SwsContext;

/// libavformat and libavcodec behind owning handles. OpenCV's VideoCapture is not used: it loses frames of GoPro files
/// and its time stamps are made up from a frame rate.
namespace takt::av {

struct Release {
  void operator()(AVFormatContext* p) const;
  void operator()(AVCodecContext* p) const;
  void operator()(AVPacket* p) const;
  void operator()(AVFrame* p) const;
  void operator()(SwsContext* p) const;
};
using File = std::unique_ptr<AVFormatContext, Release>;
using Decoder = std::unique_ptr<AVCodecContext, Release>;
using Packet = std::unique_ptr<AVPacket, Release>;
using Picture = std::unique_ptr<AVFrame, Release>;
using Scaler = std::unique_ptr<SwsContext, Release>;

/// Opens a container by its header alone: which streams there are, and their tags. Throws takt::Error.
[[nodiscard]] File open_header(const std::string& path);
/// Opens a container and finds out all about its streams, if need be by a look at their packets. Throws takt::Error.
[[nodiscard]] File open_file(const std::string& path);
/// Only these two streams are read from the file; −1 stands for none.
void read_only(AVFormatContext& file, int stream, int other = -1);
[[nodiscard]] Packet new_packet();
[[nodiscard]] Picture new_picture();

/// The stream that is the video: the longest one with a picture size; −1 without any. Cover art does not count.
[[nodiscard]] int video_stream(const AVFormatContext& file);
/// GoPro's telemetry track; −1 without one.
[[nodiscard]] int gpmf_stream(const AVFormatContext& file);

/// A presentation time in the stream's ticks as nanoseconds, in integer arithmetic, to the nearest.
[[nodiscard]] std::int64_t to_ns(std::int64_t ticks, const AVStream& stream);
/// What libav says about its error code.
[[nodiscard]] std::string words(int code);

}  // namespace takt::av
