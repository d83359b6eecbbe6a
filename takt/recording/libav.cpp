// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/libav.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswscale/swscale.h>
}

#include <mutex>
#include <new>

#include "takt/error.h"

namespace takt::av {

namespace {

/// libav writes its complaints to stderr, for the whole process. takt says itself what failed, so they are turned off
/// once, unless the program has chosen a level of its own.
void hush() {
  static std::once_flag once;
  std::call_once(once, [] {
    if (av_log_get_level() == AV_LOG_INFO) av_log_set_level(AV_LOG_QUIET);
  });
}

template <class T>
T* or_bad_alloc(T* p) {
  if (p == nullptr) throw std::bad_alloc();
  return p;
}

}  // namespace

void Release::operator()(AVFormatContext* p) const {
  avformat_close_input(&p);
}
void Release::operator()(AVCodecContext* p) const {
  avcodec_free_context(&p);
}
void Release::operator()(AVPacket* p) const {
  av_packet_free(&p);
}
void Release::operator()(AVFrame* p) const {
  av_frame_free(&p);
}
void Release::operator()(SwsContext* p) const {
  sws_freeContext(p);
}

File open_header(const std::string& path) {
  hush();
  AVFormatContext* raw = nullptr;
  // "file:" keeps a name such as "concat:a|b" or "http:…" from being taken for another protocol.
  const std::string url = "file:" + path;
  if (const int code = avformat_open_input(&raw, url.c_str(), nullptr, nullptr); code < 0)
    throw Error("not readable as a video: " + words(code), path,
                "the file may be cut short (an MP4 keeps its index at the end); repair it or copy it again");
  return File(raw);
}

File open_file(const std::string& path) {
  File file = open_header(path);
  if (const int code = avformat_find_stream_info(file.get(), nullptr); code < 0)
    throw Error("its streams cannot be identified: " + words(code), path, "repair the file or copy it again");
  return file;
}

void read_only(AVFormatContext& file, int stream, int other) {
  for (int i = 0; i < static_cast<int>(file.nb_streams); ++i)
    file.streams[i]->discard = i == stream || i == other ? AVDISCARD_DEFAULT : AVDISCARD_ALL;
}

Packet new_packet() {
  return Packet(or_bad_alloc(av_packet_alloc()));
}
Picture new_picture() {
  return Picture(or_bad_alloc(av_frame_alloc()));
}

int video_stream(const AVFormatContext& file) {
  int best = -1;
  for (unsigned i = 0; i < file.nb_streams; ++i) {
    const AVStream& s = *file.streams[i];
    if (s.codecpar->codec_type != AVMEDIA_TYPE_VIDEO || (s.disposition & AV_DISPOSITION_ATTACHED_PIC) != 0) continue;
    if (s.codecpar->width <= 0 || s.codecpar->height <= 0) continue;
    if (best < 0 || s.nb_frames > file.streams[best]->nb_frames) best = static_cast<int>(i);
  }
  return best;
}

int gpmf_stream(const AVFormatContext& file) {
  for (unsigned i = 0; i < file.nb_streams; ++i) {
    const AVCodecParameters& c = *file.streams[i]->codecpar;
    if (c.codec_type == AVMEDIA_TYPE_DATA && c.codec_tag == MKTAG('g', 'p', 'm', 'd')) return static_cast<int>(i);
  }
  return -1;
}

std::int64_t to_ns(std::int64_t ticks, const AVStream& stream) {
  return av_rescale_q_rnd(ticks, stream.time_base, AVRational{1, 1'000'000'000}, AV_ROUND_NEAR_INF);
}

std::string words(int code) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(code, text, sizeof text);
  return text;
}

}  // namespace takt::av
