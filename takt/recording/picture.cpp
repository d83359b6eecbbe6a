// SPDX-License-Identifier: Apache-2.0
#include "takt/recording/picture.h"

#include <opencv2/imgcodecs.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "takt/error.h"
#include "takt/recording/files.h"
#include "takt/recording/lower_case.h"
#include "takt/recording/output_file.h"
#include "takt/recording/stored_picture.h"

namespace takt {

namespace {

/// Nothing where the file cannot be read.
std::string bytes_in(const std::string& path) {
  try {
    return read_file(path);
  } catch (const Error&) {
    return {};
  }
}

/// A picture of this many pixels is a broken header, not a camera's.
constexpr std::size_t most_bytes = 1U << 30;

constexpr std::string_view png_magic = "\x89PNG", jpeg_magic = "\xFF\xD8";

class PictureReader : public FrameReader, public KeepsStored {
 public:
  explicit PictureReader(std::shared_ptr<const std::vector<PictureFile>> files) : files_(std::move(files)) {}

  std::optional<Frame> next() override {
    while (place_ < files_->size()) {
      const PictureFile& file = (*files_)[place_++];
      encoded_ = bytes_in(file.path);
      GrayImage image = decode_picture(std::as_bytes(std::span(encoded_)));
      if (!image.empty()) return Frame{file.index, file.stamp, file.exposure_s, std::move(image)};
      ++broken_;
    }
    return std::nullopt;
  }

  void skip_to(std::size_t index) override {
    while (place_ < files_->size() && (*files_)[place_].index < index) ++place_;
  }

  [[nodiscard]] std::optional<StoredPicture> stored() const override {
    const std::string_view format = encoded_.starts_with(jpeg_magic)  ? "jpeg"
                                    : encoded_.starts_with(png_magic) ? "png"
                                                                      : "";
    if (format.empty()) return std::nullopt;
    return EncodedPicture{format, std::as_bytes(std::span(encoded_))};
  }

 private:
  std::shared_ptr<const std::vector<PictureFile>> files_;
  std::size_t place_ = 0;
  std::string encoded_;  // the last one
};

std::uint32_t big_endian(std::span<const std::byte> four) {
  std::uint32_t value = 0;
  for (const std::byte b : four) value = value << 8 | std::to_integer<std::uint32_t>(b);
  return value;
}

/// Chunks of length, type, data and checksum up to the end's, every checksum right.
bool whole_png(std::span<const std::byte> encoded) {
  constexpr std::size_t signature = 8, around = 12;
  for (std::size_t place = signature; encoded.size() >= place + around;) {
    const std::uint32_t length = big_endian(encoded.subspan(place, 4));
    if (length > encoded.size() - place - around) return false;
    const auto type_and_data = encoded.subspan(place + 4, 4 + std::size_t{length});
    place += around + length;
    if (crc32_of(type_and_data) != big_endian(encoded.subspan(place - 4, 4))) return false;
    if (big_endian(type_and_data.first(4)) == 0x49454E44) return true;  // "IEND"
  }
  return false;
}

/// Whether a PNG is as it was written and a JPEG goes on to its end mark. Of what is damaged or cut off the decoder
/// would make half a picture, and say so in a line of its own on stderr.
bool whole(std::span<const std::byte> encoded) {
  const std::string_view text(reinterpret_cast<const char*>(encoded.data()), encoded.size());
  constexpr std::string_view jpeg_end = "\xFF\xD9";
  if (text.starts_with(png_magic)) return whole_png(encoded);
  if (text.starts_with(jpeg_magic)) return text.rfind(jpeg_end) != std::string_view::npos;
  return true;
}

}  // namespace

GrayImage decode_picture(std::span<const std::byte> encoded) {
  if (encoded.empty() || encoded.size() > most_bytes) return {};
  if (!whole(encoded)) return {};
  auto pixels = std::make_shared<cv::Mat>();
  try {
    // A view: imdecode reads the bytes in place.
    const cv::Mat bytes(1, static_cast<int>(encoded.size()), CV_8UC1,
                        const_cast<void*>(static_cast<const void*>(encoded.data())));
    *pixels = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    return {};
  }
  if (pixels->empty()) return {};
  return {pixels->cols, pixels->rows, static_cast<std::ptrdiff_t>(pixels->step), pixels->data, pixels};
}

GrayImage read_picture(const std::string& path) {
  const std::string encoded = bytes_in(path);
  return decode_picture(std::as_bytes(std::span(encoded)));
}

bool is_picture_file(const std::string& path) {
  constexpr std::array endings{".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".tif", ".tiff"};
  return std::find(endings.begin(), endings.end(), ending_of(path)) != endings.end();
}

std::unique_ptr<FrameReader> read_pictures(std::shared_ptr<const std::vector<PictureFile>> files) {
  return std::make_unique<PictureReader>(std::move(files));
}

}  // namespace takt
