// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/video_frames.h"

#include <fmt/format.h>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <limits>
#include <new>

#include "takt/error.h"
#include "takt/recording/libav.h"

namespace takt {

namespace {

bool has_byte_luma_plane(AVPixelFormat format) {
  const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(format);
  if (d == nullptr) return false;
  constexpr std::uint64_t unlike =
      AV_PIX_FMT_FLAG_RGB | AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_BITSTREAM | AV_PIX_FMT_FLAG_HWACCEL;
  const AVComponentDescriptor& luma = d->comp[0];
  return (d->flags & unlike) == 0 && luma.plane == 0 && luma.depth == 8 && luma.step == 1 && luma.offset == 0;
}

av::Decoder open_decoder(const AVStream& stream, const std::string& path, int threads) {
  const AVCodec* codec = avcodec_find_decoder(stream.codecpar->codec_id);
  const char* name = avcodec_get_name(stream.codecpar->codec_id);
  if (codec == nullptr) throw Error(fmt::format("no decoder for {} video", name), path, "convert it to H.264");
  av::Decoder decoder(avcodec_alloc_context3(codec));
  if (decoder == nullptr) throw std::bad_alloc();
  int code = avcodec_parameters_to_context(decoder.get(), stream.codecpar);
  if (code >= 0) {
    decoder->pkt_timebase = stream.time_base;
    decoder->thread_count = std::max(threads, 1);
    decoder->thread_type = FF_THREAD_FRAME | FF_THREAD_SLICE;
    code = avcodec_open2(decoder.get(), codec, nullptr);
  }
  if (code < 0)
    throw Error(fmt::format("the {} decoder does not start: {}", name, av::words(code)), path, "convert it to H.264");
  return decoder;
}

class VideoFrames : public FrameReader {
 public:
  VideoFrames(const std::string& path, std::shared_ptr<const MediaIndex> index, std::vector<double> exposures_s,
              int threads)
      : index_(std::move(index)), exposures_s_(std::move(exposures_s)), file_(av::open_file(path)) {
    stream_ = av::video_stream(*file_);
    if (stream_ < 0) throw Error("has no video stream any more", path, "did the file change while it was read?");
    av::read_only(*file_, stream_);
    decoder_ = open_decoder(*file_->streams[stream_], path, threads);
  }

  /// Jumps to a key frame where that saves decoding.
  void skip_to(std::size_t index) override {
    if (index <= expected_ || index >= index_->ticks.size()) return;
    expected_ = index;  // earlier pictures are passed over: they are not broken
    // Pictures shown just before a key frame may come after it in the file and lean on an earlier one.
    constexpr std::size_t deepest_reordering = 16;
    const std::int64_t target = index_->ticks[index - std::min(index, deepest_reordering)];
    const AVIndexEntry* key =
        avformat_index_get_entry_from_timestamp(file_->streams[stream_], target, AVSEEK_FLAG_BACKWARD);
    if (key == nullptr || key->timestamp <= fed_) return;
    if (av_seek_frame(file_.get(), stream_, target, AVSEEK_FLAG_BACKWARD) < 0) return;
    avcodec_flush_buffers(decoder_.get());
    drained_ = false;
  }

  std::optional<Frame> next() override {
    while (decode()) {
      const std::optional<std::size_t> place = place_of(*picture_);
      if (!place || !is_sound(*picture_)) continue;  // counted as broken when its place is passed over
      broken_ += *place - expected_;
      expected_ = *place + 1;
      return frame(*place);
    }
    broken_ += index_->stamps.size() - expected_;
    expected_ = index_->stamps.size();
    return std::nullopt;
  }

 private:
  /// The next picture into `picture_`; false at the end.
  bool decode() {
    picture_ = av::new_picture();  // a fresh one: images that were handed out keep theirs
    for (;;) {
      const int got = avcodec_receive_frame(decoder_.get(), picture_.get());
      if (got == 0) return true;
      if (got == AVERROR_EOF) return false;
      // A picture that cannot be decoded: the next one may. After the last packet that must come to an end.
      if (got != AVERROR(EAGAIN) && drained_ && ++failures_ > decoder_->thread_count) return false;
      feed();
    }
  }

  /// Gives the decoder one packet of the video, or tells it that there are no more.
  void feed() {
    while (av_read_frame(file_.get(), packet_.get()) >= 0) {
      const bool ours = packet_->stream_index == stream_;
      if (ours && packet_->dts != AV_NOPTS_VALUE) fed_ = packet_->dts;
      if (ours && packet_->pts == AV_NOPTS_VALUE) packet_->pts = packet_->dts;  // as index_media does
      if (ours) (void)avcodec_send_packet(decoder_.get(), packet_.get());       // a refused packet is a missing picture
      av_packet_unref(packet_.get());
      if (ours) return;
    }
    (void)avcodec_send_packet(decoder_.get(), nullptr);
    drained_ = true;
  }

  std::optional<std::size_t> place_of(const AVFrame& picture) const {
    const auto from = index_->ticks.begin() + static_cast<std::ptrdiff_t>(expected_);
    const auto at = std::lower_bound(from, index_->ticks.end(), picture.best_effort_timestamp);
    if (at == index_->ticks.end() || *at != picture.best_effort_timestamp) return std::nullopt;
    return static_cast<std::size_t>(at - index_->ticks.begin());
  }

  /// A picture whose damage was painted over would be taken for motion.
  bool is_sound(const AVFrame& picture) const {
    return (picture.flags & (AV_FRAME_FLAG_CORRUPT | AV_FRAME_FLAG_DISCARD)) == 0 && picture.decode_error_flags == 0 &&
           picture.width == decoder_->width && picture.height == decoder_->height;
  }

  Frame frame(std::size_t place) {
    Frame f;
    f.index = place;
    f.stamp = index_->stamps[place];
    if (!exposures_s_.empty()) f.exposure_s = exposures_s_[place];
    f.image = luma();
    return f;
  }

  GrayImage luma() {
    if (!has_byte_luma_plane(static_cast<AVPixelFormat>(picture_->format))) picture_ = to_gray(*picture_);
    GrayImage image{picture_->width, picture_->height, picture_->linesize[0], picture_->data[0], nullptr};
    image.owner = std::shared_ptr<const AVFrame>(std::move(picture_));
    return image;
  }

  av::Picture to_gray(const AVFrame& picture) {
    av::Picture gray = av::new_picture();
    gray->format = AV_PIX_FMT_GRAY8;
    gray->width = picture.width;
    gray->height = picture.height;
    if (av_frame_get_buffer(gray.get(), 0) < 0) throw std::bad_alloc();
    scaler_.reset(sws_getCachedContext(scaler_.release(), picture.width, picture.height,
                                       static_cast<AVPixelFormat>(picture.format), picture.width, picture.height,
                                       AV_PIX_FMT_GRAY8, SWS_POINT, nullptr, nullptr, nullptr));
    if (scaler_ == nullptr) throw std::bad_alloc();
    sws_scale(scaler_.get(), picture.data, picture.linesize, 0, picture.height, gray->data, gray->linesize);
    return gray;
  }

  std::shared_ptr<const MediaIndex> index_;
  std::vector<double> exposures_s_;
  av::File file_;
  int stream_ = -1;
  av::Decoder decoder_;
  av::Packet packet_ = av::new_packet();
  av::Picture picture_;
  av::Scaler scaler_;
  std::int64_t fed_ = std::numeric_limits<std::int64_t>::min();  // decoding time of the last packet
  bool drained_ = false;                                         // the decoder has had the last packet
  int failures_ = 0;                                             // pictures lost since then
  std::size_t expected_ = 0;                                     // place of the next picture in the index
};

}  // namespace

std::unique_ptr<FrameReader> read_frames(const std::string& path, std::shared_ptr<const MediaIndex> index,
                                         std::vector<double> exposures_s, int threads) {
  return std::make_unique<VideoFrames>(path, std::move(index), std::move(exposures_s), threads);
}

}  // namespace takt
